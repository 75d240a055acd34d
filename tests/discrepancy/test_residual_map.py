"""Where the simulation is off: by marker, region, limb, phase and time."""

import numpy as np
import pytest

from drake_dress.discrepancy.experiment import Told
from drake_dress.discrepancy.lab import SimulatedLab
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.residual_map import KINDS, Spot, limbs_touched, spots, worst
from drake_dress.discrepancy.whitening import whiten
from drake_dress.models.arrays import FloatArray
from tests.discrepancy.data import SCENARIO, quick_scenario

_NOISE = 1e-3


@pytest.fixture(scope="module")
def lab() -> SimulatedLab:
    return SimulatedLab.of(quick_scenario(), SCENARIO.parent)


def recording(lab: SimulatedLab, joints: FloatArray | None = None) -> Recording:
    """Returns markers that stay where they are: on the right forearm, on the left upper arm,
    and far from everyone; the first two are 1 cm over the skin."""
    posed = lab.person(()).posed
    measures = lab.measures
    sideways = np.array([0.0, 0.0, 1.0])
    places = []
    for first, radius in ((4, measures.forearm_radius), (0, measures.upper_arm_radius)):
        axis = posed[first + 1] - posed[first]
        up = np.cross(np.cross(axis, sideways), axis)
        middle = 0.5 * (posed[first] + posed[first + 1])
        places.append(middle + (radius + 0.01) * up / np.linalg.norm(up))
    places.append(np.array([3.0, 0.0, 1.0]))
    time = np.linspace(0.0, 2.0, 41)
    rest = lab.garment.rest_position
    return Recording(
        "still",
        time,
        np.zeros((41, 2, 3)),
        np.tile(places, (41, 1, 1)),
        rest[[0, len(rest) // 2, -1]],
        joint_position=joints,
        marker_noise=_NOISE,
    )


def test_markers_are_of_the_limb_whose_skin_they_are_near(lab: SimulatedLab) -> None:
    person = lab.person(())
    samples = np.arange(0, 41, 10)
    r = recording(lab)
    limb = limbs_touched(r, samples, person)
    names = [person.LIMB_NAMES[k] if k >= 0 else None for k in limb[0]]
    assert names == ["right_forearm", "left_upper_arm", None]
    assert np.array_equal(limb, np.tile(limb[0], (5, 1)))
    r.marker_position[10, 0] = np.nan
    assert limbs_touched(r, samples, person)[1, 0] == -1


def test_limbs_are_where_their_joints_were_measured(lab: SimulatedLab) -> None:
    person = lab.person(())
    away = np.tile(person.posed + np.array([0.0, 0.0, 0.5]), (41, 1, 1))
    assert (limbs_touched(recording(lab, away), np.arange(41), person) == -1).all()


def test_what_is_off_on_one_limb_is_told_of_that_limb_marker_and_time(lab: SimulatedLab) -> None:
    r = recording(lab)
    samples = [np.arange(41)]
    forces, touching = np.zeros((41, 2, 3)), np.ones(41)
    told = Told(r.marker_position.copy(), forces, touching)
    w = whiten([r], samples, [told], [told])
    wrong = Told(told.marker.copy(), forces, touching)
    wrong.marker[20:, 0, 2] += 8.0 * _NOISE
    found = spots(w, w.vector([wrong]), [r], lab.garment, [touching], samples, lab.person(()))
    first = {kind: next(s for s in found if s.kind == kind) for kind in ("limb", "marker", "time")}
    assert first["limb"].name == "right forearm in still"
    assert first["marker"].name.startswith("0 (")
    assert first["time"].name == "1 to 2 s of still"
    # half of the time, one coordinate of three
    assert first["limb"].rms == pytest.approx(8.0 * _NOISE * np.sqrt(21 / 41))
    assert first["limb"].whitened == pytest.approx(64.0 / 3.0 * 21 / 41)
    other = next(s for s in found if s.name == "left upper arm in still")
    assert other.rms == 0.0
    assert [s.whitened for s in found] == sorted((s.whitened for s in found), reverse=True)


def test_short_lists_name_every_kind() -> None:
    found = [Spot("time", f"{k}", 0.0, 0.0, 9.0 - k) for k in range(5)]
    found.append(Spot("limb", "left forearm", 0.0, 0.0, 1.0))
    assert [s.name for s in worst(found, 2)] == ["left forearm", "0", "1"]
    assert {s.kind for s in found} <= set(KINDS)
