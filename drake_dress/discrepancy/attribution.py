"""Names what a simulation lacks: screens all effects, fits the likely ones, adds them one by one.

Half of the blocks of time train, the others judge. A candidate's gain is the share of the squared
whitened residual on held-out blocks that it takes away, beyond what noise leaves (1 a sample).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.candidates import NEED_CONTACT, Candidate, candidates
from drake_dress.discrepancy.experiment import Experiment, Level, Told
from drake_dress.discrepancy.fitting import Fit, fit_all, solve_bounded
from drake_dress.discrepancy.whitening import Whitening, whiten
from drake_dress.models.effects.effect import Effect

FloatArray = npt.NDArray[np.float64]
Report = Callable[[str, int], None]

# Fits that are tried after screening, and the least share of the best one's gain they must promise.
_SHORTLIST, _PROMISING = 4, 0.4


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
    """

    whitening: Whitening
    told: dict[Level, list[Told]]


def block_loss(whitening: Whitening, predicted: FloatArray) -> FloatArray:
    """Returns (B,) the summed squared whitened residual of each block."""
    residual = whitening.data - predicted
    loss: FloatArray = np.bincount(whitening.block, residual * residual).astype(np.float64)
    return loss


def held_out(whitening: Whitening) -> npt.NDArray[np.bool_]:
    """Returns (B,) which blocks judge: every other one."""
    odd: npt.NDArray[np.bool_] = np.arange(int(whitening.block.max()) + 1) % 2 == 1
    return odd


def screen(
    comparison: Comparison,
    columns: Sequence[tuple[Candidate, FloatArray]],
    predicted: FloatArray,
) -> list[Screened]:
    """Returns all candidates by their linear gain over `predicted` (N,), best first."""
    w = comparison.whitening
    residual = w.data - predicted
    before = np.bincount(w.block, residual * residual)
    fold = w.block % 2
    found = []
    for candidate, matrix in columns:
        if not matrix.any():
            continue
        low = np.array([p.low for p in candidate.probes])
        high = np.full(len(low), np.inf)
        after = residual.copy()
        for k in (0, 1):
            train = fold != k
            x = solve_bounded(matrix[train], residual[train], low, high)
            after[~train] -= matrix[~train] @ x
        saved = before - np.bincount(w.block, after * after)
        x = solve_bounded(matrix, residual, low, high)
        found.append(
            Screened(
                candidate,
                candidate.effect(x),
                float(saved.sum() / before.sum()),
            )
        )
    return sorted(found, key=lambda s: -s.gain)


def probe(
    experiment: Experiment,
    comparison: Comparison,
    about: Sequence[Effect] = (),
    progress: Callable[[], None] | None = None,
) -> list[tuple[Candidate, FloatArray]]:
    """Returns the columns (N,k) of every candidate, at the screening level."""
    lab = experiment.labs["screening"]
    base = comparison.told["screening"]
    touched = [bool(t.contact.any()) for t in base]
    found = candidates(lab.garment.rest_position, [*lab.effects, *about])
    jobs = []
    for c in found:
        for p in c.probes:
            skipped = c.name in NEED_CONTACT
            jobs.append((p.effect, [i for i in range(len(base)) if touched[i] or not skipped]))
    told = experiment.tell_some(
        [("screening", (*about, effect), which) for effect, which in jobs], base, progress
    )
    zero = comparison.whitening.vector(base)
    vectors = iter(told)
    return [
        (c, np.stack([comparison.whitening.vector(next(vectors)) - zero for _ in c.probes], 1))
        for c in found
    ]


def compare(experiment: Experiment, progress: Callable[[], None] | None = None) -> Comparison:
    """Returns the data against the simulation at all levels."""
    order: list[Level] = ["refined", "scenario", "screening"]
    told = dict(
        zip(order, experiment.tell([(level, ()) for level in order], progress), strict=True)
    )
    return Comparison(
        whiten(experiment.recordings, experiment.samples, told["scenario"], told["refined"]), told
    )


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


def fitted(
    experiment: Experiment,
    comparison: Comparison,
    reference: FloatArray,
    about: Sequence[Effect],
    chosen: Sequence[Screened],
    progress: Callable[[], None] | None = None,
) -> list[Fit]:
    """Returns a fit of each chosen candidate beside the effects `about`."""
    w = comparison.whitening
    training = ~held_out(w)[w.block]
    starts = [[*about, s.start] for s in chosen]
    return fit_all(experiment, w, reference, starts, training, about=about, progress=progress)
