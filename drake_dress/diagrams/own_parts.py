"""A user's own parts, which replace parts of the dressing or are added to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pydrake.systems.framework import LeafSystem

from drake_dress.diagrams.planning import OBSERVATIONS
from drake_dress.models.control.costs import GarmentCost
from drake_dress.models.human.learned.forecast import PersonPredictor
from drake_dress.models.human.prediction import MotionPredictor

# Ports of a user's controller: inputs that it may have, and outputs that it must have, with sizes.
INPUTS = ("plan", *OBSERVATIONS)
OUTPUTS = {"left_velocity_request": 3, "right_velocity_request": 3, "request_time": 1}


@dataclass(frozen=True)
class OwnParts:
    """A user's additions to a scenario; each is optional.

    Attributes:
        predictor: of the person's arms, in place of the scenario's `controller.predictor`.
        costs: added to those of the global controller's plan.
        controller: makes the system that requests the grippers' velocities, in place of the local
            controller. Its inputs are any of `INPUTS`, by name: `plan` (the global controller's,
            abstract), `garment_position` (3m,) m, `joint_position` (18,) m, and
            `left_gripper_position` and `left_gripper_force` (3,), m and N, likewise `right_…`. Its
            outputs are `left_velocity_request` and `right_velocity_request`, (3,) m/s, and
            `request_time`, (1,) s, the time of the measurement that the requests are based on. The
            safety governor between it and the grippers stops on old requests.
    """

    predictor: MotionPredictor | PersonPredictor | None = None
    costs: tuple[GarmentCost, ...] = ()
    controller: Callable[[], LeafSystem] | None = None


NOTHING = OwnParts()


def own_controller(make: Callable[[], LeafSystem]) -> Any:
    """Returns the user's controller.

    Raises:
        ValueError: it has an unknown input port, or lacks an output port of the right size.
    """
    system: Any = make()
    inputs = [system.get_input_port(i).get_name() for i in range(system.num_input_ports())]
    unknown = sorted(set(inputs) - set(INPUTS))
    if unknown:
        raise ValueError(
            f"the controller has the input port {unknown[0]}, expected any of {', '.join(INPUTS)}"
        )
    for name, expected in OUTPUTS.items():
        if not system.HasOutputPort(name):
            raise ValueError(
                f"the controller has no output port {name}, expected one of size {expected}"
            )
        size = system.GetOutputPort(name).size()
        if size != expected:
            raise ValueError(
                f"output port {name} of the controller has size {size}, expected {expected}"
            )
    return system
