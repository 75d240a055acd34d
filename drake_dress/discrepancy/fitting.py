"""Gauss–Newton fits of effects' parameters on whitened residuals, and how sure they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.candidates import bounded, shifted
from drake_dress.discrepancy.experiment import Experiment, Level, level_of
from drake_dress.discrepancy.regression import (
    Extrapolation,
    Solution,
    misleading,
    solve_pooled,
)
from drake_dress.discrepancy.whitening import NUMERICS_SHARE, Whitening
from drake_dress.models.effects.effect import Effect, Parameter

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

# Step of derivatives and largest step of an iteration, in sizes that matter.
_DIFFERENCE, _TRUST = 0.25, 4.0


@dataclass(frozen=True)
class Fit:
    """Effects fitted jointly.

    Attributes:
        effects: with parameters from all the data.
        std: of each parameter, by effect's name and parameter: of what is random, robust to what
            the blocks share, and of what the numerics leave open.
        told: (N,) whitened, what the simulation is taken to say with `effects`.
        change: (N,) of that with parameters from the training blocks alone.
    """

    effects: tuple[Effect, ...]
    std: dict[str, dict[str, float]]
    told: FloatArray
    change: FloatArray


def fit_all(
    experiment: Experiment,
    whitening: Whitening,
    extrapolation: Extrapolation,
    reference: FloatArray,
    start: Sequence[Sequence[Effect]],
    training: BoolArray,
    level: Level | None = None,
    about: Sequence[Effect] = (),
    iterations: int = 3,
    progress: Callable[[], None] | None = None,
) -> list[Fit]:
    """Returns a fit for each set of effects in `start`; all run side by side.

    Args:
        experiment: with its recordings.
        whitening: of them.
        extrapolation: of the refined simulation.
        reference: (N,) whitened, what the refined simulation says with the effects `about`.
        start: sets of effects with parameters to start from.
        training: (N,) entries that are fitted; the others are held out.
        level: at which simulations are run; by default the coarsest that tells the effects.
        about: effects that `reference` holds.
        iterations: of Gauss–Newton.
        progress: called after each replay.
    """
    problems = [_Problem(list(effects), level or level_of(*effects)) for effects in start]
    told = experiment.tell([(p.level, tuple(about)) for p in problems], progress)
    base = [whitening.vector(t) for t in told]
    for _ in range(iterations):
        jobs: list[tuple[Level, Sequence[Effect]]] = []
        for p in problems:
            jobs.append((p.level, tuple(p.effects)))
            jobs += [(p.level, tuple(p.moved(i))) for i in range(len(p.free))]
        vectors = iter([whitening.vector(t) for t in experiment.tell(jobs, progress)])
        for p, zero in zip(problems, base, strict=True):
            here = next(vectors)
            columns = [next(vectors) - here for _ in p.free]
            p.improve(
                reference + here - zero,
                np.stack(columns, axis=1),
                reference - zero,
                whitening,
                extrapolation,
                training,
            )
    return [p.fit() for p in problems]


class _Problem:
    """One set of effects on its way to the best parameters; lengths in sizes that matter."""

    def __init__(self, effects: list[Effect], level: Level) -> None:
        self.effects, self.level = effects, level
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
        extrapolation: Extrapolation,
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
        low = np.maximum((self._low - now) / self._size, -_TRUST)
        high = np.minimum((self._high - now) / self._size, _TRUST)
        every = np.ones_like(training)
        residual = whitening.data - predicted

        def solved(rows: BoolArray) -> tuple[Solution, FloatArray, FloatArray]:
            reduced, left = (extrapolation.without(v, rows) for v in (columns, residual))
            found = solve_pooled(
                columns[rows], reduced[rows], left[rows], whitening.voice[rows], low, high
            )
            return found, reduced, left

        trained = solved(training)[0].x
        best, reduced, left = solved(every)
        self._told = predicted + columns @ best.x
        self._change = columns @ (trained - best.x)
        drawn = _robust_std(reduced, left - reduced @ best.x, whitening.block)
        finer = extrapolation.without(numerics, every)
        biased = NUMERICS_SHARE * misleading(columns, reduced, finer, whitening.voice)
        self._std = self._size * np.hypot(np.maximum(drawn, best.std), biased)
        values = now + best.x * self._size
        for k, effect in enumerate(self.effects):
            mine = {p.name: v for (j, p), v in zip(self.free, values, strict=True) if j == k}
            self.effects[k] = bounded(type(effect), mine)

    def fit(self) -> Fit:
        """Returns what was found."""
        std: dict[str, dict[str, float]] = {}
        for (k, p), s in zip(self.free, self._std, strict=True):
            std.setdefault(self.effects[k].NAME, {})[p.name] = float(s)
        return Fit(tuple(self.effects), std, self._told, self._change)


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
