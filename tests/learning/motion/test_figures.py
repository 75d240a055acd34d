"""Figures of sequences whose motion is known."""

import numpy as np
import pytest

from drake_dress.learning.motion.figures import figures_of
from drake_dress.learning.motion.motion_file import MotionArrays


def straight(speed: float, count: int = 21) -> MotionArrays:
    """Returns a sequence in which the left hand moves at `speed`, m/s, and nothing else does."""
    joints = np.zeros((1, count, 6, 3), dtype=np.float32)
    joints[0, :, 2, 0] = speed * 0.05 * np.arange(count)
    flags = np.zeros((1, count, 2), dtype=np.uint8)
    intent = flags.copy()
    intent[..., 0] = 1
    return MotionArrays(joints, np.zeros((1, count, 2, 6), dtype=np.float32), intent, flags)


def test_a_hand_at_constant_speed() -> None:
    figures = figures_of([straight(0.4)])
    assert figures.count == 1
    assert figures.time == pytest.approx(1.0)
    assert figures.will == 0.5
    assert figures.rest == 0.5
    assert figures.speed[1] == pytest.approx(0.4, rel=1e-5)
    # of the two hands, one travels 0.4 m and one stays
    assert figures.hand_travel[0] == pytest.approx(0.2, rel=1e-5)
    assert figures.shoulder_travel == (0.0, 0.0)
    assert figures.on == 0.0


def test_a_slow_hand_is_at_rest() -> None:
    assert figures_of([straight(0.019)]).rest == 1.0
    assert figures_of([straight(0.021)]).rest == 0.5


def test_parts_of_different_lengths_count_by_their_time() -> None:
    figures = figures_of([straight(0.4, 21), straight(0.0, 61)])
    assert figures.count == 2
    assert figures.time == pytest.approx(4.0)
    assert figures.rest == pytest.approx(1.0 - 0.5 * 20 / 80)
