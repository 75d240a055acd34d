"""The training loop: any loss over weights and batches, with checkpoints, resume and early stop.

Every batch follows from the seed and its number alone, so a training that was interrupted and goes
on ends with the same weights as one that was not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from drake_dress.learning.training.checkpoint import Checkpoint
from drake_dress.machine import one_thread

# A batch by its number; arrays or tensors by name.
Batches = Callable[[int], Any]
# Loss of weights on a batch, to be differentiated.
Loss = Callable[[Mapping[str, torch.Tensor], Any], torch.Tensor]
# Error of weights on validation data, which decides when to stop and which weights to keep.
Validation = Callable[[Mapping[str, torch.Tensor]], float]
# What is called after some steps: number of steps done, mean loss since then.
Report = Callable[[int, float], None]


@dataclass(frozen=True)
class Schedule:
    """How long and how fast a training goes.

    Attributes:
        steps: number of batches at most.
        rate: largest learning rate; it rises over the first `warm_up` share of the steps and falls
            with a cosine to zero.
        decay: weight decay (AdamW, Loshchilov and Hutter 2019).
        warm_up: share of the steps.
        every: steps between validations, checkpoints and reports.
        patience: validations without a better one after which it stops.
        longest: norm to which gradients are cut.
    """

    steps: int
    rate: float = 2e-3
    decay: float = 1e-2
    warm_up: float = 0.1
    every: int = 500
    patience: int = 12
    longest: float = 1.0

    def rate_at(self, step: int) -> float:
        """Returns the learning rate of a step."""
        warm = max(1.0, self.warm_up * self.steps)
        if step < warm:
            return self.rate * min(1.0, (step + 1) / warm)
        along = (step - warm) / max(1.0, self.steps - warm)
        return 0.5 * self.rate * (1.0 + math.cos(math.pi * min(1.0, along)))


@dataclass
class _Best:
    """The best weights so far, their validation error, and how often none was better since."""

    weights: dict[str, np.ndarray]
    error: float = math.inf
    misses: int = 0


def train(
    weights: Mapping[str, np.ndarray],
    batches: Batches,
    loss: Loss,
    validation: Validation,
    schedule: Schedule,
    checkpoint: Path | None = None,
    report: Report = lambda step, loss: None,
    stop: Callable[[], bool] = lambda: False,
) -> dict[str, np.ndarray] | None:
    """Returns the weights with the least validation error; None if it was stopped before the end.

    Args:
        weights: to begin with.
        batches: of the training data.
        loss: of a batch.
        validation: error on validation data.
        schedule: of the training.
        checkpoint: file that it goes on from if there is one, and writes to.
        report: called at every validation.
        stop: returns whether to stop at the next step; the checkpoint is then written.
    """
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    state = Checkpoint.read(checkpoint, weights) if checkpoint is not None else None
    state = state or Checkpoint.new(weights)
    tensors = {k: torch.tensor(v, device=device) for k, v in state.weights.items()}
    parameters = list(tensors.values())
    for tensor in parameters:
        tensor.requires_grad_()
    optimiser = torch.optim.AdamW(parameters, lr=schedule.rate, weight_decay=schedule.decay)
    state.load_moments(optimiser, tensors)
    best = _Best(dict(state.best), state.error, state.misses)
    total, count, step = 0.0, 0, state.step
    with one_thread(), ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(batches, step)
        while step < schedule.steps and best.misses < schedule.patience:
            batch = coming.result()
            if step + 1 < schedule.steps:
                coming = ahead.submit(batches, step + 1)
            for group in optimiser.param_groups:
                group["lr"] = schedule.rate_at(step)
            value = loss(tensors, batch)
            optimiser.zero_grad()
            value.backward()
            torch.nn.utils.clip_grad_norm_(parameters, schedule.longest)
            optimiser.step()
            total, count, step = total + float(value.detach()), count + 1, step + 1
            stopped = stop()
            if step % schedule.every == 0 or step == schedule.steps:
                _validate(best, tensors, validation)
                report(step, total / max(count, 1))
                total, count = 0.0, 0
            if checkpoint is not None and (step % schedule.every == 0 or stopped):
                kept = Checkpoint.of(
                    step, tensors, optimiser, best.weights, best.error, best.misses
                )
                kept.write(checkpoint)
            if stopped:
                return None
    return best.weights


def _validate(best: _Best, tensors: Mapping[str, torch.Tensor], validation: Validation) -> None:
    with torch.no_grad():
        error = validation(tensors)
    if error < best.error:
        best.weights = {k: v.detach().cpu().numpy().copy() for k, v in tensors.items()}
        best.error, best.misses = error, 0
    else:
        best.misses += 1
