"""Screens which effects may be what a simulation lacks.

Every other block of time trains, the others judge, and the other way round. A candidate's gain is
the share of the squared whitened residual that it takes away where it was judged.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.candidates import Candidate, candidates
from drake_dress.discrepancy.experiment import Experiment, Level, Told, level_of
from drake_dress.discrepancy.regression import Extrapolation, solve_bounded
from drake_dress.discrepancy.whitening import Whitening, whiten
from drake_dress.models.effects.effect import Effect

FloatArray = npt.NDArray[np.float64]

# Fits that are tried after screening, and the least share of the best one's gain they must promise.
_SHORTLIST, _PROMISING = 4, 0.3


@dataclass(frozen=True)
class Screened:
    """What linear screening says of one candidate.

    Attributes:
        candidate: which.
        start: the effect with the coefficients found.
        gain: share of the held-out loss taken away.
    """

    candidate: Candidate
    start: Effect
    gain: float


@dataclass(frozen=True)
class Comparison:
    """Simulations of all levels without further effects.

    Attributes:
        whitening: of the data.
        told: what each level says of each recording.
        vector: (N,) of it, whitened.
        extrapolation: of the refined one.
    """

    whitening: Whitening
    told: dict[Level, list[Told]]
    vector: dict[Level, FloatArray]
    extrapolation: Extrapolation


def block_loss(whitening: Whitening, predicted: FloatArray) -> FloatArray:
    """Returns (B,) the summed squared whitened residual of each block."""
    residual = whitening.data - predicted
    loss: FloatArray = np.bincount(whitening.block, residual * residual).astype(np.float64)
    return loss


def screen(
    comparison: Comparison,
    columns: Sequence[tuple[Candidate, FloatArray]],
    predicted: FloatArray,
) -> list[Screened]:
    """Returns all candidates by their linear gain over `predicted` (N,), best first."""
    w, free = comparison.whitening, comparison.extrapolation
    residual = w.data - predicted
    folds = w.trained_on
    left = [free.without(residual, train) for train in folds]
    before = sum(float(r[~train] @ r[~train]) for r, train in zip(left, folds, strict=True))
    found = []
    for candidate, matrix in columns:
        if not matrix.any():
            continue
        low = np.array([p.low for p in candidate.probes])
        high = np.full(len(low), np.inf)
        after, x = 0.0, np.zeros(len(low))
        for r, train in zip(left, folds, strict=True):
            reduced = free.without(matrix, train)
            half = solve_bounded(matrix[train], reduced[train], r[train], low, high)
            x += 0.5 * half
            r = r[~train] - reduced[~train] @ half
            after += float(r @ r)
        found.append(Screened(candidate, candidate.effect(x), 1.0 - after / before))
    return sorted(found, key=lambda s: -s.gain)


def probe(
    experiment: Experiment,
    comparison: Comparison,
    progress: Callable[[], None] | None = None,
) -> list[tuple[Candidate, FloatArray]]:
    """Returns the columns (N,k) of every candidate, each at the level that tells it."""
    lab = experiment.labs["screening"]
    found = candidates(lab.garment.rest_position, lab.effects)
    jobs: list[tuple[Level, Sequence[Effect]]] = [
        (level_of(p.effect), (p.effect,)) for c in found for p in c.probes
    ]
    w = comparison.whitening
    columns = iter(
        w.vector(told) - comparison.vector[level]
        for (level, _), told in zip(jobs, experiment.tell(jobs, progress), strict=True)
    )
    return [(c, np.stack([next(columns) for _ in c.probes], 1)) for c in found]


def compare(experiment: Experiment, progress: Callable[[], None] | None = None) -> Comparison:
    """Returns the data against the simulation at all levels."""
    order: list[Level] = ["refined", "doubled", "scenario", "screening"]
    told = dict(
        zip(order, experiment.tell([(level, ()) for level in order], progress), strict=True)
    )
    w = whiten(experiment.recordings, experiment.samples, told["scenario"], told["refined"])
    vector = {level: w.vector(t) for level, t in told.items()}
    halving = vector["refined"] - vector["doubled"]
    return Comparison(w, told, vector, Extrapolation(halving, w.voice))


def best_of_each(screened: Sequence[Screened]) -> list[Screened]:
    """Returns the best candidate of each effect, best first."""
    seen: dict[str, Screened] = {}
    for s in screened:
        seen.setdefault(s.candidate.name, s)
    return list(seen.values())


def shortlist(screened: Sequence[Screened]) -> list[Screened]:
    """Returns those worth a fit."""
    ranked = best_of_each(screened)
    if not ranked or ranked[0].gain <= 0.0:
        return []
    least = _PROMISING * ranked[0].gain
    return [s for s in ranked if s.gain >= least][:_SHORTLIST]
