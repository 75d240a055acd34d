"""The arms' controller in a diagram: grippers are where they are told, NaN moves nothing."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource, VectorLogSink
from pydrake.trajectories import PiecewisePolynomial

from drake_dress.models.arm.panda import LIMITS, SHAPE, panda
from drake_dress.models.arm.resolved_rate import ArmPair
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.sides import SIDES
from drake_dress.systems.arm_controller import ArmController

PERIOD = 0.005
HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])
# arms that hang down beside a person who stands 0.9 m before the arms
JOINTS = np.array(
    [
        [0, 0.2, 1.4],
        [0, 0.25, 1.1],
        [0, 0.25, 0.85],
        [0, -0.2, 1.4],
        [0, -0.25, 1.1],
        [0, -0.25, 0.85],
    ]
)
PERSON = PersonModel((), np.array([[0.0, 0.2, 1.4], [0.0, -0.2, 1.4]]), (0.05, 0.04, 0.04))


def pair() -> ArmPair:
    bases = []
    for y in (0.5, -0.5):
        base = np.eye(4)
        base[:3, 3] = -0.9, y, 1.0
        bases.append(base)
    return ArmPair((panda(bases[0]), panda(bases[1])), (SHAPE, SHAPE), np.stack([HOME, HOME]))


def run(
    velocity: np.ndarray,
    broken: bool = False,
    stopped: float = 0.0,
    elsewhere: np.ndarray | None = None,
) -> tuple[ArmController, np.ndarray, np.ndarray]:
    """Returns the controller, its joint commands and shares after a second at (3,) m/s."""
    arms, start = pair(), np.stack([HOME, HOME])
    builder = DiagramBuilder()
    controller = builder.AddSystem(ArmController(arms, start, PERIOD, PERSON))
    for i, side in enumerate(SIDES):
        here = arms.arms[i].tool_position(HOME)
        way = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.stack([here, here + velocity], 1))
        speed = np.full(3, np.nan) if broken and side == "left" else velocity
        for name, source in (
            ("position", TrajectorySource(way)),
            ("velocity", ConstantVectorSource(speed)),
        ):
            builder.Connect(
                builder.AddSystem(source).get_output_port(),
                controller.GetInputPort(f"{side}_{name}_command"),
            )
    person = builder.AddSystem(ConstantVectorSource(JOINTS.ravel()))
    builder.Connect(person.get_output_port(), controller.GetInputPort("joint_position"))
    for side in SIDES:
        at = builder.AddSystem(ConstantVectorSource(HOME if elsewhere is None else elsewhere))
        builder.Connect(at.get_output_port(), controller.GetInputPort(f"{side}_arm_position"))
        flag = builder.AddSystem(ConstantVectorSource([stopped]))
        builder.Connect(flag.get_output_port(), controller.GetInputPort(f"{side}_arm_stopped"))
    sinks = []
    for name, size in (("left_arm_position_command", 7), ("right_arm_position_command", 7)):
        sink = builder.AddSystem(VectorLogSink(size, PERIOD))
        builder.Connect(controller.GetOutputPort(name), sink.get_input_port())
        sinks.append(sink)
    sink = builder.AddSystem(VectorLogSink(3, PERIOD))
    builder.Connect(controller.GetOutputPort("clearance"), sink.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    logs = [s.FindLog(simulator.get_context()).data() for s in (*sinks, sink)]
    return controller, np.stack([logs[0].T, logs[1].T], axis=1), logs[2].T


def test_grippers_follow_their_commands() -> None:
    velocity = np.array([0.06, 0.0, -0.06])
    _, q, clearance = run(velocity)
    arms = pair()
    for i, arm in enumerate(arms.arms):
        now = arm.tool_position(q[-1, i])
        np.testing.assert_allclose(now, arm.tool_position(HOME) + velocity, atol=2e-3)
    assert np.isfinite(clearance[-1]).all()
    assert clearance[-1].min() > 0.05
    rates = np.diff(q, axis=0) / PERIOD
    assert (np.abs(rates) <= LIMITS.speed * (1 + 1e-9)).all()


def test_a_command_that_is_no_number_moves_nothing() -> None:
    _, q, _ = run(np.array([0.06, 0.0, 0.0]), broken=True)
    arms = pair()
    still = arms.arms[0].tool_position(q[-1, 0])
    np.testing.assert_allclose(still, arms.arms[0].tool_position(HOME), atol=2e-3)
    moved = arms.arms[1].tool_position(q[-1, 1]) - arms.arms[1].tool_position(HOME)
    assert moved[0] == pytest.approx(0.06, abs=3e-3)


def test_an_arm_that_stopped_elsewhere_is_commanded_to_be_there() -> None:
    """One that follows is not, nor one that is almost where it was commanded to be."""
    there = HOME + 0.1
    _, held, _ = run(np.zeros(3), stopped=1.0, elsewhere=there)
    # the gripper's own command draws it back, slowly, from where it is
    assert np.abs(held[1] - there).max() < 0.02
    _, permitted, _ = run(np.zeros(3), stopped=0.0, elsewhere=there)
    np.testing.assert_allclose(permitted[-1], np.stack([HOME, HOME]), atol=0.01)
    _, lagging, _ = run(np.zeros(3), stopped=1.0, elsewhere=HOME + 0.01)
    np.testing.assert_allclose(lagging[-1], np.stack([HOME, HOME]), atol=0.01)
