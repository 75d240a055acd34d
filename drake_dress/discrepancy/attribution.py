"""Screens which effects a simulation may lack.

Screening trains on every other block of time and judges on the rest, and the other way round. A
candidate's gain is the share of the squared whitened residual that it removes where it is judged.
In some recordings coarse cloth folds differently from the measured cloth as soon as an effect acts
on it. So recordings that a candidate makes worse do not count against it here, and its coefficients
are also computed with equal weights of all recordings and signals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.discrepancy.candidates import Candidate, candidates
from drake_dress.discrepancy.experiment import Experiment, Level, Told, level_of
from drake_dress.discrepancy.regression import Extrapolation, solve_bounded, solve_pooled
from drake_dress.discrepancy.whitening import Whitening, whiten
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.effects.effect import Effect

# Most candidates that are fitted after screening, and their least gain relative to the best one's.
_SHORTLIST, _PROMISING = 4, 0.3


@dataclass(frozen=True)
class Screened:
    """Result of linear screening for one candidate.

    Attributes:
        candidate: the candidate.
        start: the effect with the coefficients found.
        gain: share of the held-out loss that it removes, in the recordings that it improves.
    """

    candidate: Candidate
    start: Effect
    gain: float


@dataclass(frozen=True)
class Comparison:
    """Simulations at all levels without further effects.

    Attributes:
        whitening: whitening of the data.
        told: predictions of each level for each recording.
        vector: (N,) these predictions by level, whitened.
        extrapolation: extrapolation of the refined simulation to zero time step.
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
    recordings = int(w.recording.max()) + 1

    def lost(residual: FloatArray, rows: BoolArray) -> FloatArray:
        each: FloatArray = np.bincount(w.recording[rows], residual**2, recordings).astype(float)
        return each

    before = np.add(*(lost(r[~train], ~train) for r, train in zip(left, folds, strict=True)))
    found = []
    for candidate, matrix in columns:
        if not matrix.any():
            continue
        low = np.array([p.low for p in candidate.probes])
        high = np.full(len(low), np.inf)
        reduced = [free.without(matrix, train) for train in folds]
        for pooled in (False, True):
            after, x = np.zeros(recordings), np.zeros(len(low))
            for r, own, train in zip(left, reduced, folds, strict=True):
                known = (matrix[train], own[train], r[train])
                half = (
                    solve_pooled(*known, w.voice[train], low, high).x
                    if pooled
                    else solve_bounded(*known, low, high)
                )
                x += 0.5 * half
                after += lost(r[~train] - own[~train] @ half, ~train)
            gain = float(np.maximum(before - after, 0.0).sum() / before.sum())
            found.append(Screened(candidate, candidate.effect(x), gain))
    return sorted(found, key=lambda s: -s.gain)


def probe(
    experiment: Experiment,
    comparison: Comparison,
    progress: Callable[[], None] | None = None,
) -> list[tuple[Candidate, FloatArray]]:
    """Returns the columns (N,k) of every candidate, from the coarsest level that resolves it."""
    lab = experiment.labs["screening"]
    found = candidates(lab.garment.rest_position, lab.effects, experiment.among)
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
    """Returns the comparison of the data with simulations at all levels."""
    order: list[Level] = ["refined", "doubled", "scenario", "screening"]
    told = dict(
        zip(order, experiment.tell([(level, ()) for level in order], progress), strict=True)
    )
    return _compared(experiment, told, told["scenario"], told["refined"])


def compare_with(
    experiment: Experiment,
    comparison: Comparison,
    scenario: Sequence[Told],
    refined: Sequence[Told],
) -> Comparison:
    """Returns a comparison of the same simulations, whitened by the numerical error of others.

    Args:
        experiment: the recordings.
        comparison: simulations at all levels.
        scenario: predictions of the scenario's simulation with some effects.
        refined: predictions of the refined simulation with the same effects.
    """
    return _compared(experiment, comparison.told, scenario, refined)


def _compared(
    experiment: Experiment,
    told: dict[Level, list[Told]],
    scenario: Sequence[Told],
    refined: Sequence[Told],
) -> Comparison:
    w = whiten(experiment.recordings, experiment.samples, scenario, refined)
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
    """Returns the candidates that are worth a fit, at most one for each effect."""
    ranked = best_of_each(screened)
    if not ranked or ranked[0].gain <= 0.0:
        return []
    least = _PROMISING * ranked[0].gain
    return [s for s in ranked if s.gain >= least][:_SHORTLIST]
