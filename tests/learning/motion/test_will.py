"""When an arm moves by will: after a rest, and when the armhole comes near."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.movements import SHARES, Armhole, Movements
from drake_dress.learning.motion.will import Will
from tests.learning.motion.persons import ARM, HOME, LIMITS, moving_arm

STEP = 0.1


def will(seed: int = 0, next_at: float = 1e9, helps_within: float = 0.3) -> Will:
    movements = Movements(ARM, HOME, LIMITS, np.random.default_rng(seed))
    return Will(moving_arm(), movements, next_at, helps_within)


def near(of: Will) -> Armhole:
    return Armhole(of.arm.hand + [0.1, 0.0, -0.1], np.array([0.0, 0.0, -1.0]))


def test_an_arm_rests_until_its_time_has_come() -> None:
    resting = will(next_at=2.0)
    assert resting.due(1.9, None) is None
    assert resting.due(2.0, None) in SHARES


def test_no_movement_is_due_during_another() -> None:
    moving = will(next_at=0.0)
    assert moving.begin(0.0, "reach", None)
    movement = moving.arm.movement
    assert movement is not None
    assert moving.due(movement.end - 0.01, None) is None
    assert moving.next_at > movement.end


def test_a_movement_that_there_is_none_of_does_not_begin() -> None:
    resting = will(next_at=0.0)
    assert not resting.begin(0.0, "return", None)
    assert resting.due(0.0, None) is not None


def test_a_hand_reaches_for_an_armhole_after_a_time_of_reaction_and_not_again_at_once() -> None:
    helper = will()
    far = Armhole(helper.arm.hand + [0.5, 0.0, 0.0], np.array([0.0, 0.0, -1.0]))
    assert all(helper.due(t, far) is None for t in np.arange(0.0, 2.0, STEP))
    due = [t for t in np.arange(2.0, 7.0, STEP) if helper.due(t, near(helper)) == "sleeve"]
    assert 2.15 <= due[0] <= 2.46 + STEP
    assert due[1] >= due[0] + 0.5
    assert len(due) <= 8


def test_a_hand_in_its_sleeve_does_not_reach_for_it() -> None:
    helper = will()
    assert helper.due(0.0, near(helper)) is None
    assert np.isfinite(helper.sleeve_at)
    # the sleeve has come over the hand meanwhile
    assert all(helper.due(t, None) is None for t in np.arange(0.1, 2.0, STEP))


def test_a_person_who_does_not_help_lets_the_armhole_come() -> None:
    idle = will(helps_within=0.0)
    assert all(idle.due(t, near(idle)) is None for t in np.arange(0.0, 5.0, STEP))


def test_movements_occur_in_their_shares() -> None:
    mover = will(next_at=0.0, helps_within=0.0)
    kinds = [mover.due(0.0, None) for _ in range(1000)]
    for kind, share in SHARES.items():
        # four standard deviations: wrong once in 16,000 seeds
        spread = 4.0 * np.sqrt(1000 * share * (1.0 - share))
        assert abs(kinds.count(kind) - 1000 * share) < spread


def test_a_reach_follows_its_armhole_and_is_given_up_after_a_time() -> None:
    helper = will()
    above = Armhole(helper.arm.hand + [0.0, 0.0, 0.15], np.array([0.0, 0.0, 1.0]))
    assert helper.begin(0.0, "sleeve", above)
    first = helper.arm.movement
    assert first is not None
    last = 0.0
    for t in np.arange(0.0, 12.0, STEP):
        moved = Armhole(above.center + [0.0, 0.02 * t, 0.0], above.into)
        before = helper.arm.movement
        helper.due(t, moved)
        if helper.arm.movement is not before:
            last = t
            # a further stroke does not move the hand at once
            assert before is not None
            assert helper.arm.movement is not None
            np.testing.assert_allclose(helper.arm.movement.position(t), before.position(t))
    assert helper.arm.movement is not None
    assert helper.arm.movement.goal[1] > first.goal[1] + 0.02
    assert 1.0 < last < 5.0


def test_a_reach_for_a_place_is_not_corrected() -> None:
    mover = will()
    assert mover.begin(0.0, "reach", None)
    movement = mover.arm.movement
    for t in np.arange(0.0, 3.0, STEP):
        mover.due(t, near(mover))
    assert mover.arm.movement is movement
