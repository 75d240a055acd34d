"""Gauss–Newton fits of effects' parameters on whitened residuals, and how sure they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import lsq_linear

from drake_dress.discrepancy.candidates import bounded, shifted
from drake_dress.discrepancy.experiment import Experiment, Level
from drake_dress.discrepancy.whitening import NUMERICS_SHARE, Whitening
from drake_dress.models.effects.effect import Effect, Parameter

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

# Step of derivatives and largest step of an iteration, in sizes that matter.
_DIFFERENCE, _TRUST = 0.25, 4.0
_RIDGE = 1e-6
_ANY = 1e6


@dataclass(frozen=True)
class Fit:
    """Effects fitted jointly.

    Attributes:
        effects: with parameters from all the data.
        std: of each parameter, by effect's name and parameter: of what is random, robust to what
            the blocks share, and of what the numerics leave open.
        predicted: (N,) whitened, with parameters from the training blocks.
        predicted_all: (N,) with those of `effects`.
        count: of parameters.
    """

    effects: tuple[Effect, ...]
    std: dict[str, dict[str, float]]
    predicted: FloatArray
    predicted_all: FloatArray
    count: int


def solve_bounded(
    columns: FloatArray, residual: FloatArray, low: FloatArray | float, high: FloatArray | float
) -> FloatArray:
    """Returns x (k,) with least ‖columns x − residual‖ between the bounds; columns (N,k)."""
    normal = columns.T @ columns
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    normal = normal / np.outer(scale, scale) + _RIDGE * np.eye(len(scale))
    factor = np.linalg.cholesky(normal)
    right = np.linalg.solve(factor, columns.T @ residual / scale)
    low, high = low * scale, np.maximum(high * scale, low * scale + 1e-12)
    found: FloatArray = lsq_linear(factor.T, right, (low, high)).x / scale
    return found


def fit_all(
    experiment: Experiment,
    whitening: Whitening,
    reference: FloatArray,
    start: Sequence[Sequence[Effect]],
    training: BoolArray,
    level: Level = "screening",
    about: Sequence[Effect] = (),
    iterations: int = 3,
    progress: Callable[[], None] | None = None,
) -> list[Fit]:
    """Returns a fit for each set of effects in `start`; all run side by side.

    Args:
        experiment: with its recordings.
        whitening: of them.
        reference: (N,) whitened, what the refined simulation says with the effects `about`.
        start: sets of effects with parameters to start from.
        training: (N,) entries that are fitted; the others are held out.
        level: at which simulations are run.
        about: effects that `reference` holds.
        iterations: of Gauss–Newton.
        progress: called after each replay.
    """
    problems = [_Problem(list(effects)) for effects in start]
    base = whitening.vector(experiment.tell([(level, tuple(about))], progress)[0])
    for _ in range(iterations):
        jobs: list[tuple[Level, Sequence[Effect]]] = []
        for p in problems:
            jobs.append((level, tuple(p.effects)))
            jobs += [(level, tuple(p.moved(i))) for i in range(len(p.free))]
        told = iter(experiment.tell(jobs, progress))
        for p in problems:
            here = whitening.vector(next(told))
            columns = [whitening.vector(next(told)) - here for _ in p.free]
            p.improve(
                reference + here - base,
                np.stack(columns, axis=1),
                reference - base,
                whitening,
                training,
            )
    return [p.fit() for p in problems]


class _Problem:
    """One set of effects on its way to the best parameters; lengths in sizes that matter."""

    def __init__(self, effects: list[Effect]) -> None:
        self.effects = effects
        self.free: list[tuple[int, Parameter]] = [
            (k, p) for k, e in enumerate(effects) for p in e.parameters()
        ]
        self._size = np.array([p.typical for _, p in self.free])
        self._low = np.array([p.low for _, p in self.free])
        self._high = np.array([p.high for _, p in self.free])

    @property
    def _values(self) -> FloatArray:
        return np.array([getattr(self.effects[k], p.name) for k, p in self.free])

    def moved(self, index: int) -> list[Effect]:
        """Returns the effects with one parameter a little further."""
        k, p = self.free[index]
        changed = list(self.effects)
        changed[k] = shifted(self.effects[k], p.name, _DIFFERENCE * p.typical)
        return changed

    def improve(
        self,
        predicted: FloatArray,
        change: FloatArray,
        numerics: FloatArray,
        whitening: Whitening,
        training: BoolArray,
    ) -> None:
        """Takes one step from what is predicted (N,) and its changes (N,k) by `moved`.

        What finer numerics change, `numerics` (N,), moves the parameters too: a share of that is
        part of their uncertainty.
        """
        now = self._values
        step = np.array(
            [getattr(self.moved(i)[k], p.name) - now[i] for i, (k, p) in enumerate(self.free)]
        )
        columns = change * (self._size / step)
        residual = whitening.data - predicted
        low = np.maximum((self._low - now) / self._size, -_TRUST)
        high = np.minimum((self._high - now) / self._size, _TRUST)
        trained = solve_bounded(columns[training], residual[training], low, high)
        best = solve_bounded(columns, residual, low, high)
        self._predicted = predicted + columns @ trained
        self._predicted_all = predicted + columns @ best
        drawn = _robust_std(columns, residual - columns @ best, whitening.block)
        biased = NUMERICS_SHARE * np.abs(solve_bounded(columns, numerics, -_ANY, _ANY))
        self._std = self._size * np.hypot(drawn, biased)
        values = now + best * self._size
        for k, effect in enumerate(self.effects):
            mine = {p.name: v for (j, p), v in zip(self.free, values, strict=True) if j == k}
            self.effects[k] = bounded(type(effect), mine)

    def fit(self) -> Fit:
        """Returns what was found."""
        std: dict[str, dict[str, float]] = {}
        for (k, p), s in zip(self.free, self._std, strict=True):
            std.setdefault(self.effects[k].NAME, {})[p.name] = float(s)
        return Fit(tuple(self.effects), std, self._predicted, self._predicted_all, len(self.free))


def _robust_std(
    columns: FloatArray, residual: FloatArray, block: npt.NDArray[np.int64]
) -> FloatArray:
    """Returns (k,) standard deviations when residuals within a block hang together.

    The sandwich (JᵀJ)⁻¹ Σ_b (J_bᵀ r_b)(J_bᵀ r_b)ᵀ (JᵀJ)⁻¹ of clustered least squares.
    """
    normal = columns.T @ columns
    inverse = np.linalg.pinv(normal + 1e-9 * np.trace(normal) * np.eye(len(normal)))
    count = int(block.max()) + 1
    score = np.stack(
        [np.bincount(block, columns[:, i] * residual, count) for i in range(columns.shape[1])], 1
    )
    covariance = inverse @ (score.T @ score) @ inverse
    deviation: FloatArray = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return deviation
