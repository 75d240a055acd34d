"""Distance of the grippers from the person's wheelchair, computed from the log."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog


def gripper_to_chair(log: RunLog) -> FloatArray | None:
    """Returns (T,2) distance of left and right gripper to the chair, m, negative inside it.

    A gripper is the point that holds the cloth. NaN where it is not known; None without a chair.
    """
    if not log.of_chair.any():
        return None
    a, b, radius = log.capsules
    points = np.stack([log.gripper_position[side] for side in SIDES], axis=1)
    distance = np.full((len(log), len(SIDES)), np.nan)
    for i, (first, second) in enumerate(zip(a[:, log.of_chair], b[:, log.of_chair], strict=True)):
        if np.isfinite(points[i]).all() and np.isfinite([first, second]).all():
            chair = Obstacles.resting(first, second, radius[log.of_chair])
            distance[i] = find_proximity(points[i], chair, 0.0).gap
    return distance
