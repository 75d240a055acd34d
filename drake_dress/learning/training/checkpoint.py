"""Checkpoints of a training, as safetensors: reading one executes no code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.numpy import load_file, save_file

from drake_dress.errors import UserError
from drake_dress.file_output import replacing

_MOMENTS = ("exp_avg", "exp_avg_sq")
# What reading raises for files of other contents, and for kinds of numbers that NumPy has not.
_DAMAGE = (SafetensorError, OSError, KeyError, ValueError, TypeError, AttributeError)


@dataclass
class Checkpoint:
    """A training in progress.

    Attributes:
        step: steps done.
        weights: now.
        moments: of AdamW, by `<moment>/<weight>`.
        best: weights with the least validation error so far.
        error: that error.
        misses: validations since then.
    """

    step: int
    weights: dict[str, np.ndarray]
    moments: dict[str, np.ndarray]
    best: dict[str, np.ndarray]
    error: float
    misses: int

    @classmethod
    def new(cls, weights: Mapping[str, np.ndarray]) -> Checkpoint:
        """Returns the beginning of a training."""
        return cls(0, dict(weights), {}, dict(weights), math.inf, 0)

    @classmethod
    def of(
        cls,
        step: int,
        tensors: Mapping[str, torch.Tensor],
        optimiser: torch.optim.Optimizer,
        best: Mapping[str, np.ndarray],
        error: float,
        misses: int,
    ) -> Checkpoint:
        """Returns the checkpoint of a training."""
        moments = {}
        for name, tensor in tensors.items():
            for moment in _MOMENTS:
                moments[f"{moment}/{name}"] = optimiser.state[tensor][moment].cpu().numpy().copy()
        weights = {k: v.detach().cpu().numpy().copy() for k, v in tensors.items()}
        return cls(step, weights, moments, dict(best), error, misses)

    def load_moments(
        self, optimiser: torch.optim.Optimizer, tensors: Mapping[str, torch.Tensor]
    ) -> None:
        """Sets the optimiser's moments."""
        if not self.moments:
            return
        for name, tensor in tensors.items():
            state = {m: torch.tensor(self.moments[f"{m}/{name}"]).to(tensor) for m in _MOMENTS}
            optimiser.state[tensor] = {"step": torch.tensor(float(self.step)), **state}

    def write(self, path: Path) -> None:
        """Writes the checkpoint atomically."""
        arrays = {f"weights/{k}": v for k, v in self.weights.items()}
        arrays |= {f"best/{k}": v for k, v in self.best.items()}
        arrays |= {f"moments/{k}": v for k, v in self.moments.items()}
        told = {"step": str(self.step), "error": repr(self.error), "misses": str(self.misses)}
        with replacing(path) as partial:
            save_file({k: np.ascontiguousarray(v) for k, v in arrays.items()}, partial, told)

    @classmethod
    def read(cls, path: Path, like: Mapping[str, np.ndarray]) -> Checkpoint | None:
        """Returns the checkpoint in a file; None if there is no file.

        Args:
            path: of the file.
            like: weights whose names and shapes it must have.

        Raises:
            UserError: the file is damaged, or of another network.
        """
        if not path.exists():
            return None
        expected = "expected a checkpoint of this training; remove it to begin anew"
        try:
            arrays = load_file(path)
            told = _metadata(path)
            step, error, misses = int(told["step"]), float(told["error"]), int(told["misses"])
        except _DAMAGE as problem:
            raise UserError(str(path), "", f"cannot be read, {expected}") from problem
        parts: dict[str, dict[str, np.ndarray]] = {"weights": {}, "best": {}, "moments": {}}
        for name, array in arrays.items():
            part, _, rest = name.partition("/")
            parts.get(part, {})[rest] = array
        moments = {f"{m}/{k}": v for k, v in like.items() for m in _MOMENTS} if step else {}
        for part, wanted in (("weights", like), ("best", like), ("moments", moments)):
            if _kinds(parts[part]) != _kinds(wanted):
                raise UserError(str(path), part, f"is of another network, {expected}")
            # the order of the weights is that in which their gradients are added up
            parts[part] = {name: parts[part][name] for name in wanted}
        return cls(step, parts["weights"], parts["moments"], parts["best"], error, misses)


def _kinds(arrays: Mapping[str, np.ndarray]) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    return {name: (array.shape, array.dtype) for name, array in arrays.items()}


def _metadata(path: Path) -> dict[str, str]:
    from safetensors import safe_open

    with safe_open(path, framework="numpy") as file:
        return dict(file.metadata() or {})
