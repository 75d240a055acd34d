"""Sleeves begin in a phase of a dressing that the coat can be in."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.sleeve_start import SleeveStart, draw_start
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.garment.geodesics import Reach
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures
from tests.learning.motion.persons import HOME

REACH = Reach(0.45, (0.5, 0.5), (0.12, 0.12), 0.5)


def axes() -> tuple[ArmAxis, ArmAxis]:
    left, right = (Arm(BodyMeasures(), "standing", side).points(HOME) for side in ("left", "right"))
    return ArmAxis(*left[::-1]), ArmAxis(*right[::-1])


def starts(reach: Reach = REACH) -> list[SleeveStart]:
    return [draw_start(np.random.default_rng(s), reach, axes()) for s in range(60)]


def test_sleeves_are_within_the_coats_reach_of_each_other() -> None:
    tight = Reach(0.3, (0.5, 0.5), (0.12, 0.12), 0.5)
    apart = [float(np.linalg.norm(s.center[0] - s.center[1])) for s in starts(tight)]
    assert max(apart) <= 0.95 * 0.3 + 1e-9


def test_each_phase_occurs_and_progress_belongs_to_sleeves_on_arms() -> None:
    phases = set()
    for start in starts():
        phases.add(tuple(start.on.tolist()))
        assert ((start.progress > 0.0) == start.on).all()
        assert (start.progress < 2.0).all()
    assert len(phases) == 4


def test_a_sleeve_on_an_arm_surrounds_it_and_one_off_it_is_before_the_hand() -> None:
    wide = Reach(9.0, (9.0, 9.0), (0.12, 0.12), 9.0)
    for start in starts(wide):
        for i, axis in enumerate(axes()):
            place = axis.coordinates(start.center[i])
            if start.on[i]:
                assert place.l < 1e-9
            else:
                assert 0.08 <= np.linalg.norm(start.center[i] - axis.G(0.0)) <= 0.55


def test_grippers_hold_the_sleeves_from_nearby() -> None:
    for start in starts(Reach(0.45, (0.5, 0.5), (0.12, 0.12), 9.0)):
        off = np.linalg.norm(start.gripper - start.center, axis=1)
        np.testing.assert_allclose(off, 0.9 * 0.12)


def test_grippers_are_within_the_coats_reach_of_each_other() -> None:
    apart = [np.linalg.norm(s.gripper[0] - s.gripper[1]) for s in starts()]
    assert max(apart) <= 0.95 * REACH.between_grippers + 1e-12
    assert min(apart) < 0.9 * REACH.between_grippers


def test_starts_do_not_change_each_other() -> None:
    one = starts()[0]
    one.on[:] = ~one.on
    np.testing.assert_array_equal(starts()[0].on, ~one.on)
