"""Trains the small recurrent network that the learned predictor is compared with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from drake_dress.learning.motion.windows import Augmentation, Batch, Sequences, WindowSource
from drake_dress.learning.training.loop import Report, Schedule, train
from drake_dress.learning.training.motion import NOISE, validation_windows
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.linear import LEAST_MOTION
from drake_dress.models.human.learned.recurrent import recurrent_motion, recurrent_weights

SCHEDULE = Schedule(steps=5000, rate=2e-3, every=500, patience=8)
_BATCH = 256


@dataclass(frozen=True)
class RecurrentTraining:
    """A training of the recurrent network.

    Attributes:
        train: sequences of all kinds.
        validation: sequences by kind.
        seed: of weights and batches.
        schedule: of the training.
        with_sleeves: whether the network sees sleeves.
    """

    train: Sequences
    validation: Mapping[str, Sequences]
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
        how = Augmentation(bare=Augmentation.bare if self.with_sleeves else 1.0)
        held_out = [
            batch
            for data in self.validation.values()
            for batch in validation_windows(data, self.with_sleeves)
        ]

        def batches(step: int) -> tuple[torch.Tensor, ...]:
            batch = WindowSource(self.train, (self.seed, step), how, NOISE).drawn(_BATCH)
            return (
                torch.from_numpy(batch.arms.tokens),
                torch.from_numpy(batch.displacement.astype(np.float32)),
                torch.from_numpy(_counting(batch).astype(np.float32)),
            )

        def loss(w: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
            device = next(iter(w.values())).device
            tokens, wanted, counting = (part.to(device) for part in batch)
            off = recurrent_motion(w, tokens) - wanted
            return (counting * (off.square().sum(-1) + 1e-8).sqrt().mean((1, 2))).mean()

        def validation(w: Mapping[str, torch.Tensor]) -> float:
            arrays = {k: v.detach().cpu().numpy() for k, v in w.items()}
            of = [_counting(b) * recurrent_errors(arrays, b).mean(axis=(1, 2)) for b in held_out]
            return float(np.concatenate(of).mean())

        first = recurrent_weights(np.random.default_rng(self.seed))
        return train(first, batches, loss, validation, self.schedule, checkpoint, report, stop)


def _counting(batch: Batch) -> FloatArray:
    """Returns the weights (2B,) of windows, the inverse of how far their joints came.

    Else persons who walk would outweigh those who are being dressed.
    """
    joints = batch.arms.joints[:, :, :3]
    way = np.linalg.norm(joints[:, :-1] - joints[:, -1:], axis=3).mean(axis=(1, 2))
    counting: FloatArray = LEAST_MOTION / (LEAST_MOTION + way)
    return counting


def recurrent_errors(weights: Mapping[str, np.ndarray], batch: Batch) -> FloatArray:
    """Returns the errors (2B,F,3) of the network, m, of each step and joint of a batch."""
    off = recurrent_motion(weights, batch.arms.tokens) - batch.displacement
    errors: FloatArray = np.linalg.norm(off[:, 1:], axis=3)
    return errors
