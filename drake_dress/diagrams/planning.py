"""The controllers from prediction to requested velocities, wired to a source of estimates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort

from drake_dress.diagrams.prediction import Prediction, Predictor
from drake_dress.diagrams.station import MOTION
from drake_dress.models.control.local_control import LocalController
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.human.prediction import StillPredictor
from drake_dress.models.sides import SIDES
from drake_dress.systems.global_mpc import GlobalMpc
from drake_dress.systems.local_controller import LocalCompensation
from drake_dress.systems.plan_follower import PlanFollower

# What a controller may observe: input ports by name, and the station's outputs that they take.
OBSERVATIONS = {
    "garment_position": "estimate.garment_position",
    "joint_position": "estimate.joint_position",
    **{
        f"{side}_gripper_{quantity}": f"{side}_gripper.{quantity}_measured"
        for side in SIDES
        for quantity in ("position", "force")
    },
}
# Connects an output of the station, by its name, to an input port.
Feed = Callable[[str, InputPort], None]


@dataclass(frozen=True)
class Rates:
    """Periods and delays of the controllers, and of the plant, s."""

    global_period: float
    global_delay: float
    command_period: float
    log_period: float
    arm_period: float
    plant_period: float
    arm_offset: float = 0.0005


@dataclass(frozen=True)
class LocalSetup:
    """The local controller and its timing.

    Attributes:
        controller: solves the local problem.
        period: between solves, s.
        delay: from the observation to the use of its solution, s.
        feedback: whether it corrects between solves.
        joints_step: time step of the prediction of the person's joints, s.
        joints_count: steps of that prediction after the current time.
        record: list to which each solved problem is appended, if given.
    """

    controller: LocalController
    period: float
    delay: float
    feedback: bool
    joints_step: float
    joints_count: int
    record: list[LocalProblem] | None = None

    def system(self, in_worker: bool = False) -> LocalCompensation:
        """Returns the Drake system; with `in_worker` it solves on a background thread."""
        return LocalCompensation(
            self.controller,
            self.period,
            self.delay,
            self.joints_step,
            self.joints_count,
            self.feedback,
            self.record,
            in_worker,
        )


@dataclass(frozen=True)
class ControlSetup:
    """The controllers, their timing and their limits.

    Attributes:
        policy: of the global controller, with the controller's garment.
        rates: of controllers and log.
        limits: enforced by the safety governor between controllers and grippers.
        predictor: of the person's arms; the default predicts no motion.
        local: the local controller between plan and governor; None to follow the plan directly.
        in_worker: whether controllers solve in the background, the global one in a worker process.
        own: the user's system that requests velocities in place of `local`; see `OwnParts`.
    """

    policy: DressingPolicy
    rates: Rates
    limits: SafetyLimits
    predictor: Predictor = field(default_factory=StillPredictor)
    local: LocalSetup | None = None
    in_worker: bool = False
    own: Any = None


@dataclass(frozen=True)
class Planning:
    """The systems that turn estimates into requested velocities.

    Attributes:
        mpc: the global controller.
        requests: the system with outputs `{left,right}_velocity_request` and `request_time`.
        forecast: port of the forecasts of the person; None where the predictor makes none.
    """

    mpc: GlobalMpc
    requests: Any
    forecast: OutputPort | None = None


def add_planning(
    builder: DiagramBuilder, control: ControlSetup, feed: Feed, waits: bool = True
) -> Planning:
    """Adds prediction, global controller, and local controller or plan follower.

    Args:
        builder: of the diagram.
        control: the controllers.
        feed: connects the station's outputs to their inputs.
        waits: whether simulated time stands still while the global controller solves.
    """
    rates, p = control.rates, control.policy.parameters
    person = Prediction(
        builder, feed, control.predictor, control.policy.mesh, control.policy.person.shoulders
    )
    predicted = person.view("human_predictor", p.time_step, p.horizon)
    mpc = builder.AddNamedSystem(
        "global_mpc",
        GlobalMpc(
            control.policy,
            rates.global_period,
            rates.global_delay,
            waits=waits,
            in_worker=control.in_worker,
        ),
    )
    for quantity in MOTION:
        feed(f"estimate.garment_{quantity}", mpc.GetInputPort(f"garment_{quantity}"))
    builder.Connect(predicted.joints, mpc.GetInputPort("predicted_joint_position"))
    if predicted.radius is not None:
        builder.Connect(predicted.radius, mpc.GetInputPort("predicted_radius"))
    if control.own is not None:
        requests = _add_own_controller(builder, mpc, control.own, feed)
    elif control.local is not None:
        requests = _add_local_controller(builder, mpc, control, control.local, feed, person)
    else:
        requests = builder.AddNamedSystem("plan_follower", PlanFollower())
        builder.Connect(mpc.GetOutputPort("plan"), requests.GetInputPort("plan"))
    return Planning(mpc, requests, person.forecast)


def _add_local_controller(
    builder: DiagramBuilder,
    mpc: GlobalMpc,
    control: ControlSetup,
    local: LocalSetup,
    feed: Feed,
    person: Prediction,
) -> LocalCompensation:
    """Adds the local controller, with a prediction at its own time step."""
    requests: LocalCompensation = builder.AddNamedSystem(
        "local_controller", local.system(control.in_worker)
    )
    near = person.view("near_human_predictor", local.joints_step, local.joints_count)
    builder.Connect(mpc.GetOutputPort("plan"), requests.GetInputPort("plan"))
    builder.Connect(near.joints, requests.GetInputPort("predicted_joint_position"))
    for name in ("garment_position", *(f"{side}_gripper_position" for side in SIDES)):
        feed(OBSERVATIONS[name], requests.GetInputPort(name))
    return requests


def _add_own_controller(
    builder: DiagramBuilder, mpc: GlobalMpc, controller: Any, feed: Feed
) -> Any:
    """Adds a user's controller and connects the input ports that it has."""
    builder.AddNamedSystem("own_controller", controller)
    if controller.HasInputPort("plan"):
        builder.Connect(mpc.GetOutputPort("plan"), controller.GetInputPort("plan"))
    for name, source in OBSERVATIONS.items():
        if controller.HasInputPort(name):
            feed(source, controller.GetInputPort(name))
    return controller
