"""The governor in a diagram, with grippers, and a spring for a garment."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, VectorLogSink

from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.control.safety import SafetyLimits, Verdict
from drake_dress.models.sides import SIDES
from drake_dress.systems.floating_gripper import FloatingGripper
from drake_dress.systems.safety_governor import SafetyGovernor

PERIOD = 0.01
START = np.array([[0.0, 0.3, 1.4], [0.0, -0.3, 1.4]])
LIMITS = SafetyLimits(person_distance=0.0, held_distance=0.0, least_distance=0.0)
GRIPPER_SPEED = 0.25
PERSON = PersonModel((), np.array([[0.0, 0.2, 1.4], [0.0, -0.2, 1.4]]), (0.05, 0.04, 0.04))
# The left hand is ahead of the left gripper; the rest of both arms is far.
HAND = START[0] + [0.2, 0.0, 0.0]
JOINTS = np.concatenate([HAND + [0.6, 0.0, 0.0], HAND + [0.3, 0.0, 0.0], HAND, np.full(9, 9.0)])


class Clock(LeafSystem):
    """A controller's stamp: now, until it dies."""

    def __init__(self, last: float) -> None:
        super().__init__()
        self.DeclareVectorOutputPort(
            "request_time", 1, lambda c, out: out.SetFromVector([min(c.get_time(), last)])
        )


class Spring(LeafSystem):
    """Force (3,), N, on a gripper that has left its place."""

    def __init__(self, place: np.ndarray, stiffness: float) -> None:
        super().__init__()
        self.DeclareVectorInputPort("position", 3)
        self.DeclareVectorOutputPort(
            "force",
            3,
            lambda c, out: out.SetFromVector(-stiffness * (self.get_input_port(0).Eval(c) - place)),
        )


def simulate(
    velocity: list[float],
    stiffness: float,
    duration: float,
    limits: SafetyLimits = LIMITS,
    alive: float = np.inf,
    permission: float = 1.0,
    joints: np.ndarray | None = None,
    held: Sequence[np.ndarray] = (),
) -> dict[str, np.ndarray]:
    """Returns logs of the left gripper, (T,k), at every 2 ms, and of the verdicts."""
    builder = DiagramBuilder()
    governor = builder.AddSystem(SafetyGovernor(START, PERIOD, limits, PERSON, held))
    if joints is not None:
        seen = builder.AddSystem(ConstantVectorSource(joints))
        builder.Connect(seen.get_output_port(), governor.GetInputPort("joint_position"))
    clock = builder.AddSystem(Clock(alive))
    builder.Connect(clock.get_output_port(), governor.GetInputPort("request_time"))
    allowed = builder.AddSystem(ConstantVectorSource([permission]))
    builder.Connect(allowed.get_output_port(), governor.GetInputPort("permission"))
    ports = {"verdict": governor.GetOutputPort("verdict")}
    for i, side in enumerate(SIDES):
        gripper = builder.AddSystem(FloatingGripper(START[i], 0.002, GRIPPER_SPEED, 2.0))
        spring = builder.AddSystem(Spring(START[i], stiffness))
        source = builder.AddSystem(ConstantVectorSource(velocity))
        command = governor.GetOutputPort(f"{side}_position_command")
        builder.Connect(command, gripper.get_input_port())
        measured = gripper.GetOutputPort("position_measured")
        builder.Connect(measured, spring.get_input_port())
        builder.Connect(measured, governor.GetInputPort(f"{side}_gripper_position"))
        builder.Connect(spring.get_output_port(), governor.GetInputPort(f"{side}_gripper_force"))
        builder.Connect(source.get_output_port(), governor.GetInputPort(f"{side}_velocity_request"))
        if side == "left":
            ports |= {
                "command": command,
                "speed": governor.GetOutputPort("left_velocity_command"),
                "force": spring.get_output_port(),
                "position": measured,
            }
    sinks = {}
    for name, port in ports.items():
        sinks[name] = builder.AddSystem(VectorLogSink(port.size(), 0.002))
        builder.Connect(port, sinks[name].get_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    return {n: s.FindLog(simulator.get_context()).data().T for n, s in sinks.items()}


@pytest.mark.parametrize("stiffness", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize("soft_force", [0.5 * LIMITS.hard_force, 0.95 * LIMITS.hard_force])
def test_pulling_away_forever_does_not_pull_harder_than_the_limit(
    stiffness: float, soft_force: float
) -> None:
    log = simulate([0.0, 0.25, 0.0], stiffness, 8.0, replace(LIMITS, soft_force=soft_force))
    force = np.linalg.norm(log["force"], axis=1)
    # A command is max_lead before its gripper at most, with what it needs to brake; the gripper
    # moves on for one period before its force is seen.
    bound = LIMITS.hard_force + stiffness * (LIMITS.max_lead + GRIPPER_SPEED * PERIOD)
    assert force.max() <= bound
    assert force.max() > 0.9 * soft_force  # the limit was reached, and not for lack of pulling
    # It does not stay over the limit: if giving way does not end it, the stop does. What is over
    # goes at relax_speed then, after the filter and the gripper's own lag, 0.3 s.
    over = np.flatnonzero(np.diff(np.r_[0, force > LIMITS.hard_force, 0]))
    longest = 0.002 * np.max(over[1::2] - over[::2], initial=0)
    excess = max(0.0, force.max() - LIMITS.hard_force)
    assert longest <= LIMITS.stop_time + excess / (stiffness * LIMITS.relax_speed) + 0.3


def test_command_is_within_reach_of_the_gripper_all_the_time() -> None:
    log = simulate([0.0, 0.25, 0.0], 0.0, 3.0)
    lead = np.linalg.norm(log["command"] - log["position"], axis=1)
    assert 0.5 * LIMITS.max_lead < lead.max() <= LIMITS.max_lead


def test_slow_request_arrives_as_it_is() -> None:
    log = simulate([0.05, 0.1, 0.0], 1.0, 2.0)
    np.testing.assert_allclose(log["speed"][-1], [0.05, 0.1, 0.0], atol=1e-12)
    np.testing.assert_array_equal(log["verdict"][-1], 0.0)


def test_controller_that_dies_leaves_grippers_at_rest() -> None:
    log = simulate([0.05, 0.1, 0.0], 1.0, 2.0, alive=1.0)
    assert np.linalg.norm(log["speed"][500]) > 0.1
    np.testing.assert_array_equal(log["speed"][-1], 0.0)
    assert int(log["verdict"][-1][0]) & Verdict.STALE
    still = int((1.0 + LIMITS.stale_time + LIMITS.max_speed / LIMITS.max_acceleration) / 0.002) + 10
    np.testing.assert_array_equal(log["speed"][still:], 0.0)


def test_start_outside_the_limits_is_refused() -> None:
    with pytest.raises(ValueError, match="apart"):
        SafetyGovernor(START, PERIOD, replace(LIMITS, largest_distance=0.4))


@pytest.mark.parametrize("permission", [0.0, np.nan])
def test_without_permission_nothing_moves(permission: float) -> None:
    log = simulate([0.1, 0.0, 0.0], 0.0, 0.5, permission=permission)
    np.testing.assert_array_equal(log["command"], np.broadcast_to(START[0], log["command"].shape))
    assert int(log["verdict"][-1][0]) & Verdict.HELD


def test_a_gripper_keeps_its_distance_to_the_skin() -> None:
    limits = replace(LIMITS, person_distance=0.03)
    log = simulate([0.2, 0.0, 0.0], 0.0, 2.0, limits, joints=JOINTS)
    ahead = log["command"][:, 0] - START[0, 0]
    assert 0.125 < ahead.max() <= 0.2 - 0.04 - 0.03 + 1e-9
    assert int(log["verdict"][-1][0]) & Verdict.PERSON


def test_what_a_gripper_holds_keeps_its_own_distance() -> None:
    limits = replace(LIMITS, person_distance=0.03, held_distance=0.005)
    held = [np.array([[0.06, 0.0, 0.0], [-0.06, 0.0, 0.0]])] * 2
    log = simulate([0.2, 0.0, 0.0], 0.0, 2.0, limits, joints=JOINTS, held=held)
    ahead = log["command"][:, 0] - START[0, 0]
    assert 0.09 < ahead.max() <= 0.2 - 0.04 - 0.06 - 0.005 + 1e-9
    assert int(log["verdict"][-1][0]) & Verdict.PERSON


@pytest.mark.parametrize("joints", [None, np.where(np.arange(18) == 4, np.nan, JOINTS)])
def test_who_is_not_seen_is_no_limit(joints: np.ndarray | None) -> None:
    limits = replace(LIMITS, person_distance=0.03)
    log = simulate([0.2, 0.0, 0.0], 0.0, 1.0, limits, joints=joints)
    assert log["command"][-1, 0] - START[0, 0] > 0.15
    assert not int(log["verdict"][-1][0]) & Verdict.PERSON
