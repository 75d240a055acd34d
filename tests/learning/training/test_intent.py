"""A short training of intent: it learns from a handful of sequences, and its weights are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.learning.evaluation.held_out import area_under_curve
from drake_dress.learning.training import intent as module
from drake_dress.learning.training.intent import (
    IntentTraining,
    hidden_before,
    logits,
    windows_of,
)
from drake_dress.learning.training.loop import Schedule
from drake_dress.models.human.learned.intent import intent_weights
from drake_dress.models.human.learned.network import HISTORY
from drake_dress.models.human.learned.tokens import SLEEVE_COLUMNS
from drake_dress.models.human.learned.weights import intent_shapes, read_weights, write_weights
from tests.learning.made import Data, carried

SHORT = Schedule(steps=100, rate=1e-2, every=50, patience=9)


def told_by_speed(seed: int, count: int) -> Data:
    """Returns persons of whom those who move fast do so by will."""
    data = carried(seed, count, 100)
    joints, sleeves = data.joint_position.copy(), data.sleeve.copy()
    slow = np.arange(count) % 2 == 0
    joints[slow] = joints[slow, :1]
    sleeves[slow] = sleeves[slow, :1]
    intent = np.tile(np.where(slow, 0, 1)[:, None, None], (1, 100, 2))
    return Data(joints, sleeves, intent)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_BATCH", 32)


@pytest.mark.usefixtures("small")
def test_training_learns_and_gives_weights_that_are_read(tmp_path: Path) -> None:
    training = IntentTraining(told_by_speed(0, 40), told_by_speed(50, 6), schedule=SHORT)
    reported: list[int] = []
    found = training.run(report=lambda step, loss: reported.append(step))
    assert found is not None
    assert reported == [50, 100]
    batches = [b for seed in (80, 100, 120) for b in windows_of(told_by_speed(seed, 8), 3)]
    logit = np.concatenate([logits(found, batch, HISTORY) for batch in batches])
    willed = np.concatenate([batch.intent > 0 for batch in batches])
    assert np.mean((logit > 0) == willed) > 0.9
    assert area_under_curve(logit, willed) > 0.98
    path = tmp_path / "intent.safetensors"
    write_weights(path, found, {})
    again = read_weights(path, intent_shapes())
    np.testing.assert_array_equal(logits(again, batches[0], 10), logits(found, batches[0], 10))


@pytest.mark.usefixtures("small")
def test_training_that_is_interrupted_ends_with_the_same_weights(tmp_path: Path) -> None:
    training = IntentTraining(
        told_by_speed(0, 4), told_by_speed(50, 2), schedule=Schedule(6, every=2)
    )
    path = tmp_path / "intent.safetensors"
    stops = iter([False, False, True])
    assert training.run(path, stop=lambda: next(stops)) is None
    found, whole = training.run(path), training.run()
    assert found is not None
    assert whole is not None
    for name, array in whole.items():
        np.testing.assert_array_equal(found[name], array)


@given(st.lists(st.integers(0, HISTORY), min_size=1, max_size=5))
def test_as_many_steps_are_visible_as_are_known(known: list[int]) -> None:
    hidden = hidden_before(np.array(known))
    assert hidden.dtype == np.float32
    np.testing.assert_array_equal((hidden == 0.0).sum(axis=1), known)
    # the last ones
    assert (np.diff(hidden, axis=1) <= 0.0).all()


@given(st.integers(1, HISTORY - 1))
def test_logits_of_a_shorter_history_do_not_know_what_was_before(steps: int) -> None:
    (batch,) = windows_of(told_by_speed(0, 2), 3)
    weights = intent_weights(np.random.default_rng(0))
    found = logits(weights, batch, steps)
    batch.arms.tokens[:, : HISTORY - steps] += 1.0
    np.testing.assert_array_equal(logits(weights, batch, steps), found)
    assert not np.array_equal(logits(weights, batch, HISTORY), found)


def test_without_sleeves_none_is_seen_in_training_and_validation() -> None:
    for batch in windows_of(told_by_speed(0, 2), 3, with_sleeves=False):
        assert not batch.arms.tokens[:, :, SLEEVE_COLUMNS].any()
