import numpy as np

from drake_dress.discrepancy.lab import SimulatedLab
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.replay import Prediction, Replayer
from drake_dress.models.effects.grip import GripperLatency
from drake_dress.models.effects.mass import GravityTilt, SurfaceDensity
from drake_dress.models.effects.sensing import CameraTranslation, TimeOffset
from tests.discrepancy.data import SCENARIO, quick_scenario, recordings
from tests.present import present


def replayer(recording: Recording) -> Replayer:
    return Replayer(SimulatedLab.of(quick_scenario(), SCENARIO.parent), recording)


def off(prediction: Prediction, recording: Recording) -> float:
    """Returns the RMS residual of the markers, m."""
    residual = recording.marker_position - prediction.marker_position
    return float(np.sqrt(np.nanmean(np.sum(residual**2, axis=2))))


def test_the_model_replays_what_it_has_made_itself() -> None:
    (r,) = recordings(noise=False)
    for gain in (0.0, 6.0):
        told = replayer(r).run(gain=gain)
        assert off(told, r) < 1.5e-3
        assert np.abs(told.gripper_force - present(r.gripper_force))[5:].max() < 0.05


def test_markers_keep_a_wrong_simulation_near() -> None:
    (r,) = recordings(effects=[GravityTilt(about_y=0.06)], noise=False)
    free, kept = (off(replayer(r).run(gain=g), r) for g in (0.0, 6.0))
    assert kept < 0.6 * free


def test_the_effect_that_made_the_data_explains_it() -> None:
    for effect in (
        GravityTilt(about_y=0.06),
        SurfaceDensity(added=0.1),
        GripperLatency(delay=0.08),
        TimeOffset(offset=0.06),
        CameraTranslation(x=0.02),
    ):
        (r,) = recordings(effects=[effect], noise=False)
        without, with_it = replayer(r).run(), replayer(r).run([effect])
        pull = present(r.gripper_force)
        force = [np.sqrt(np.mean((p.gripper_force - pull) ** 2)) for p in (without, with_it)]
        assert off(with_it, r) < 1.5e-3
        assert off(without, r) > 5.0 * off(with_it, r)
        assert force[0] > 5.0 * force[1]


def test_markers_that_were_never_seen_do_not_matter() -> None:
    (r,) = recordings()
    lost = r.marker_position.copy()
    lost[:, ::2] = np.nan
    told = replayer(type(r)(**{**vars(r), "marker_position": lost})).run()
    assert np.isfinite(told.marker_position).all()
    assert off(told, r) < 6e-3


def test_the_innovations_of_the_right_model_are_its_noise() -> None:
    (r,) = recordings(seed=2)
    told = replayer(r).run()
    residual = (r.marker_position - told.marker_position).reshape(len(r.time), -1)
    residual = np.nan_to_num(residual)
    assert np.std(residual) < 1.25 * r.marker_noise
    lagged = np.sum(residual[1:] * residual[:-1]) / np.sum(residual**2)
    assert abs(lagged) < 0.3
