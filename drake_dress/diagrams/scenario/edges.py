"""A scenario whose coat is held at the edges of its opening."""

from __future__ import annotations

from dataclasses import replace

from drake_dress.diagrams.scenario.schema import Scenario, Stages

# N: the pull of both edges runs around the neck, where 16 N strain a hundredth of the mesh's edges
# by 10 %.
_FORCE, _SOFT_FORCE = 14.0, 7.5
# Misses of the second hand after which its sleeve swings back. Held at the edges, a coat that has
# missed twice lies before the hand, and further attempts end in the same way (docs/coats.md).
_SWING_AFTER = 2
# The same as settings of a scenario.
AT_EDGES = (
    "garment.hold=edges",
    f"safety.force_limit={_FORCE:g}",
    f"safety.soft_force_limit={_SOFT_FORCE:g}",
    f"controller.stages.swing_after={_SWING_AFTER}",
)


def at_edges(scenario: Scenario) -> Scenario:
    """Returns the scenario with its coat held at the edges, and what follows from that.

    Values that differ from the defaults are the user's, and stay.
    """
    safety, controller, plain = scenario.safety, scenario.controller, Stages()
    if (safety.force_limit, safety.soft_force_limit) == (type(safety)().force_limit, None):
        safety = replace(safety, force_limit=_FORCE, soft_force_limit=_SOFT_FORCE)
    if controller.stages.swing_after == plain.swing_after:
        stages = replace(controller.stages, swing_after=_SWING_AFTER)
        controller = replace(controller, stages=stages)
    garment = replace(scenario.garment, hold="edges")
    return replace(scenario, garment=garment, safety=safety, controller=controller)
