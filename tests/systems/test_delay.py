import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_dress.models.arrays import FloatArray
from drake_dress.systems.delay import Delay


def delayed(
    source: System, start: FloatArray, period: float, delay: float, end: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    builder = DiagramBuilder()
    feed = builder.AddSystem(source)
    line = builder.AddSystem(Delay(start, period, delay))
    builder.Connect(feed.get_output_port(), line.get_input_port())
    log = LogVectorOutput(line.get_output_port(), builder, period)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(end)
    found = log.FindLog(simulator.get_context())
    return found.sample_times(), found.data()


def test_a_ramp_comes_out_as_it_was_a_delay_ago() -> None:
    ramp = PiecewisePolynomial.FirstOrderHold([0.0, 2.0], np.array([[0.0, 2.0], [0.0, -4.0]]))
    time, value = delayed(TrajectorySource(ramp), np.array([5.0, 6.0]), 0.01, 0.2)
    late = time >= 0.2 - 1e-9
    np.testing.assert_allclose(value[0, late], time[late] - 0.2, atol=1e-9)
    np.testing.assert_allclose(value[1, late], -2.0 * (time[late] - 0.2), atol=1e-9)


def test_before_the_first_delay_has_passed_it_stands_where_it_starts() -> None:
    start = np.array([1.0, 2.0, 3.0])
    time, value = delayed(ConstantVectorSource(np.zeros(3)), start, 0.01, 0.1)
    early = time < 0.1 - 1e-9
    np.testing.assert_array_equal(value[:, early], np.tile(start[:, None], early.sum()))
    np.testing.assert_array_equal(value[:, ~early], 0.0)
