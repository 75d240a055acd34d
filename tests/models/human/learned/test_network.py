"""The residual network: shapes, and the same in NumPy and torch."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.learned import network
from drake_dress.models.human.learned.network import FUTURE, HISTORY, WIDTH
from drake_dress.models.human.learned.tokens import TOKEN_SIZE
from tests.models.human.learned.drawn import drawn_networks

WEIGHTS = drawn_networks(0).motion
TENSORS = {k: torch.from_numpy(v) for k, v in WEIGHTS.items()}
seeds = st.integers(0, 2**32 - 1)


def drawn(seed: int, count: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Returns tokens and probabilities of intent."""
    rng = np.random.default_rng(seed)
    tokens = rng.normal(size=(count, HISTORY, TOKEN_SIZE)).astype(np.float32)
    return tokens, rng.random(count).astype(np.float32)


@given(seeds)
@settings(max_examples=15)
def test_numpy_and_torch_agree(seed: int) -> None:
    tokens, intent = drawn(seed)
    z = network.context(WEIGHTS, tokens, intent)
    other = network.context(TENSORS, torch.from_numpy(tokens), torch.from_numpy(intent))
    np.testing.assert_allclose(z, other.numpy(), rtol=1e-3, atol=1e-4)
    for head in (network.residual, network.error_scale, network.radius):
        found, again = head(WEIGHTS, z), head(TENSORS, torch.from_numpy(z))
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, again.numpy(), rtol=1e-3, atol=1e-6)


@given(seeds, st.integers(1, 5))
@settings(max_examples=15)
def test_shapes_are_as_told_and_each_arm_is_on_its_own(seed: int, count: int) -> None:
    tokens, intent = drawn(seed, count)
    z = network.context(WEIGHTS, tokens, intent)
    assert z.shape == (count, WIDTH)
    assert network.residual(WEIGHTS, z).shape == (count, FUTURE + 1, 3, 3)
    assert network.error_scale(WEIGHTS, z).shape == (count, FUTURE + 1, 3)
    alone = network.context(WEIGHTS, tokens[:1], intent[:1])
    np.testing.assert_allclose(z[:1], alone, rtol=1e-4, atol=1e-5)


@given(seeds)
@settings(max_examples=15)
def test_sizes_of_errors_are_positive_and_grow_with_the_horizon(seed: int) -> None:
    """Of fresh weights, whose outputs are about zero."""
    z = network.context(WEIGHTS, *drawn(seed))
    for head in (network.error_scale, network.radius):
        size = head(WEIGHTS, z)
        assert (size > 0.001).all()
        by_row = size[:, [0, 5, 10, 20]].mean(axis=2)
        assert (np.diff(by_row, axis=1) > 0.001).all()


def test_fresh_weights_add_about_nothing_to_the_linear_prediction() -> None:
    moved = network.residual(WEIGHTS, network.context(WEIGHTS, *drawn(0, 50)))
    assert 0.0 < np.abs(moved).mean() < 0.02


def test_intent_tokens_and_their_times_all_reach_the_context() -> None:
    tokens, intent = drawn(1, 1)
    z = network.context(WEIGHTS, tokens, intent)
    assert np.abs(network.context(WEIGHTS, tokens, 1.0 - intent) - z).max() > 1e-3
    for step in range(HISTORY):
        changed = tokens.copy()
        changed[0, step] += 1.0
        assert np.abs(network.context(WEIGHTS, changed, intent) - z).max() > 1e-3


def test_a_seed_draws_the_same_weights_in_single_precision() -> None:
    one, two, other = (network.motion_weights(np.random.default_rng(s)) for s in (1, 1, 2))
    for name in one:
        assert one[name].dtype == np.float32
        np.testing.assert_array_equal(one[name], two[name])
    assert not np.array_equal(one["enter.weight"], other["enter.weight"])
