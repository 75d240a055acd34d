"""A scenario with arms: their start, their log, and the message when they cannot reach."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from drake_dress.diagrams.arms import ArmPlacement, ArmReachError, set_up_arms
from drake_dress.diagrams.run import RunOptions, run_scenario
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.errors import UserError
from drake_dress.models.arm.clearance import Capsules
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.sides import SIDES

SCENARIO = Path(__file__).parents[2] / "scenarios" / "dummy_standing.yaml"
COARSE = ("station.arms.model=panda", "plant.spacing=0.05", "controller.spacing=0.06")
NOBODY = Capsules(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
GRIPPERS = np.array([[-0.75, 0.22, 1.4], [-0.75, -0.22, 1.4]])
BEHIND = ArmPlacement(0.85, 1.0, 0.95, 0.6)


@pytest.mark.parametrize("ahead", [0.0, 0.4])
def test_arms_start_where_grippers_are(ahead: float) -> None:
    """The hands also have the wanted orientation, unless too near to their bases."""
    grippers = GRIPPERS + [ahead, 0.0, 0.0]
    setup = set_up_arms(BEHIND, grippers, NOBODY)
    assert np.linalg.det(BEHIND.hand) == pytest.approx(1.0)
    for i in (0, 1):
        arm = setup.pair.arms[i]
        tool = arm.links(setup.start[i])[-1]
        np.testing.assert_allclose(tool[:3, 3], grippers[i], atol=1e-3)
        if ahead:
            np.testing.assert_allclose(tool[:3, :3], BEHIND.hand, atol=0.1)
        assert (setup.start[i] > LIMITS.lower).all()
        assert (setup.start[i] < LIMITS.upper).all()


def test_arms_in_front_are_those_behind_turned_about() -> None:
    """Turned by half a turn, the right arm behind stands where the left one stands in front."""
    grippers = GRIPPERS + [0.4, 0.0, 0.0]
    front = replace(BEHIND, in_front=True)
    setup = set_up_arms(BEHIND, grippers, NOBODY)
    turned = set_up_arms(front, grippers[::-1] * [-1.0, -1.0, 1.0], NOBODY)
    np.testing.assert_allclose(turned.start, setup.start[::-1], atol=1e-6)
    assert front.base("left")[:2, 3] == pytest.approx([0.85, 0.5])
    assert np.linalg.det(front.hand) == pytest.approx(1.0)
    assert front.hand[0, 2] < 0.0 < BEHIND.hand[0, 2], "the hands point toward the person"


def test_a_place_out_of_reach_is_told() -> None:
    with pytest.raises(ArmReachError, match=r"left arm does not reach .* \d\d\.\d cm short"):
        set_up_arms(BEHIND, GRIPPERS + [1.5, 0.0, 0.0], NOBODY)


@pytest.mark.parametrize(
    ("behind", "where"),
    [(3.0, "its gripper's place at the start"), (1.0, "above the person's shoulder")],
)
def test_a_run_that_cannot_succeed_writes_nothing(
    behind: float, where: str, tmp_path: Path
) -> None:
    scenario = load_scenario(SCENARIO, [*COARSE, f"station.arms.distance_behind={behind}"])
    with pytest.raises(UserError, match=f"station.arms: the left arm does not reach {where}"):
        run_scenario(scenario, SCENARIO, tmp_path / "out", RunOptions(meshcat=False))
    assert not (tmp_path / "out").exists()


def test_grippers_on_arms_go_where_they_are_sent(tmp_path: Path) -> None:
    # steps so short that most of them fall between samples
    scenario = load_scenario(SCENARIO, [*COARSE, "duration=2.0", "plant.body_time_step=0.004"])
    run_scenario(scenario, SCENARIO, tmp_path, RunOptions(meshcat=False))
    with h5py.File(tmp_path / "run.h5") as log:
        for side in SIDES:
            q, asked = log[f"arm/{side}/q"][:], log[f"arm/{side}/q_commanded"][:]
            assert np.abs(q - asked).max() < 0.02
            assert (np.abs(log[f"arm/{side}/v"][:]) <= LIMITS.speed).all()
            assert (q > LIMITS.lower).all()
            assert (q < LIMITS.upper).all()
            # extreme values between samples are in the log, too
            least, most = log[f"arm/{side}/q_least"][:], log[f"arm/{side}/q_most"][:]
            assert (least <= q).all()
            assert (q <= most).all()
            between = (least[1:] < np.minimum(q[1:], q[:-1])) | (
                most[1:] > np.maximum(q[1:], q[:-1])
            )
            assert between.any()
            peak, now = log[f"arm/{side}/v_peak"][:], np.abs(log[f"arm/{side}/v"][:])
            assert (peak >= now).all()
            assert (peak > now).mean() > 0.5
            assert (peak <= LIMITS.speed).all()
            torque = log[f"arm/{side}/torque_peak"][:]
            assert (torque >= np.abs(log[f"arm/{side}/torque"][:])).all()
            assert (torque <= LIMITS.torque).all()
            moved = np.linalg.norm(np.diff(log[f"gripper/{side}/position"][:], axis=0), axis=1)
            assert moved.sum() > 0.05
        assert log["arm/clearance"][:].min() > 0.045
        np.testing.assert_array_equal(
            log["arm/clearance"].attrs["names"],
            ["between arms", "left arm to person", "right arm to person"],
        )
