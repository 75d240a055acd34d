"""Trains the network that tells intent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from drake_dress.learning.motion.windows import Augmentation, Batch, Sequences, WindowSource
from drake_dress.learning.training.loop import Report, Schedule, train
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.intent import balanced_logit, intent_logit, intent_weights
from drake_dress.models.human.learned.network import HISTORY

SCHEDULE = Schedule(steps=10000, rate=2e-3, every=500, patience=10)
_BATCH = 128
# Share of windows with a shorter history, and the shortest, in steps.
_SHORTER, _SHORTEST = 0.5, 5
# Weight of an arm that moves by will: one in seven does, and to miss a person who withdraws is
# worse than to see will where there is none.
_WILLED = 3.0
# Noise of joints in validation, m, and time between its windows, s.
NOISE, EVERY = 0.004, 0.5
_VALIDATION = 7  # seed


@dataclass(frozen=True)
class IntentTraining:
    """A training of the intent network.

    Attributes:
        train, validation: sequences in a garment.
        seed: of weights and batches.
        schedule: of the training.
        with_sleeves: whether the network sees sleeves.
    """

    train: Sequences
    validation: Sequences
    seed: int = 0
    schedule: Schedule = SCHEDULE
    with_sleeves: bool = True

    def run(
        self,
        checkpoint: Path | None = None,
        report: Report = lambda step, loss: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> dict[str, np.ndarray] | None:
        """Returns the trained weights; None if stopped before the end. See `loop.train`."""
        held_out = windows_of(self.validation, _VALIDATION, self.with_sleeves)

        def batches(step: int) -> tuple[torch.Tensor, ...]:
            how = Augmentation(bare=Augmentation.bare if self.with_sleeves else 1.0)
            batch = WindowSource(self.train, (self.seed, step), how).drawn(_BATCH)
            rng = np.random.default_rng((self.seed, step, 1))
            count = len(batch.intent)
            known = rng.integers(_SHORTEST, HISTORY + 1, size=count)
            known = np.where(rng.random(count) < _SHORTER, known, HISTORY)
            return (
                torch.from_numpy(batch.arms.tokens),
                torch.from_numpy(hidden_before(known)),
                torch.from_numpy(batch.intent.astype(np.float32)),
            )

        def loss(weights: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
            device = next(iter(weights.values())).device
            tokens, hidden, wanted = (part.to(device) for part in batch)
            logit = intent_logit(weights, tokens, hidden)
            weight = torch.tensor(_WILLED, device=device)
            return torch.nn.functional.binary_cross_entropy_with_logits(
                logit, wanted, pos_weight=weight
            )

        def validation(weights: Mapping[str, torch.Tensor]) -> float:
            arrays = {k: v.detach().cpu().numpy() for k, v in weights.items()}
            losses = []
            for batch in held_out:
                logit = logits(arrays, batch, HISTORY)
                willed = batch.intent > 0
                loss = np.logaddexp(0.0, np.where(willed, -logit, logit))
                losses.append((np.where(willed, _WILLED, 1.0) * loss).mean())
            return float(np.mean(losses))

        first = intent_weights(np.random.default_rng(self.seed))
        return train(first, batches, loss, validation, self.schedule, checkpoint, report, stop)


def windows_of(data: Sequences, seed: int, with_sleeves: bool = True) -> list[Batch]:
    """Returns windows of all sequences, `EVERY` s apart, with noise."""
    source = WindowSource(data, seed, noise=NOISE, with_sleeves=with_sleeves)
    return source.every(EVERY)


def logits(weights: Mapping[str, np.ndarray], batch: Batch, steps: int) -> FloatArray:
    """Returns the logits (2B,) of a batch of which the last `steps` are in the history."""
    hidden = hidden_before(np.full(len(batch.intent), steps))
    return balanced_logit(weights, batch.arms.tokens, hidden)


def hidden_before(known: np.ndarray) -> np.ndarray:
    """Returns (N,T) 1 for steps before the last `known` (N,) ones, else 0."""
    step = np.arange(HISTORY)[None]
    return (step < HISTORY - known[:, None]).astype(np.float32)
