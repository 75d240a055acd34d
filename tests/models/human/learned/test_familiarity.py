"""Familiar is what is like the training inputs; what is far from all of them is not."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from drake_dress.models.human.learned.familiarity import (
    FAMILIAR_SHAPES,
    distance,
    familiar_weights,
)
from drake_dress.models.human.learned.network import HISTORY
from drake_dress.models.human.learned.tokens import TOKEN_SIZE


def tokens(seed: int, count: int) -> np.ndarray:
    """Returns tokens (N,T,c) of correlated columns, as those of persons are."""
    mixing = np.random.default_rng(0).normal(size=(20, TOKEN_SIZE))
    rng = np.random.default_rng(seed)
    slow = rng.normal(size=(count, 1, 20)) + 0.3 * rng.normal(size=(count, HISTORY, 20))
    found: np.ndarray = (slow @ mixing / 4.0 + 0.5).astype(np.float32)
    return found


WEIGHTS = familiar_weights(tokens(1, 3000))


def test_weights_have_their_names_shapes_and_precision() -> None:
    assert {k: v.shape for k, v in WEIGHTS.items()} == FAMILIAR_SHAPES
    assert {v.dtype for v in WEIGHTS.values()} == {np.dtype(np.float32)}


@pytest.mark.parametrize("seed", [1, 2])
def test_inputs_as_in_training_are_nearly_all_familiar(seed: int) -> None:
    found = distance(WEIGHTS, tokens(seed, 3000))
    assert found.shape == (3000,)
    # beyond 1.5 times what 99.9 % have in training
    assert (found < 1.0).mean() > 0.999
    assert np.quantile(found, 0.999) == pytest.approx(1.0 / 1.5, rel=0.1)


def test_kept_coordinates_are_scaled_to_about_one() -> None:
    # 99.9 % of the root mean squares of 40 coordinates are below two
    assert 1.5 < WEIGHTS["familiar.limit"][0] < 3.0


def test_far_inputs_are_unfamiliar() -> None:
    sound = tokens(3, 200)
    mean = sound.mean(axis=(0, 1))
    assert (distance(WEIGHTS, mean + 6.0 * (sound - mean)) > 1.0).mean() > 0.95


def test_distance_grows_with_the_distance() -> None:
    one = tokens(4, 1)
    mean = WEIGHTS["familiar.mean"].reshape(3, TOKEN_SIZE)
    base = np.zeros((1, HISTORY, TOKEN_SIZE), dtype=np.float32)
    base[0, [0, 10, 19]] = mean
    np.testing.assert_allclose(distance(WEIGHTS, base), 0.0, atol=1e-6)
    near, far = (distance(WEIGHTS, base + k * (one - base)) for k in (1.0, 3.0))
    np.testing.assert_allclose(far, 3.0 * near, rtol=1e-4)


def test_numpy_and_torch_agree() -> None:
    some = tokens(5, 10)
    tensors = {k: torch.from_numpy(v) for k, v in WEIGHTS.items()}
    np.testing.assert_allclose(
        distance(WEIGHTS, some), distance(tensors, torch.from_numpy(some)).numpy(), rtol=1e-4
    )
