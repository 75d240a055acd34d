"""What sleeves are led to."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.learning.motion.goals import Goal, draw_goal, place_of, unit
from tests.learning.motion.persons import axis

AXIS = axis()
HAND, WAY = AXIS.G(0.0), AXIS.D(0.0)
CENTER = HAND + np.array([0.2, 0.1, 0.1])


def test_only_a_sleeve_on_its_arm_is_drawn_up() -> None:
    for on, expected in (
        (True, {"draw", "aside", "stay"}),
        (False, {"approach", "roam", "stay"}),
    ):
        goals = [draw_goal(np.random.default_rng(s), AXIS, CENTER, on, 3.0) for s in range(60)]
        assert {g.kind for g in goals} == expected
        assert all(4.0 <= g.until <= 8.0 for g in goals)
        for goal in goals:
            if goal.kind == "aside":
                assert 0.08 <= np.linalg.norm(goal.place - CENTER) <= 0.45 + 1e-12


def test_a_sleeve_is_brought_across_while_the_other_hand_waits() -> None:
    other = CENTER + [-0.4, -0.5, 0.1]
    goals = [draw_goal(np.random.default_rng(s), AXIS, CENTER, True, 0.0, other) for s in range(60)]
    across = [g for g in goals if g.kind == "across"]
    assert 15 < len(across) < 40
    for goal in across:
        share = (goal.place - CENTER) @ (other - CENTER) / np.sum((other - CENTER) ** 2)
        assert 0.1 <= share <= 0.6
        np.testing.assert_allclose(goal.place, CENTER + share * (other - CENTER))
    off = [draw_goal(np.random.default_rng(s), AXIS, CENTER, False, 0.0, other) for s in range(60)]
    assert all(g.kind != "across" for g in off)


def test_an_approach_goes_over_the_hand_along_the_forearm() -> None:
    missed = np.array([0.01, 0.02, -0.03])
    goal = Goal("approach", missed, 1.0)
    aside = unit(np.cross(WAY, [1.0, 0.0, 0.0]))
    before = place_of(goal, AXIS, HAND - 0.1 * WAY + 0.2 * aside, None)
    np.testing.assert_allclose(before, HAND - 0.10 * WAY + missed)
    np.testing.assert_allclose(place_of(goal, AXIS, HAND - 0.1 * WAY, None), HAND + missed)


@pytest.mark.parametrize("progress", [0.4, 1.5])
def test_a_sleeve_that_stays_goes_along_with_its_arm(progress: float) -> None:
    goal = Goal("stay", CENTER, 1.0)
    np.testing.assert_array_equal(place_of(goal, AXIS, CENTER, progress), AXIS.G(progress))
    np.testing.assert_array_equal(place_of(goal, AXIS, CENTER, None), CENTER)


def test_other_goals_are_places() -> None:
    for kind in ("aside", "roam"):
        place = place_of(Goal(kind, CENTER, 1.0), AXIS, HAND, 0.5)
        np.testing.assert_array_equal(place, CENTER)
