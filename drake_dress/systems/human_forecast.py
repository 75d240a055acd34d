"""Forecasts of the person at a fixed rate, from whatever observations there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_dress.models.human.history import Observations
from drake_dress.models.human.learned.forecast import Forecast, PersonHistory, PersonPredictor
from drake_dress.models.immutable import Immutable

# Rows of the points in an observation: six joints, then centre and direction of both sleeves.
_JOINTS, _SLEEVES = 6, 4


@dataclass(frozen=True)
class _Known(Immutable):
    """State: observations so far, the predictor's memory, and the lag of the clock of stamps, s."""

    observations: Observations
    memory: Any
    lag: float = np.inf


class HumanForecast(LeafSystem):
    """Collects observations of a person and predicts both arms at a fixed rate.

    .. pydrake_system::

        name: HumanForecast
        input_ports:
        - joint_position
        - sleeve_state
        - stamp (optional)
        output_ports:
        - forecast
        - mean
        - radius
        - samples
        - intent
        - is_linear

    joint_position: (18,) row-major (6,3) shoulder, elbow, hand of left, then right arm, m, NaN for
    a joint that is not seen. sleeve_state: (12,) row-major (2,6) centre, m, and unit direction from
    cuff to armhole of left and right armhole; NaN where not known. stamp: (1,) time of the
    observation by its sender's clock, s; if not connected, observations are of now. An observation
    with the stamp of the one before is not counted again. Clocks may differ by a constant: the
    freshest observation so far is assumed to have arrived without delay.

    forecast: `Forecast`, held until the next one; `first` is that before the first observation.
    mean: ((F+1)·18,) and radius ((F+1)·6,), m, of its regions. samples: (S·(F+1)·18,), m. intent:
    (2,) probabilities of left and right arm. is_linear: (1,) 1 while the input is unlike the
    training data and a linear predictor is used.

    Args:
        predictor: Predicts the person.
        sampling_period: Time between looks at the input, s.
        period: Time between forecasts, s; a multiple of `sampling_period`.
        start: (6,3) joints before the first observation, m.
    """

    def __init__(
        self,
        predictor: PersonPredictor,
        sampling_period: float,
        period: float,
        start: np.ndarray,
    ) -> None:
        super().__init__()
        self._predictor = predictor
        steps = round(period / sampling_period)
        if steps < 1 or abs(steps * sampling_period - period) > 1e-9:
            raise ValueError(f"period is {period} s, expected a multiple of {sampling_period} s")
        self.first = first = _resting(predictor, start)
        self._known = self.DeclareAbstractState(Value(_Known(Observations(), predictor.begin())))
        self._forecast = self.DeclareAbstractState(Value(first))
        self.DeclareVectorInputPort("joint_position", 18)
        self.DeclareVectorInputPort("sleeve_state", 12)
        self.DeclareVectorInputPort("stamp", 1)
        held = {self.abstract_state_ticket(self._forecast)}
        self.DeclareAbstractOutputPort("forecast", lambda: Value(first), self._calc_forecast, held)
        for name, show in (
            ("mean", lambda f: f.mean),
            ("radius", lambda f: f.radius),
            ("samples", lambda f: f.samples),
            ("intent", lambda f: f.intent),
            ("is_linear", lambda f: np.array([float(f.is_linear)])),
        ):
            self.DeclareVectorOutputPort(name, np.size(show(first)), self._calc(show), held)
        self.DeclarePeriodicUnrestrictedUpdateEvent(sampling_period, 0.0, self._observe)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._predict)

    def _observe(self, context: Context, state: State) -> None:
        known = _known(context.get_abstract_state(self._known).get_value())
        state.get_mutable_abstract_state(self._known).set_value(self._with_newest(context, known))

    def _with_newest(self, context: Context, known: _Known) -> _Known:
        """Returns what is known, with the observation on the input ports."""
        now, lag = context.get_time(), known.lag
        joints = self.get_input_port(0).Eval(context).reshape(_JOINTS, 3)
        sleeves = self.get_input_port(1).Eval(context).reshape(_SLEEVES, 3)
        stamp = self.get_input_port(2)
        time = now
        if stamp.HasValue(context):
            sent = float(stamp.Eval(context)[0])
            lag = min(lag, now - sent)
            time = sent + lag
        points = np.concatenate([joints, sleeves])
        added = known.observations.added(time, points, self._predictor.sampling.kept)
        return _Known(added, known.memory, lag)

    def _predict(self, context: Context, state: State) -> None:
        known = _known(context.get_abstract_state(self._known).get_value())
        known = self._with_newest(context, known)
        now, sampling = context.get_time(), self._predictor.sampling
        rows = known.observations.sampled(now, sampling)
        history = PersonHistory.of_points(now, rows)
        if np.isfinite(history.joints).any():
            forecast, memory = self._predictor.forecast(history, known.memory)
            state.get_mutable_abstract_state(self._forecast).set_value(forecast)
            known = _Known(known.observations, memory, known.lag)
        state.get_mutable_abstract_state(self._known).set_value(known)

    def _calc_forecast(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._forecast).get_value())

    def _calc(self, show: Callable[[Forecast], Any]) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            forecast: Forecast = context.get_abstract_state(self._forecast).get_value()
            output.SetFromVector(np.ravel(show(forecast)))

        return calc


class ForecastView(LeafSystem):
    """A forecast as a controller takes it: from now on, at the controller's own time step.

    .. pydrake_system::

        name: ForecastView
        input_ports:
        - forecast
        - joint_position
        output_ports:
        - predicted_joint_position
        - predicted_radius

    predicted_joint_position: ((steps+1)·18,) row-major (steps+1,6,3), m, row 0 now. Joints that are
    observed, (18,) m, not NaN, move the whole prediction to where they are now; the others are as
    predicted. predicted_radius: ((steps+1)·6,), m, of balls that hold the joints with probability
    0.9.

    Args:
        first: Forecast before the first one arrives.
        time_step: Time between rows, s.
        steps: Number of rows after the current one.
    """

    def __init__(self, first: Forecast, time_step: float, steps: int) -> None:
        super().__init__()
        self._ahead = time_step * np.arange(steps + 1)
        self.DeclareAbstractInputPort("forecast", Value(first))
        self.DeclareVectorInputPort("joint_position", 18)
        self.DeclareVectorOutputPort(
            "predicted_joint_position", 18 * (steps + 1), self._calc_position
        )
        self.DeclareVectorOutputPort("predicted_radius", 6 * (steps + 1), self._calc_radius)

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        forecast: Forecast = self.get_input_port(0).Eval(context)
        joints = self.get_input_port(1).Eval(context).reshape(6, 3)
        rows = forecast.mean_at(context.get_time() + self._ahead)
        off = joints - rows[0]
        output.SetFromVector((rows + np.where(np.isfinite(off), off, 0.0)).ravel())

    def _calc_radius(self, context: Context, output: BasicVector) -> None:
        forecast: Forecast = self.get_input_port(0).Eval(context)
        output.SetFromVector(forecast.radius_at(context.get_time() + self._ahead).ravel())


def _known(value: Any) -> _Known:
    known: _Known = value
    return known


def _resting(predictor: PersonPredictor, start: np.ndarray) -> Forecast:
    """Returns the forecast of a person who was only seen now."""
    sampling = predictor.sampling
    joints = np.full((sampling.length, 6, 3), np.nan)
    joints[-1] = start
    history = PersonHistory(0.0, joints, np.full((sampling.length, 2, 6), np.nan))
    return predictor.forecast(history, predictor.begin())[0]
