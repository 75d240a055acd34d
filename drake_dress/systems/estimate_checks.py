"""Checks estimates of the person and the garment, message by message.

The rules are in `models/supervision/`; a check holds their state. It belongs to the decoder of one
channel, which calls it once for each message.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.supervision.fault import Finding
from drake_dress.models.supervision.garment_belief import (
    GarmentBounds,
    GarmentTrack,
    judge_garment,
)
from drake_dress.models.supervision.person_belief import PersonBounds, PersonTrack, judge_person
from drake_dress.models.supervision.person_pose import POINT_NAMES
from drake_dress.systems.lcm_inbox import stamp
from drake_dress.systems.point_messages import read_points


class PersonCheck:
    """Checks estimates of the person's arms.

    Args:
        bounds: Bounds on plausible estimates.
    """

    def __init__(self, bounds: PersonBounds) -> None:
        self._bounds = bounds
        self._track: PersonTrack | None = None

    def __call__(self, message: Any) -> Finding:
        """Returns what is wrong with a `lcmt_point_cloud`."""
        found, values = read_points(message, len(POINT_NAMES), POINT_NAMES)
        if found.fault:
            return found
        found, self._track = judge_person(values[:, :3], stamp(message), self._track, self._bounds)
        return found


class GarmentCheck:
    """Checks estimates of the garment.

    Args:
        count: Number of its nodes.
        bounds: Bounds on plausible estimates.
        grippers: Returns the positions (2,3) of left and right gripper, m; None if not known.
    """

    def __init__(
        self, count: int, bounds: GarmentBounds, grippers: Callable[[], FloatArray | None]
    ) -> None:
        self._count, self._bounds, self._grippers = count, bounds, grippers
        self._track: GarmentTrack | None = None

    def __call__(self, message: Any) -> Finding:
        """Returns what is wrong with a `lcmt_point_cloud`."""
        found, values = read_points(message, self._count)
        if found.fault:
            return found
        nodes = np.ascontiguousarray(values[:, :3])
        velocity = np.ascontiguousarray(values[:, 3:]) if values.shape[1] == 6 else None
        found, self._track = judge_garment(
            nodes, velocity, stamp(message), self._grippers(), self._track, self._bounds
        )
        return found
