"""The recurrent baseline is the same in NumPy and torch, and reads all of the history."""

import numpy as np
import torch

from drake_dress.learning.evaluation.recurrent import recurrent_motion, recurrent_weights
from drake_dress.models.human.learned.tokens import TOKEN_SIZE

RNG = np.random.default_rng(0)
WEIGHTS = recurrent_weights(RNG)
TOKENS = RNG.normal(size=(3, 20, TOKEN_SIZE)).astype(np.float32)


def test_numpy_and_torch_agree() -> None:
    tensors = {name: torch.from_numpy(array) for name, array in WEIGHTS.items()}
    found = recurrent_motion(WEIGHTS, TOKENS)
    assert found.shape == (3, 21, 3, 3)
    other = recurrent_motion(tensors, torch.from_numpy(TOKENS)).numpy()
    np.testing.assert_allclose(found, other, atol=1e-5)


def test_every_step_of_the_history_counts() -> None:
    plain = recurrent_motion(WEIGHTS, TOKENS)
    for step in (0, 10, 19):
        changed = TOKENS.copy()
        changed[:, step] += 1.0
        assert np.abs(recurrent_motion(WEIGHTS, changed) - plain).max() > 0.0
