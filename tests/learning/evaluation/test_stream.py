"""A motion that is followed: errors are those of the predictions, and everything is told."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from drake_dress.learning.evaluation.baselines import constant_velocity, still
from drake_dress.learning.evaluation.stream import MOVES, Compared, followed
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.human.history import Sampling
from drake_dress.models.human.learned.diffusion import SAMPLES
from drake_dress.models.human.learned.forecast import Forecast, PersonHistory
from drake_dress.models.human.learned.network import FUTURE, PERIOD
from drake_dress.models.human.learned.predictor import SAMPLING, LearnedPredictor
from tests.models.human.learned.drawn import drawn_networks, drawn_scene, lengths

BASELINES = {"constant velocity": constant_velocity, "still": still}
AHEAD = PERIOD * np.arange(FUTURE + 1)


@dataclass
class _Spy:
    """Predicts rest with a constant radius, and keeps what it sees."""

    radius: float = 0.1
    sampling: Sampling = SAMPLING
    seen: list[PersonHistory] = field(default_factory=list)
    memories: list[int] = field(default_factory=list)

    def begin(self) -> int:
        return 0

    def forecast(self, history: PersonHistory, memory: Any) -> tuple[Forecast, Any]:
        self.seen.append(history)
        self.memories.append(memory)
        mean = still(history)
        samples = np.stack([mean + 0.01 * (k + 1) for k in range(SAMPLES)])
        known = np.all(np.isfinite(history.joints[-1]), axis=1)
        radius = np.full((FUTURE + 1, 6), self.radius)
        intent = np.array([0.25, 0.75])
        forecast = Forecast(history.time, PERIOD, mean, radius, samples, intent, False, known)
        return forecast, memory + 1


def carried(velocity: float = 0.2, duration: float = 5.0, rate: float = 0.04) -> TimedMotion:
    """Returns a person who is carried along x; the left arm moves by will after 2.5 s."""
    time = np.arange(0.0, duration + 1e-9, rate)
    scene = drawn_scene(0, 1)
    way = np.zeros((len(time), 1, 3))
    way[:, 0, 0] = velocity * time
    sleeves = np.tile(scene.sleeves[0], (len(time), 1, 1))
    sleeves[:, :, :3] += way
    intent = np.stack([time >= 2.5, 0.0 * time], axis=1).astype(np.int64)
    return TimedMotion("some", time, scene.joints[0] + way, sleeves, intent)


def compared(motion: TimedMotion, spy: _Spy | None = None, **how: Any) -> list[Compared]:
    return list(followed(motion, _Spy() if spy is None else spy, BASELINES, **how))


def test_constant_velocity_has_no_error_and_rest_errs_by_the_distance() -> None:
    for found in compared(carried()):
        np.testing.assert_allclose(found.errors["constant velocity"], 0.0, atol=1e-3)
        expected = np.tile(0.2 * AHEAD[:, None], (1, 6))
        np.testing.assert_allclose(found.errors["still"], expected, atol=1e-6)
        np.testing.assert_allclose(found.errors["learned"], expected, atol=1e-6)
        assert found.known.all()


def test_forecasts_are_made_from_the_beginning_and_count_after_a_second() -> None:
    spy = _Spy()
    found = compared(carried(), spy)
    np.testing.assert_allclose(np.diff([c.time for c in found]), PERIOD)
    assert found[0].time == pytest.approx(1.0)
    # the last one's future just ends with the motion
    assert found[-1].time == pytest.approx(5.0 - FUTURE * PERIOD)
    assert spy.memories == list(range(len(spy.seen)))
    assert spy.seen[0].time == 0.0


def test_inside_are_those_whose_error_is_at_most_the_radius() -> None:
    for found in compared(carried(), _Spy(radius=0.2 + 1e-6)):
        np.testing.assert_array_equal(found.inside, np.tile((AHEAD <= 1.0)[:, None], (1, 6)))


def test_best_sample_is_the_nearest_on_average() -> None:
    """Of a person at rest, samples are off by 1, 2, … cm along each axis."""
    for found in compared(carried(velocity=0.0)):
        np.testing.assert_allclose(found.best, 0.01 * np.sqrt(3.0), atol=1e-9)
        assert not found.moves.any()


def test_best_samples_are_of_each_arm_on_its_own() -> None:
    motion = carried(velocity=0.0)
    motion.joints[:, 3, 2] += 0.1 * motion.time
    for found in compared(motion):
        assert found.best[0] == pytest.approx(0.01 * np.sqrt(3.0))
        assert found.best[1] > 0.03


def test_arms_move_that_go_far_enough_before_or_after() -> None:
    # within two seconds before and two after
    for speed, moves in ((0.9 * MOVES / 2.0, False), (1.1 * MOVES / 1.0, True)):
        assert all((c.moves == moves).all() for c in compared(carried(speed)))


def test_one_arm_moves_alone() -> None:
    motion = carried(0.0)
    motion.joints[:, 5, 2] += 0.2 * np.sin(motion.time)
    for found in compared(motion):
        np.testing.assert_array_equal(found.moves, [False, True])


def test_noise_is_seen_and_not_part_of_the_truth() -> None:
    quiet, spy = _Spy(), _Spy()
    clean = compared(carried(0.0), quiet)
    found = compared(carried(0.0), spy, noise=0.01)
    off = spy.seen[-1].joints - quiet.seen[-1].joints
    assert 0.003 < off.std() < 0.012
    error = np.mean([c.errors["still"] for c in found])
    assert 0.005 < error < 0.02
    assert np.max([c.errors["still"] for c in clean]) < 1e-9
    again = compared(carried(0.0), noise=0.01)
    np.testing.assert_array_equal(again[3].errors["still"], found[3].errors["still"])
    other = compared(carried(0.0), noise=0.01, seed=1)
    assert not np.array_equal(other[3].errors["still"], found[3].errors["still"])


def test_hidden_joints_are_not_observed_and_the_comparison_tells_which() -> None:
    spy = _Spy()
    hand = np.arange(6) == 2

    def hide(time: float) -> np.ndarray:
        return hand if 2.0 < time < 3.5 else ~np.ones(6, dtype=bool)

    found = compared(carried(duration=6.0), spy, hide=hide)
    for c in found:
        hidden = 2.2 < c.time < 3.5
        if hidden or c.time < 2.0 or c.time > 3.6:
            np.testing.assert_array_equal(c.hidden, hand & hidden)
        # the truth is known all the same
        assert c.known.all()
    late = next(h for h in spy.seen if h.time > 3.3)
    assert np.isnan(late.joints[-9:, 2]).all()
    assert np.isfinite(late.joints[:, [0, 1, 3, 4, 5]]).all()


def test_truth_that_nobody_knows_is_not_counted() -> None:
    motion = carried()
    motion.joints[:, 4] = np.nan
    with np.errstate(all="raise"):
        found = compared(motion)
    for c in found:
        assert not c.known[:, 4].any()
        assert np.isnan(c.errors["still"][:, 4]).all()
        assert not c.inside[:, 4].any()
        assert np.isfinite(c.best[0])
        assert np.isnan(c.best[1])


def test_person_whose_hand_is_never_known_is_taken_to_rest(
    recwarn: pytest.WarningsRecorder,
) -> None:
    motion = carried()
    motion.joints[:, [2, 5]] = np.nan
    assert not any(c.moves.any() for c in compared(motion))
    assert not len(recwarn)


def test_intent_is_told_with_the_truth_where_it_is_known() -> None:
    motion = carried()
    for c in compared(motion):
        np.testing.assert_array_equal(c.intent[0], [0.25, 0.75])
        if abs(c.time - 2.5) > 0.05:
            np.testing.assert_array_equal(c.intent[1], [float(c.time > 2.5), 0.0])
    bare = TimedMotion("some", motion.time, motion.joints, motion.sleeves)
    assert all(np.isnan(c.intent[1]).all() for c in compared(bare))


def test_nothing_is_forecast_before_the_person_is_seen() -> None:
    spy = _Spy()
    found = compared(carried(), spy, hide=lambda time: np.full(6, time < 1.5))
    assert spy.seen[0].time > 1.3
    assert found[0].time == spy.seen[0].time


@pytest.mark.parametrize(("limit", "is_linear"), [(1e3, False), (1e-6, True)])
def test_learned_predictor_is_followed_as_in_a_run(limit: float, is_linear: bool) -> None:
    predictor = LearnedPredictor(drawn_networks(0, limit))
    motion = carried(0.1, 4.0)
    found = list(followed(motion, predictor, BASELINES, noise=0.002))
    assert len(found) == 11
    assert all(c.is_linear == is_linear for c in found)
    assert all(np.isfinite(c.errors["learned"]).all() for c in found)
    assert np.mean([c.errors["learned"] for c in found]) < 0.5 * lengths(motion.joints[0])[1]
