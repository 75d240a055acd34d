"""Recordings of any rate are cut into pieces of one rate, where both arms are known."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.learning.motion.sequence import PERIOD
from drake_dress.learning.recordings.pieces import APART, LENGTH, Pieces
from drake_dress.learning.timed_motion import TimedMotion
from tests.models.human.learned.drawn import pose

POSE = pose(np.tile([0.3, 0.2, 0.0, 0.6], (2, 1)))


def moving(rate: float, duration: float, seed: int = 0) -> TimedMotion:
    """Returns a person who moves along a line at a constant velocity, with uneven stamps."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.5, 1.5, round(duration * rate)) / rate)
    joints = POSE + 0.1 * time[:, None, None]
    return TimedMotion("line", time, joints, np.full((len(time), 2, 6), np.nan))


@pytest.mark.parametrize("rate", [12.0, 30.0, 120.0])
def test_pieces_are_the_motion_at_even_times(rate: float) -> None:
    motion = moving(rate, 12.0)
    pieces = Pieces.of([motion])
    samples = round(LENGTH / PERIOD) + 1
    assert pieces.joint_position.shape == (len(pieces), samples, 6, 3)
    for k in range(len(pieces)):
        time = motion.time[0] + k * APART + PERIOD * np.arange(samples)
        np.testing.assert_allclose(
            pieces.joint_position[k], POSE + 0.1 * time[:, None, None], atol=1e-9
        )
    duration = motion.time[-1] - motion.time[0]
    assert len(pieces) == int((duration - LENGTH) / APART) + 1
    assert np.isnan(pieces.sleeve).all()
    assert not pieces.intent.any()


def test_pieces_with_an_unknown_joint_are_left_out() -> None:
    motion = moving(30.0, 20.0)
    joints = motion.joints.copy()
    lost = motion.time > 9.0
    joints[lost, 4] = np.nan
    some = Pieces.of([TimedMotion("lost", motion.time, joints, motion.sleeves)])
    assert 0 < len(some) < len(Pieces.of([motion]))


def test_recordings_that_are_too_short_are_refused_in_one_line() -> None:
    with pytest.raises(UserError, match="no 5 s in which both arms are known"):
        Pieces.of([moving(30.0, 3.0), moving(30.0, 20.0).between(99.0, 100.0)])
