"""The training loop: an interruption changes nothing, it stops early, and the best is returned."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.learning.training.loop import Schedule, train

TRUE = np.array([[1.0, -2.0], [0.5, 3.0], [-1.0, 0.0]])
SCHEDULE = Schedule(steps=60, rate=0.1, every=10, patience=100)


def first() -> dict[str, np.ndarray]:
    return {"w": np.zeros((3, 2), dtype=np.float32), "b": np.ones(2, dtype=np.float32)}


def batches(step: int) -> Any:
    rng = np.random.default_rng((3, step))
    x = rng.normal(size=(16, 3))
    return tuple(torch.from_numpy(a.astype(np.float32)) for a in (x, x @ TRUE + 0.5))


def loss(weights: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
    x, y = batch
    return (x @ weights["w"] + weights["b"] - y).square().mean()


def validation(weights: Mapping[str, torch.Tensor]) -> float:
    return float(loss(weights, batches(10**6)))


def trained(schedule: Schedule = SCHEDULE, **how: Any) -> dict[str, np.ndarray] | None:
    return train(first(), batches, loss, how.pop("validation", validation), schedule, **how)


def stops_after(calls: int) -> Callable[[], bool]:
    left = [calls]

    def stop() -> bool:
        left[0] -= 1
        return left[0] < 0

    return stop


def same(a: Mapping[str, np.ndarray] | None, b: Mapping[str, np.ndarray] | None) -> bool:
    assert a is not None
    assert b is not None
    return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)


def test_training_finds_the_law_and_leaves_the_first_weights_as_they_were() -> None:
    begin = first()
    found = train(begin, batches, loss, validation, Schedule(300, 0.1, every=50, patience=100))
    assert found is not None
    np.testing.assert_allclose(found["w"], TRUE, atol=0.05)
    np.testing.assert_allclose(found["b"], 0.5, atol=0.05)
    assert {v.dtype for v in found.values()} == {np.dtype(np.float32)}
    assert same(begin, first())


@pytest.mark.parametrize("interruptions", [(0,), (14,), (19,), (59,), (3, 7, 20), (9, 9, 9, 9)])
def test_training_that_is_interrupted_ends_with_the_same_weights(
    interruptions: tuple[int, ...], tmp_path: Path
) -> None:
    path = tmp_path / "c.safetensors"
    for steps in interruptions:
        assert trained(checkpoint=path, stop=stops_after(steps)) is None
    assert same(trained(checkpoint=path), trained())


def test_training_that_is_killed_goes_on_from_the_last_checkpoint(tmp_path: Path) -> None:
    path, done = tmp_path / "c.safetensors", []

    def killed(step: int) -> Any:
        if step == 37:
            raise KeyboardInterrupt
        done.append(step)
        return batches(step)

    with pytest.raises(KeyboardInterrupt):
        train(first(), killed, loss, validation, SCHEDULE, path)
    again: list[int] = []

    def followed(step: int) -> Any:
        again.append(step)
        return batches(step)

    found = train(first(), followed, loss, validation, SCHEDULE, path)
    assert done == list(range(37))
    assert again == list(range(30, 60))
    assert same(found, trained())


def test_finished_training_does_nothing_more(tmp_path: Path) -> None:
    path = tmp_path / "c.safetensors"
    found = trained(checkpoint=path)
    reported: list[int] = []
    again = trained(checkpoint=path, report=lambda step, loss: reported.append(step))
    assert same(found, again)
    assert reported == []


def test_weights_of_the_least_validation_error_are_returned() -> None:
    """The third of six is told to be the best."""
    errors = iter([5.0, 4.0, 1.0, 2.0, 1.0, 3.0])
    seen: list[dict[str, np.ndarray]] = []

    def told(weights: Mapping[str, torch.Tensor]) -> float:
        assert not torch.is_grad_enabled()
        seen.append({k: v.detach().numpy().copy() for k, v in weights.items()})
        return next(errors)

    found = trained(validation=told)
    assert len(seen) == 6
    assert same(found, seen[2])
    assert not same(found, seen[4])


@pytest.mark.parametrize("patience", [1, 2, 3])
def test_training_stops_when_nothing_was_better_for_a_while(patience: int) -> None:
    errors = iter([2.0, 1.0] + [1.5] * 10)
    reported: list[int] = []
    found = trained(
        Schedule(200, 0.1, every=10, patience=patience),
        validation=lambda _: next(errors),
        report=lambda step, loss: reported.append(step),
    )
    assert found is not None
    assert reported == [10 * k for k in range(1, 3 + patience)]


def test_patience_is_remembered_over_an_interruption(tmp_path: Path) -> None:
    path = tmp_path / "c.safetensors"
    schedule = Schedule(200, 0.1, every=10, patience=3)
    errors = iter([1.0] + [1.5] * 20)
    reported: list[int] = []

    def told(_: Mapping[str, torch.Tensor]) -> float:
        return next(errors)

    def report(step: int, loss: float) -> None:
        reported.append(step)

    stopped = train(first(), batches, loss, told, schedule, path, report, stops_after(25))
    assert stopped is None
    assert trained(schedule, validation=told, checkpoint=path, report=report) is not None
    assert reported == [10, 20, 30, 40]


def test_validation_that_is_never_finite_returns_the_first_weights() -> None:
    assert same(trained(validation=lambda _: math.nan), first())


def test_steps_that_are_no_multiple_are_validated_at_the_end() -> None:
    reported: list[int] = []
    trained(Schedule(25, 0.1, every=10), report=lambda step, loss: reported.append(step))
    assert reported == [10, 20, 25]


def test_mean_loss_since_the_last_report_is_reported() -> None:
    losses: list[float] = []
    reported: list[float] = []

    def recorded(weights: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
        value = loss(weights, batch)
        losses.append(float(value.detach()))
        return value

    train(
        first(),
        batches,
        recorded,
        lambda _: 0.0,
        Schedule(25, 0.1, every=10),
        report=lambda step, mean: reported.append(mean),
    )
    parts = (losses[:10], losses[10:20], losses[20:])
    np.testing.assert_allclose(reported, [np.mean(part) for part in parts], rtol=1e-6)


def test_long_gradients_are_cut() -> None:
    """A batch of huge numbers moves the weights no further than a sound one."""

    def huge(step: int) -> Any:
        x, y = batches(step)
        return x, 1e12 * y

    begin = first()
    found = train(begin, huge, loss, lambda _: 0.0, Schedule(1, 0.1, decay=0.0, every=1))
    assert found is not None
    assert np.abs(found["w"] - begin["w"]).max() < 0.11


@given(st.integers(10, 500), st.floats(0.0, 0.5))
@settings(max_examples=50)
def test_rate_rises_to_its_largest_and_falls_to_zero(steps: int, warm_up: float) -> None:
    schedule = Schedule(steps, rate=0.3, warm_up=warm_up)
    rates = np.array([schedule.rate_at(k) for k in range(steps)])
    top = int(np.argmax(rates))
    assert (np.diff(rates[: top + 1]) > 0.0).all()
    assert (np.diff(rates[top:]) <= 1e-15).all()
    assert 0.26 < rates.max() <= 0.3
    assert rates.min() > 0.0
    assert rates[-1] < 0.06
    assert abs(top - warm_up * steps) <= 2.0
