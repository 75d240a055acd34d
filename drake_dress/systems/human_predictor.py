"""Prediction of the person's arms."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.human.prediction import MotionPredictor, resampled


class HumanPredictor(LeafSystem):
    """Stores the history of the arms and predicts their motion from it.

    .. pydrake_system::

        name: HumanPredictor
        input_ports:
        - joint_position
        output_ports:
        - predicted_joint_position

    joint_position: (18,) row-major (6,3), m, NaN for a joint that is not seen; sampled at the
    predictor's period. predicted_joint_position: ((steps+1)·18,) row-major (steps+1,6,3), m: row 0
    is the current time, then one row every `time_step`. The history ends with the current input;
    earlier samples are resampled to whole periods before now. It is NaN before time 0.

    Args:
        predictor: Predicts the motion.
        time_step: Time between predicted rows, s.
        steps: Number of rows after the current one.
    """

    def __init__(self, predictor: MotionPredictor, time_step: float, steps: int) -> None:
        super().__init__()
        self._predictor = predictor
        self._time_step, self._steps = time_step, steps
        self._samples = self.DeclareDiscreteState(np.full(18 * predictor.history_length, np.nan))
        self._sampled_at = self.DeclareDiscreteState([-predictor.sample_period])
        self.DeclareVectorInputPort("joint_position", 18)
        self.DeclareVectorOutputPort("predicted_joint_position", 18 * (steps + 1), self._calc)
        self.DeclarePeriodicDiscreteUpdateEvent(predictor.sample_period, 0.0, self._sample)

    def _sample(self, context: Context, discrete: DiscreteValues) -> None:
        samples = context.get_discrete_state(self._samples).value()
        now = self.get_input_port(0).Eval(context)
        discrete.set_value(self._samples, np.concatenate([samples[18:], now]))
        discrete.set_value(self._sampled_at, [context.get_time()])

    def _calc(self, context: Context, output: BasicVector) -> None:
        samples = context.get_discrete_state(self._samples).value().reshape(-1, 6, 3)
        sampled_at = float(context.get_discrete_state(self._sampled_at).value()[0])
        now = self.get_input_port(0).Eval(context).reshape(6, 3)
        age = (context.get_time() - sampled_at) / self._predictor.sample_period
        history = resampled(samples, now, age)
        predicted = self._predictor.predict(history, self._time_step, self._steps)
        output.SetFromVector(predicted.ravel())
