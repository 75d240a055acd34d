"""The network of intent: steps that are not there do not count, and NumPy and torch agree."""

from __future__ import annotations

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.learned.intent import (
    balanced_logit,
    intent_logit,
    intent_weights,
)
from drake_dress.models.human.learned.network import HISTORY
from drake_dress.models.human.learned.tokens import SLEEVE_COLUMNS, TOKEN_SIZE

WEIGHTS = intent_weights(np.random.default_rng(0))
seeds = st.integers(0, 2**32 - 1)


def drawn(seed: int, count: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Returns tokens, and which of their first steps are hidden."""
    rng = np.random.default_rng(seed)
    tokens = rng.normal(size=(count, HISTORY, TOKEN_SIZE)).astype(np.float32)
    known = rng.integers(1, HISTORY + 1, size=count)
    hidden = np.arange(HISTORY) < HISTORY - known[:, None]
    return tokens, hidden.astype(np.float32)


@given(seeds)
@settings(max_examples=15)
def test_numpy_and_torch_agree(seed: int) -> None:
    tokens, hidden = drawn(seed)
    tensors = {k: torch.from_numpy(v) for k, v in WEIGHTS.items()}
    found = intent_logit(WEIGHTS, tokens, hidden)
    other = intent_logit(tensors, torch.from_numpy(tokens), torch.from_numpy(hidden))
    assert found.shape == (3,)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, other.numpy(), rtol=1e-3, atol=1e-4)


@given(seeds)
@settings(max_examples=15)
def test_steps_before_the_history_do_not_count(seed: int) -> None:
    tokens, hidden = drawn(seed)
    other = np.where(hidden[..., None] > 0, np.float32(9.0), tokens)
    np.testing.assert_array_equal(
        intent_logit(WEIGHTS, tokens, hidden), intent_logit(WEIGHTS, other, hidden)
    )


@given(seeds)
@settings(max_examples=15)
def test_every_step_of_the_history_counts_and_so_does_its_place(seed: int) -> None:
    tokens, _ = drawn(seed, 1)
    none = np.zeros((1, HISTORY), dtype=np.float32)
    found = intent_logit(WEIGHTS, tokens, none)
    for step in range(HISTORY):
        changed = tokens.copy()
        changed[0, step] = -changed[0, step]
        assert intent_logit(WEIGHTS, changed, none) != found
    swapped = tokens[:, [1, 0, *range(2, HISTORY)]]
    assert intent_logit(WEIGHTS, swapped, none) != found


@given(seeds)
@settings(max_examples=15)
def test_each_arm_is_on_its_own(seed: int) -> None:
    tokens, hidden = drawn(seed)
    alone = [intent_logit(WEIGHTS, tokens[k : k + 1], hidden[k : k + 1])[0] for k in range(3)]
    np.testing.assert_allclose(intent_logit(WEIGHTS, tokens, hidden), alone, rtol=1e-4, atol=1e-5)


@given(seeds)
@settings(max_examples=15)
def test_the_arms_own_motion_has_half_of_the_say(seed: int) -> None:
    tokens, hidden = drawn(seed)
    bare = tokens.copy()
    bare[:, :, SLEEVE_COLUMNS] = 0.0
    own, whole = (intent_logit(WEIGHTS, each, hidden) for each in (bare, tokens))
    kept = tokens.copy()
    found = balanced_logit(WEIGHTS, tokens, hidden)
    np.testing.assert_allclose(found, 0.5 * (own + whole), rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(tokens, kept)
    # without sleeves there is one answer
    np.testing.assert_allclose(balanced_logit(WEIGHTS, bare, hidden), own, rtol=1e-4, atol=1e-5)
