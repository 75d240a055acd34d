"""The recurrent baseline learns motion that goes on, and goes on where it was interrupted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drake_dress.learning.training import recurrent as module
from drake_dress.learning.training.loop import Schedule
from drake_dress.learning.training.motion import validation_windows
from drake_dress.learning.training.recurrent import RecurrentTraining, recurrent_errors
from drake_dress.models.human.learned.recurrent import recurrent_weights
from drake_dress.models.human.learned.weights import (
    read_weights,
    recurrent_shapes,
    write_weights,
)
from tests.learning.made import carried


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_BATCH", 32)


def training(steps: int) -> RecurrentTraining:
    schedule = Schedule(steps, rate=5e-3, every=max(1, steps // 3), patience=9)
    return RecurrentTraining(carried(0, 12), {"active": carried(50, 3)}, schedule=schedule)


def test_training_learns_and_gives_weights_that_are_read(tmp_path: Path) -> None:
    found = training(60).run()
    assert found is not None
    batches = validation_windows(carried(80, 4))
    drawn = recurrent_weights(np.random.default_rng(0))
    after = np.mean([recurrent_errors(found, b).mean() for b in batches])
    before = np.mean([recurrent_errors(drawn, b).mean() for b in batches])
    assert after < 0.6 * before
    path = tmp_path / "recurrent.safetensors"
    write_weights(path, found, {})
    again = read_weights(path, recurrent_shapes())
    np.testing.assert_array_equal(
        recurrent_errors(again, batches[0]), recurrent_errors(found, batches[0])
    )


def test_training_that_is_interrupted_ends_with_the_same_weights(tmp_path: Path) -> None:
    path = tmp_path / "recurrent.safetensors"
    stops = iter([False, False, True])
    assert training(6).run(path, stop=lambda: next(stops)) is None
    found, whole = training(6).run(path), training(6).run()
    assert found is not None
    assert whole is not None
    for name, array in whole.items():
        np.testing.assert_array_equal(found[name], array)
