import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, VectorLogSink

from drake_dress.systems.floating_gripper import FloatingGripper

PERIOD, SPEED, ACCELERATION = 0.004, 0.25, 2.0


def path(command: list[float], duration: float) -> tuple[np.ndarray, np.ndarray]:
    builder = DiagramBuilder()
    gripper = builder.AddSystem(FloatingGripper(np.zeros(3), PERIOD, SPEED, ACCELERATION))
    source = builder.AddSystem(ConstantVectorSource(command))
    builder.Connect(source.get_output_port(), gripper.get_input_port())
    sinks = []
    for name in ("position_measured", "velocity_measured"):
        sink = builder.AddSystem(VectorLogSink(3, PERIOD))
        builder.Connect(gripper.GetOutputPort(name), sink.get_input_port())
        sinks.append(sink)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    logs = [s.FindLog(simulator.get_context()).data().T for s in sinks]
    return logs[0], logs[1]


def test_gripper_reaches_its_command_without_overshoot() -> None:
    position, velocity = path([0.3, 0.0, -0.1], 4.0)
    np.testing.assert_allclose(position[-1], [0.3, 0.0, -0.1], atol=1e-4)
    assert position[:, 0].max() < 0.3 + 1e-3
    assert np.abs(velocity[-1]).max() < 1e-3


def test_speed_and_acceleration_stay_in_their_limits() -> None:
    _, velocity = path([1.0, 1.0, 1.0], 2.0)
    assert np.linalg.norm(velocity, axis=1).max() <= SPEED + 1e-12
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
    assert change.max() <= ACCELERATION * PERIOD + 1e-12


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_command_that_is_no_number_means_rest(bad: float) -> None:
    position, _ = path([bad, 0.0, 0.0], 0.5)
    np.testing.assert_array_equal(position, 0.0)
