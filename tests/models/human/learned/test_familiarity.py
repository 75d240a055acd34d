"""Familiar is what is like the training inputs; persons unlike all of them are not."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from drake_dress.models.human.learned.familiarity import (
    FAMILIAR_SHAPES,
    distance,
    familiar_weights,
)
from drake_dress.models.human.learned.network import PERIOD
from drake_dress.models.human.learned.tokens import Windows, arm_tokens
from tests.models.human.learned.drawn import SWAPPED, drawn_scene

_COUNT = 400


@lru_cache
def joints(first: int) -> np.ndarray:
    """Returns joints (N,T,6,3), m, of persons of other sizes who move."""
    rng = np.random.default_rng(first)
    drawn = [drawn_scene(seed).joints for seed in range(first, first + _COUNT)]
    found: np.ndarray = rng.uniform(0.85, 1.1, (_COUNT, 1, 1, 1)) * np.stack(drawn)
    return found + 0.003 * rng.normal(size=found.shape)


def tokens(persons: np.ndarray) -> np.ndarray:
    """Returns the tokens (2N,T,c) of persons (N,T,6,3), m, without sleeves."""
    count, steps = persons.shape[:2]
    seen, sleeves = np.ones((count, steps, 6), dtype=bool), np.zeros((count, steps, 2, 6))
    unseen = np.zeros((count, steps, 2), dtype=bool)
    return arm_tokens(Windows(persons, seen, sleeves, unseen, PERIOD)).tokens


@lru_cache
def weights() -> dict[str, np.ndarray]:
    return familiar_weights(tokens(joints(0)))


def unfamiliar(persons: np.ndarray) -> float:
    """Returns the share of arms that are unfamiliar."""
    return float((distance(weights(), tokens(persons)) > 1.0).mean())


def test_weights_have_their_names_shapes_and_precision() -> None:
    assert {k: v.shape for k, v in weights().items()} == FAMILIAR_SHAPES
    assert {v.dtype for v in weights().values()} == {np.dtype(np.float32)}


@pytest.mark.parametrize("first", [0, 5000])
def test_persons_as_in_training_are_nearly_all_familiar(first: int) -> None:
    assert unfamiliar(joints(first)) <= 0.01


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_persons_of_another_size_are_unfamiliar(size: float) -> None:
    assert unfamiliar(size * joints(5000)) == 1.0


def test_persons_upside_down_are_unfamiliar() -> None:
    assert unfamiliar(joints(5000) * [1.0, 1.0, -1.0]) > 0.95


def test_persons_with_left_and_right_exchanged_are_unfamiliar() -> None:
    assert unfamiliar(joints(5000)[:, :, SWAPPED]) > 0.95


def test_persons_who_are_shaken_are_unfamiliar() -> None:
    rng = np.random.default_rng(7)
    assert unfamiliar(joints(5000) + 0.1 * rng.normal(size=joints(5000).shape)) > 0.95


def test_distance_grows_with_the_distance_of_the_tokens() -> None:
    one = tokens(joints(5000)[:20]).astype(np.float64)
    # joint angles and lengths stay; the older steps alone move away
    far = one.copy()
    far[:, 0] += 4.0 * (one[:, 0] - one[:, 0].mean(axis=0))
    near, away = distance(weights(), one), distance(weights(), far)
    assert (away >= near - 1e-9).mean() > 0.9
    assert away.mean() > 2.0 * near.mean()
