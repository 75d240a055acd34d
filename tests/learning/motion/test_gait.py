"""Walking swings the arms against each other and sways the torso."""

import numpy as np

from drake_dress.learning.motion.gait import Gait
from drake_dress.learning.motion.sequence import DURATION

GAIT = Gait(
    start=0.0,
    end=8.0,
    speed=1.2,
    turning=0.0,
    cadence=1.8,
    bob=0.02,
    sway=0.03,
    swing=0.3,
    bend=0.2,
    phase=0.4,
)


def test_a_bout_begins_and_ends_smoothly() -> None:
    shares = [GAIT.share(t) for t in (-1.0, 0.0, 0.3, 4.0, 7.7, 8.0, 9.0)]
    np.testing.assert_allclose(shares, [0.0, 0.0, 0.5, 1.0, 0.5, 0.0, 0.0], atol=1e-12)
    assert not GAIT.arm_angles(9.0).any()
    assert not GAIT.sway_of(9.0).any()


def test_arms_swing_against_each_other_and_elbows_only_bend() -> None:
    swings = np.array([GAIT.arm_angles(t) for t in np.linspace(1.0, 7.0, 200)])
    np.testing.assert_allclose(swings[:, 0, 1], -swings[:, 1, 1])
    assert np.abs(swings[:, 0, 1]).max() <= 0.3
    assert 0.29 < np.abs(swings[:, 0, 1]).max()
    assert swings[:, :, 3].min() >= 0.0


def test_the_torso_bobs_at_each_step_and_sways_at_every_other() -> None:
    times = np.linspace(1.0, 7.0, 1200)
    sway = np.array([GAIT.sway_of(t) for t in times])
    crossings = [np.count_nonzero(np.diff(np.sign(sway[:, c]))) for c in (1, 2)]
    steps = 6.0 * GAIT.cadence
    # a sine crosses zero twice a period; a period of the sway is two steps
    assert abs(crossings[0] - steps) <= 1
    assert abs(crossings[1] - 2 * steps) <= 1


def test_drawn_gaits_are_those_of_people() -> None:
    for seed in range(50):
        gait = Gait.drawn(np.random.default_rng(seed))
        assert 0.3 <= gait.speed <= 1.5
        assert 1.4 <= gait.cadence <= 2.1
        assert 2.0 <= gait.end - gait.start <= 12.0
        assert gait.start <= 0.6 * DURATION
