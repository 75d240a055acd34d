"""The predictor's history: what it has seen, when, and for whom."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from drake_dress.models.human.prediction import (
    ConstantVelocityPredictor,
    MotionPredictor,
    StillPredictor,
)
from drake_dress.systems.human_predictor import HumanPredictor

VELOCITY = np.array([0.1, -0.2, 0.05])
START = np.random.default_rng(0).normal(size=(6, 3))


class Carried(LeafSystem):
    """A person carried along at constant velocity; joint 5 is not seen before `since`, s."""

    def __init__(self, since: float = 0.0) -> None:
        super().__init__()
        self._since = since
        self.DeclareVectorOutputPort("joint_position", 18, self._calc, {self.time_ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        joints = START + context.get_time() * VELOCITY
        if context.get_time() < self._since - 1e-9:
            joints[5] = np.nan
        output.SetFromVector(joints.ravel())


def predicted(
    predictor: MotionPredictor, time: float, step: float, steps: int, since: float = 0.0
) -> np.ndarray:
    builder = DiagramBuilder()
    source = builder.AddSystem(Carried(since))
    system = builder.AddSystem(HumanPredictor(predictor, step, steps))
    builder.Connect(source.get_output_port(), system.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(time)
    context = system.GetMyContextFromRoot(simulator.get_context())
    return system.get_output_port().Eval(context).reshape(steps + 1, 6, 3)


@pytest.mark.parametrize("time", [0.0, 0.5, 0.52, 1.049])
def test_row_zero_is_as_fresh_as_the_input(time: float) -> None:
    for predictor in (StillPredictor(), ConstantVelocityPredictor()):
        rows = predicted(predictor, time, 0.1, 4)
        np.testing.assert_array_equal(rows[0], START + time * VELOCITY)


@pytest.mark.parametrize("time", [0.5, 0.52, 1.049])
@pytest.mark.parametrize(("step", "steps"), [(0.1, 8), (0.02, 3)])
def test_constant_velocity_is_found_at_any_time_and_step(
    time: float, step: float, steps: int
) -> None:
    rows = predicted(ConstantVelocityPredictor(decay_time=np.inf), time, step, steps)
    ahead = time + step * np.arange(steps + 1)[:, None, None]
    np.testing.assert_allclose(rows, START + ahead * VELOCITY, atol=1e-9)


def test_at_first_the_person_is_taken_to_stand_still() -> None:
    rows = predicted(ConstantVelocityPredictor(), 0.0, 0.1, 3)
    np.testing.assert_allclose(rows, np.tile(START, (4, 1, 1)))


def test_joint_that_comes_into_sight_is_predicted_once_it_was_seen_often_enough() -> None:
    p = ConstantVelocityPredictor(decay_time=np.inf)
    early = predicted(p, 0.5, 0.1, 2, since=0.45)
    np.testing.assert_allclose(early[-1, 2], START[2] + 0.7 * VELOCITY, atol=1e-9)
    late = predicted(p, 1.0, 0.1, 2, since=0.45)
    np.testing.assert_allclose(late[-1, 5], START[5] + 1.2 * VELOCITY, atol=1e-9)
    assert np.isnan(predicted(p, 0.4, 0.1, 2, since=0.45)[:, 5]).all()
