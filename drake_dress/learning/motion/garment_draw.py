"""What is drawn of a coat and of the robot that moves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.garment.geodesics import Reach

# Range of the speed of grippers, m/s, of which the logarithm is even.
_MAX_SPEED = 0.05, 0.35
# Even ranges of all else, in the units of `GarmentDraw`. The order is that of the draws.
_RANGES = {
    "beside": (0.01, 0.05),
    "carried": (0.0, 0.7),
    "share": (0.8, 1.0),
    "rate": (0.05, 0.5),
    "across": (0.0, 3.0),
    "toward": (0.0, 1.0),
    "sways": (0.05, 0.8),
    "hinders": (0.1, 3.0),
}


@dataclass(frozen=True)
class GarmentDraw:
    """What is drawn of a garment and of the robot that moves it.

    Attributes:
        reach: of the coat.
        max_speed: of the grippers, m/s.
        beside: largest distance of a sleeve from its arm's axis before it moves it, m.
        carried: share of an arm's motion along itself that a sleeve on it takes part in.
        share: share of its gripper's motion that a sleeve takes.
        rate: progress of a sleeve that is drawn up its arm, 1/s.
        across: weight of the direction to the other armhole in that of a sleeve: an armhole is
            cut into the side of a coat, and its sleeve sets off sideways.
        toward: weight of the direction to the hand in that of a sleeve off its arm.
        sways: standard deviation of the sideways part of a sleeve's unit direction.
        hinders: mean time for which cloth hinders a hand that is in its armhole, s.
    """

    reach: Reach
    max_speed: float
    beside: float
    carried: float
    share: float
    rate: float
    across: float
    toward: float
    sways: float
    hinders: float

    @classmethod
    def drawn(cls, rng: np.random.Generator, reach: Reach) -> GarmentDraw:
        """Returns drawn values for a coat."""
        speed = float(np.exp(rng.uniform(*np.log(_MAX_SPEED))))
        return cls(reach, speed, **{k: float(rng.uniform(*each)) for k, each in _RANGES.items()})
