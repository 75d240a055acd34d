"""A moving person: limbs keep their lengths, and the torso carries both arms."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.learning.motion.moving_person import MovingPerson
from drake_dress.learning.motion.torso import draw_turn
from drake_dress.models.arrays import FloatArray


def person(seed: int) -> MovingPerson:
    return MovingPerson(np.random.default_rng(seed))


def limbs(joints: FloatArray) -> FloatArray:
    ends = np.array([[0, 1], [1, 2], [3, 4], [4, 5]])
    lengths: FloatArray = np.linalg.norm(joints[ends[:, 0]] - joints[ends[:, 1]], axis=-1)
    return lengths


@pytest.mark.parametrize("seed", range(3))
def test_limbs_have_the_lengths_of_the_person(seed: int) -> None:
    mover = person(seed)
    mover.torso.strokes.append(draw_turn(np.random.default_rng(seed), 1.0))
    m = mover.person.measures
    expected = [m.upper_arm_length, m.forearm_length] * 2
    for time in (0.0, 1.7, 5.0):
        np.testing.assert_allclose(limbs(mover.joints(time)), expected, atol=1e-12)
        np.testing.assert_allclose(limbs(mover.trembling(time)), expected, atol=1e-12)


def test_a_tremor_shakes_the_hand_by_millimetres_and_leaves_the_shoulder() -> None:
    trembling = 0
    for seed in range(60):
        mover = person(seed)
        off = mover.trembling(0.3) - mover.joints(0.3)
        trembling += bool(np.abs(off).max() > 0.0)
        assert np.abs(off[[2, 5]]).max() < 0.02
        # shoulders go along with their hands by a few percent
        assert np.abs(off[[0, 3]]).max() < 0.002
    # one in five of 60, outside this range once in 10,000 seeds
    assert 1 <= trembling <= 26


def test_while_the_torso_turns_by_will_both_arms_do() -> None:
    mover = person(0)
    assert not mover.is_willed(1.0).any()
    turn = draw_turn(np.random.default_rng(0), 1.0)
    mover.torso.strokes.append(turn)
    assert mover.is_willed(1.0).all()
    assert not mover.is_willed(turn.end).any()


def test_the_torso_leans_with_a_hand_for_as_long_as_that_moves() -> None:
    mover = person(0)
    mover.lean_with(mover.arms[0], 0.0, share=1.0)
    assert not mover.torso.strokes
    arm = mover.arms[0]
    arm.movement = mover.movements(0).draw("reach", 0.0, arm.hand, None)
    assert arm.movement is not None
    mover.lean_with(arm, 0.0, share=0.0)
    assert not mover.torso.strokes
    mover.lean_with(arm, 0.0, share=1.0)
    assert mover.torso.strokes[0].end == pytest.approx(arm.movement.end)
