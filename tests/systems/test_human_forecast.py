"""Forecasts at a fixed rate: from what was observed, when it was, and for whom."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem

from drake_dress.models.human.history import Observations, Sampling
from drake_dress.models.human.learned.forecast import Forecast, PersonHistory, PersonPredictor
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.predictor import SAMPLING, LearnedPredictor
from drake_dress.systems.human_forecast import ForecastView, HumanForecast
from tests.models.human.learned.drawn import drawn_networks, drawn_scene

VELOCITY = np.array([0.1, -0.2, 0.05])
SCENE = drawn_scene(0, 1)
START, SLEEVES = SCENE.joints[0], SCENE.sleeves[0]
FIRST = np.full((6, 3), np.nan)
FIRST[[0, 3]] = [[0.0, 0.18, 1.4], [0.0, -0.18, 1.4]]
EVERY = 0.05


@dataclass
class _Spy:
    """Predicts rest, numbers its forecasts, and keeps what it sees."""

    sampling: Sampling = SAMPLING
    seen: list[PersonHistory] = field(default_factory=list)

    def begin(self) -> int:
        return 0

    def forecast(self, history: PersonHistory, memory: int) -> tuple[Forecast, int]:
        self.seen.append(history)
        mean = np.tile(np.nan_to_num(history.joints[-1]), (FUTURE + 1, 1, 1))
        radius = np.full((FUTURE + 1, 6), 0.01 * memory)
        samples = mean + np.arange(2.0)[:, None, None, None]
        intent, seen = np.array([0.2, 0.7]), np.ones(6, dtype=bool)
        found = Forecast(history.time, PERIOD, mean, radius, samples, intent, memory > 3, seen)
        return found, memory + 1


class _Person(LeafSystem):
    """A person in sleeves, carried along.

    Each observation is of `delay(k)` s ago, k the number of the look, and stamped by a clock that
    is `ahead` s ahead of the simulation's. Before `since`, s, nothing is seen; hands are seen up
    to `hidden`, s.
    """

    def __init__(
        self,
        delays: np.ndarray | None = None,
        ahead: float = 0.0,
        since: float = 0.0,
        hidden: float = np.inf,
    ) -> None:
        super().__init__()
        self._delays = np.zeros(1) if delays is None else delays
        self._ahead, self._since, self._hidden = ahead, since, hidden
        for name, size in (("joint_position", 18), ("sleeve_state", 12), ("stamp", 1)):
            calc = getattr(self, f"_calc_{name}")
            self.DeclareVectorOutputPort(name, size, calc, {self.time_ticket()})

    def _sent(self, context: Context) -> float:
        now = context.get_time()
        return round(now - self._delays[round(now / EVERY) % len(self._delays)], 9)

    def _calc_joint_position(self, context: Context, output: BasicVector) -> None:
        sent = self._sent(context)
        joints = START + sent * VELOCITY
        if context.get_time() < self._since - 1e-9:
            joints[:] = np.nan
        if sent > self._hidden + 1e-9:
            joints[[2, 5]] = np.nan
        output.SetFromVector(joints.ravel())

    def _calc_sleeve_state(self, context: Context, output: BasicVector) -> None:
        sleeves = SLEEVES.copy()
        sleeves[:, :3] += self._sent(context) * VELOCITY
        output.SetFromVector(sleeves.ravel())

    def _calc_stamp(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._sent(context) + self._ahead])


def diagram_of(
    predictor: PersonPredictor,
    person: _Person | None = None,
    stamped: bool = False,
    period: float = PERIOD,
) -> tuple[Diagram, HumanForecast]:
    builder = DiagramBuilder()
    source = builder.AddSystem(_Person() if person is None else person)
    system = builder.AddSystem(HumanForecast(predictor, EVERY, period, FIRST))
    names = ("joint_position", "sleeve_state", "stamp")
    for name in names if stamped else names[:2]:
        builder.Connect(source.GetOutputPort(name), system.GetInputPort(name))
    return builder.Build(), system


def observed(system: HumanForecast, simulator: Simulator) -> Observations:
    """Returns the observations that the system's state holds."""
    context = system.GetMyContextFromRoot(simulator.get_context())
    known: Observations = context.get_abstract_state(0).get_value().observations
    return known


def forecast_of(system: HumanForecast, root: Context) -> Forecast:
    context = system.GetMyContextFromRoot(root)
    found: Forecast = system.GetOutputPort("forecast").Eval(context)
    return found


def expected_at(times: np.ndarray) -> np.ndarray:
    moved: np.ndarray = START + times[:, None, None] * VELOCITY
    return moved


@pytest.mark.parametrize("period", [0.05, 0.1, 0.2])
def test_forecasts_come_at_a_fixed_rate_and_are_held_between(period: float) -> None:
    spy = _Spy()
    diagram, system = diagram_of(spy, period=period)
    spy.seen.clear()  # the one before the first observation
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.99)
    times = [h.time for h in spy.seen]
    np.testing.assert_allclose(times, period * np.arange(len(times)), atol=1e-9)
    assert times[-1] > 0.99 - period - 1e-9
    held = forecast_of(system, simulator.get_context())
    assert held.start == times[-1]


def test_history_is_what_was_observed_and_ends_now() -> None:
    spy = _Spy()
    simulator = Simulator(diagram_of(spy)[0])
    simulator.AdvanceTo(3.0)
    history = spy.seen[-1]
    times = SAMPLING.times(history.time)
    np.testing.assert_allclose(history.joints, expected_at(times), atol=1e-9)
    np.testing.assert_allclose(
        history.sleeves[..., :3], SLEEVES[:, :3] + times[:, None, None] * VELOCITY, atol=1e-9
    )
    direction = np.broadcast_to(SLEEVES[:, 3:], (HISTORY, 2, 3))
    np.testing.assert_allclose(history.sleeves[..., 3:], direction, atol=1e-9)
    # before the beginning nothing was seen
    early = spy.seen[6]
    np.testing.assert_array_equal(
        np.isfinite(early.joints[:, 0, 0]), SAMPLING.times(early.time) > -0.126
    )


def test_until_the_person_is_seen_the_first_forecast_stands() -> None:
    spy = _Spy()
    diagram, system = diagram_of(spy, _Person(since=1.0))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.95)
    assert forecast_of(system, simulator.get_context()) is system.first
    np.testing.assert_array_equal(system.first.mean[0], np.nan_to_num(FIRST))
    assert len(spy.seen) == 1
    simulator.AdvanceTo(1.05)
    assert forecast_of(system, simulator.get_context()).start == pytest.approx(1.0)


def test_outputs_are_the_forecasts_parts() -> None:
    diagram, system = diagram_of(_Spy())
    simulator = Simulator(diagram)
    for until, is_linear in ((0.15, 0.0), (1.05, 1.0)):
        simulator.AdvanceTo(until)
        found = forecast_of(system, simulator.get_context())
        context = system.GetMyContextFromRoot(simulator.get_context())
        for name in ("mean", "radius", "samples", "intent"):
            value = system.GetOutputPort(name).Eval(context)
            np.testing.assert_array_equal(value, np.ravel(getattr(found, name)))
        assert system.GetOutputPort("is_linear").Eval(context)[0] == is_linear


def test_memory_goes_from_one_forecast_to_the_next() -> None:
    """As if the predictor was called by hand with the same histories."""
    predictor = LearnedPredictor(drawn_networks(0))
    diagram, system = diagram_of(predictor, _Person(hidden=1.0))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(3.02)
    memory, known = predictor.begin(), Observations()
    for k in range(61):
        time = EVERY * k
        joints = START + time * VELOCITY
        if time > 1.0 + 1e-9:
            joints[[2, 5]] = np.nan
        sleeves = SLEEVES.copy()
        sleeves[:, :3] += time * VELOCITY
        points = np.concatenate([joints, sleeves.reshape(4, 3)])
        known = known.added(time, points, SAMPLING.kept)
        if k % 2 == 0:
            rows = known.sampled(time, SAMPLING)
            history = PersonHistory(time, rows[:, :6], rows[:, 6:].reshape(-1, 2, 6))
            expected, memory = predictor.forecast(history, memory)
    found = forecast_of(system, simulator.get_context())
    np.testing.assert_allclose(found.mean, expected.mean, atol=1e-6)
    np.testing.assert_allclose(found.radius, expected.radius, rtol=1e-5)
    np.testing.assert_array_equal(found.seen, [True, True, False] * 2)


def test_an_observation_is_counted_once_however_often_it_is_looked_at() -> None:
    """Every fourth look brings a new one."""
    delays = EVERY * np.arange(4.0)
    diagram, system = diagram_of(_Spy(), _Person(delays), stamped=True)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(2.0 + 1e-6)
    np.testing.assert_allclose(observed(system, simulator).time, 0.2 * np.arange(11), atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.floats(-1e4, 1e4))
@settings(max_examples=10)
def test_clocks_may_differ_and_the_freshest_observation_so_far_counts_as_new(
    seed: int, ahead: float
) -> None:
    rng = np.random.default_rng(seed)
    delays = rng.uniform(0.02, 0.048, 40)
    least = 0.01
    delays[0] = least
    spy = _Spy()
    diagram, _ = diagram_of(spy, _Person(delays, ahead), stamped=True)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(3.0)
    history, times = spy.seen[-1], SAMPLING.times(spy.seen[-1].time)
    # they are of as long ago as the freshest one was delayed
    np.testing.assert_allclose(history.joints, expected_at(times - least), atol=1e-6)


def test_a_fresher_observation_sets_the_lag_anew() -> None:
    delays = np.full(400, 0.04)
    delays[30:] = 0.01
    diagram, system = diagram_of(_Spy(), _Person(delays), stamped=True)
    simulator = Simulator(diagram)
    for until, delay in ((1.4, 0.04), (3.0, 0.01)):
        simulator.AdvanceTo(until + 1e-6)
        stamps = observed(system, simulator).time
        # the newest one counts as new
        assert stamps[-1] == pytest.approx(until, abs=1e-9)
        value = observed(system, simulator).value[-1, :6]
        np.testing.assert_allclose(value, START + (until - delay) * VELOCITY, atol=1e-9)
        assert (np.diff(stamps) > 0.0).all()


def test_joints_that_are_not_seen_are_missing_from_then_on() -> None:
    spy = _Spy()
    simulator = Simulator(diagram_of(spy, _Person(hidden=2.0))[0])
    simulator.AdvanceTo(3.0)
    late = spy.seen[-1]
    lost = SAMPLING.times(late.time) > 2.126
    np.testing.assert_array_equal(np.isnan(late.joints[:, 2, 0]), lost)
    np.testing.assert_array_equal(np.isnan(late.joints[:, 5, 0]), lost)
    assert np.isfinite(late.joints[:, [0, 1, 3, 4]]).all()


def test_no_more_is_kept_than_a_history_needs() -> None:
    diagram, system = diagram_of(_Spy())
    simulator = Simulator(diagram)
    simulator.AdvanceTo(8.0 + 1e-6)
    stamps = observed(system, simulator).time
    assert stamps[0] >= 8.0 - SAMPLING.kept - 1e-9
    assert len(stamps) <= round(SAMPLING.kept / EVERY) + 2


@pytest.mark.parametrize("period", [0.03, 0.12, 0.0])
def test_period_that_is_no_multiple_of_the_looks_is_refused(period: float) -> None:
    with pytest.raises(ValueError, match="expected a multiple"):
        HumanForecast(_Spy(), EVERY, period, FIRST)


def moving_forecast(start: float, velocity: float = 0.2) -> Forecast:
    """Returns a forecast of a person who moves along x, less sure with time."""
    ahead = PERIOD * np.arange(FUTURE + 1)
    mean = np.tile(START, (FUTURE + 1, 1, 1))
    mean[:, :, 0] += velocity * (start + ahead)[:, None]
    radius = 0.05 + 0.1 * ahead[:, None] * np.ones(6)
    seen = np.ones(6, dtype=bool)
    return Forecast(start, PERIOD, mean, radius, mean[None], np.ones(2), False, seen)


def viewed(
    forecast: Forecast, joints: np.ndarray, time: float, step: float, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    view = ForecastView(forecast, step, steps)
    context = view.CreateDefaultContext()
    context.SetTime(time)
    view.GetInputPort("forecast").FixValue(context, Value(forecast))
    view.GetInputPort("joint_position").FixValue(context, joints.ravel())
    return (
        view.GetOutputPort("predicted_joint_position").Eval(context).reshape(-1, 6, 3),
        view.GetOutputPort("predicted_radius").Eval(context).reshape(-1, 6),
    )


@given(st.floats(0.0, 0.5), st.sampled_from([0.02, 0.1, 0.2]), st.integers(1, 8))
@settings(max_examples=20)
def test_view_begins_now_at_what_is_seen_and_goes_on_as_predicted(
    age: float, step: float, steps: int
) -> None:
    forecast = moving_forecast(1.0)
    joints = START + np.random.default_rng(0).normal(size=(6, 3))
    rows, radius = viewed(forecast, joints, 1.0 + age, step, steps)
    assert rows.shape == (steps + 1, 6, 3)
    np.testing.assert_allclose(rows[0], joints, atol=1e-12)
    ahead = np.minimum(age + step * np.arange(steps + 1), FUTURE * PERIOD)
    np.testing.assert_allclose(
        rows[:, :, 0] - joints[:, 0], np.tile(0.2 * (ahead - ahead[0])[:, None], (1, 6)), atol=1e-9
    )
    np.testing.assert_allclose(rows[:, :, 1:], np.tile(joints[:, 1:], (steps + 1, 1, 1)), atol=1e-9)
    # what is uncertain does not become less so by being moved
    np.testing.assert_allclose(radius, np.tile(0.05 + 0.1 * ahead[:, None], (1, 6)), atol=1e-9)


def test_view_takes_joints_that_are_not_seen_as_predicted() -> None:
    forecast = moving_forecast(1.0)
    joints = START + 0.3
    joints[2] = np.nan
    rows, _ = viewed(forecast, joints, 1.25, 0.1, 4)
    times = 1.25 + 0.1 * np.arange(5, dtype=np.float64)
    np.testing.assert_allclose(rows[:, 2], forecast.mean_at(times)[:, 2], atol=1e-12)
    off = rows - forecast.mean_at(times)
    np.testing.assert_allclose(
        off[:, [0, 1, 3]], np.tile(off[:1, [0, 1, 3]], (5, 1, 1)), atol=1e-12
    )
    assert np.abs(off[:, 0]).min() > 0.01
