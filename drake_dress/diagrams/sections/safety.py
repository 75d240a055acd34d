"""The section `safety`: the limits between controllers and grippers."""

from __future__ import annotations

import numpy as np

from drake_dress.diagrams.scenario import schema
from drake_dress.models.control.safety import SafetyLimits


def safety_limits(s: schema.Safety) -> SafetyLimits:
    """Returns the limits that the safety governor enforces."""
    soft, largest, box = s.soft_force_limit, s.largest_distance, s.workspace
    return SafetyLimits(
        max_speed=s.max_speed,
        max_acceleration=s.max_acceleration,
        max_braking=s.max_braking,
        soft_force=0.5 * s.force_limit if soft is None else soft,
        hard_force=s.force_limit,
        filter_time=s.force_filter_time,
        yield_rate=s.yield_rate,
        yield_speed=s.yield_speed,
        relax_speed=s.relax_speed,
        stop_time=s.stop_time,
        max_lead=s.max_lead,
        stale_time=s.stale_time,
        person_distance=s.person_distance,
        held_distance=s.held_distance,
        least_distance=s.least_distance,
        largest_distance=np.inf if largest is None else largest,
        workspace=None if box is None else np.array([box.low, box.high]),
    )
