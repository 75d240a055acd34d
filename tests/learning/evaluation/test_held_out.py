"""Scores on held-out sequences: the area under a curve, and errors of baselines that are known."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.learning.evaluation.held_out import (
    area_under_curve,
    begins,
    compared,
    goes_on,
    held_out_batches,
    intent_score,
    plain,
    rests,
)
from drake_dress.models.human.learned.intent import intent_weights
from drake_dress.models.human.learned.linear import LinearMotion
from tests.learning.made import Data, carried
from tests.models.human.learned.drawn import drawn_networks


@dataclass
class Moving:
    """Two persons who move as a whole at a constant velocity."""

    joint_position: Any
    sleeve: Any
    intent: Any


def moving(velocity: float) -> Moving:
    left = np.array([[0.0, 0.18, 1.4], [0.02, 0.22, 1.12], [0.1, 0.24, 0.85]])
    pose = np.concatenate([left, left * [1.0, -1.0, 1.0]])
    time = 0.05 * np.arange(120)
    way = velocity * time[:, None] * np.array([1.0, 0.0, 0.0])
    joints = np.tile(pose + way[:, None], (2, 1, 1, 1))
    return Moving(joints, np.full((2, 120, 2, 6), np.nan), np.zeros((2, 120, 2), dtype=np.int64))


def test_constant_velocity_is_exact_where_it_is_constant_and_still_lags() -> None:
    batches = held_out_batches(moving(0.2), 0.0)
    baselines = plain(LinearMotion(np.zeros((3, 19, 20))))
    assert sum(len(b.intent) for b in batches) > 10
    for batch in batches:
        for name in ("last velocity", "constant velocity"):
            off = np.linalg.norm(baselines[name](batch) - batch.displacement, axis=3)
            assert off.max() < 1e-9
        still = np.linalg.norm(baselines["still"](batch) - batch.displacement, axis=3)
        way = np.broadcast_to(0.02 * np.arange(21)[:, None], still.shape)
        np.testing.assert_allclose(still, way, atol=1e-9)
        damped = np.linalg.norm(baselines["damped velocity"](batch) - batch.displacement, axis=3)
        assert np.all(damped[:, 1:] < still[:, 1:])


def test_noise_is_what_is_said() -> None:
    batches = held_out_batches(moving(0.0), 0.01)
    now = np.concatenate([b.displacement[:, 0] for b in batches])
    assert np.std(now) == pytest.approx(0.01, rel=0.15)


@given(
    st.lists(st.tuples(st.integers(-3, 3), st.booleans()), min_size=2, max_size=40).filter(
        lambda rows: len({true for _, true in rows}) == 2
    )
)
def test_area_is_the_share_of_pairs_in_the_right_order(rows: list[tuple[int, bool]]) -> None:
    score, true = np.array([float(s) for s, _ in rows]), np.array([t for _, t in rows])
    gap = score[true][:, None] - score[~true][None]
    expected = float(np.mean((gap > 0.0) + 0.5 * (gap == 0.0)))
    assert area_under_curve(score, true) == pytest.approx(expected)


def willing() -> Moving:
    """Persons at rest but for one arm, whose intent is told to last from 2.5 s to 4 s."""
    data = moving(0.0)
    data.intent[:, 50:80, 0] = 1
    return data


def test_each_arm_begins_or_goes_on_or_rests() -> None:
    (batch,) = held_out_batches(willing(), 0.0)
    groups = np.stack([which(batch) for which in (begins, goes_on, rests)])
    np.testing.assert_array_equal(groups.sum(axis=0), 1)
    assert groups.any(axis=1).all()
    # left arms come first, by person and time; now is from 1.9 s on, every 0.5 s
    times = np.tile(1.9 + 0.5 * np.arange(len(batch.intent) // 4), 2)
    left = groups[:, : len(batch.intent) // 2]
    np.testing.assert_array_equal(left[0], times < 2.5)
    np.testing.assert_array_equal(left[1], times >= 2.5)
    assert groups[2, len(batch.intent) // 2 :].all()


def test_only_what_is_chosen_is_compared() -> None:
    networks = drawn_networks(0)
    batches = held_out_batches(willing(), 0.01)
    windows = compared(batches, networks, {})
    groups = [np.concatenate([w(b) for b in batches]) for w in (begins, goes_on, rests)]
    parts, whole = [windows.mean(chosen) for chosen in groups], windows.mean()
    counts = [part.count for part in parts]
    assert sum(counts) == whole.count
    for of in (
        lambda found: found.errors["learned"]["1 s"],
        lambda found: found.best,
        lambda found: found.covered,
    ):
        mean = np.average([of(part) for part in parts], weights=counts)
        assert of(whole) == pytest.approx(float(mean))
    none = windows.mean(np.zeros_like(groups[0]))
    assert none.count == 0
    assert np.isnan(none.best)


def test_area_without_both_is_not_known() -> None:
    assert np.isnan(area_under_curve(np.zeros(3), np.ones(3, dtype=bool)))


def test_intent_is_right_by_half_if_the_answer_is_always_no() -> None:
    """Told of both intents alike; of all windows the share that is not by will."""
    weights = intent_weights(np.random.default_rng(0))
    never = {k: np.zeros_like(v) for k, v in weights.items()} | {"intent.bias": np.array([-1.0])}
    data = carried(3, 12)
    batches = held_out_batches(Data(data.joint_position, data.sleeve, steady(data.intent)), 0.0)
    score = intent_score(batches, never, 10)
    assert score.balanced == 0.5
    assert score.accuracy == pytest.approx(1.0 - score.willed)
    assert 0.0 < score.willed < 0.5


def steady(intent: np.ndarray) -> np.ndarray:
    """Returns intents that are the same throughout: will in one sequence of four."""
    by_will = np.arange(len(intent)) % 4 == 0
    return np.broadcast_to(by_will[:, None, None], intent.shape).astype(np.int64)
