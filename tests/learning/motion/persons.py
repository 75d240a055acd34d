"""Arms, goals and sequences that the tests share."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.arms import Following, MovingArm
from drake_dress.learning.motion.motion_file import MotionArrays
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures

ARM = Arm(BodyMeasures(), "standing", "left")
HOME = np.array([0.2, 0.1, 0.0, 0.6])
LIMITS = np.array([[-0.6, -2.6, -1.4, 0.0], [2.6, 1.2, 1.4, 2.5]])
STAYS = 1e6  # s, time constant of an arm that stays where it is led


def moving_arm(
    lag: float = 0.1, drag: float = 0.0, returning: float = STAYS, clearance: float = 0.03
) -> MovingArm:
    """Returns an arm in its comfortable pose."""
    effort = np.array([1.0, 1.0, 0.6, 0.4])
    following = Following(lag, drag, returning, clearance)
    return MovingArm(ARM, HOME.copy(), HOME, LIMITS, effort, following)


def axis() -> ArmAxis:
    """Returns the axis of an arm in its comfortable pose."""
    shoulder, elbow, hand = ARM.points(HOME)
    return ArmAxis(hand, elbow, shoulder)


def made_up(count: int, length: int, seed: int = 0) -> MotionArrays:
    """Returns sequences of random numbers."""
    rng = np.random.default_rng(seed)
    return MotionArrays(
        rng.normal(size=(count, length, 6, 3)).astype(np.float32),
        rng.normal(size=(count, length, 2, 6)).astype(np.float32),
        rng.integers(0, 2, (count, length, 2)).astype(np.uint8),
        rng.integers(0, 2, (count, length, 2)).astype(np.uint8),
    )
