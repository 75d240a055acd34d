"""Gauss–Newton fits of effects' parameters to whitened residuals, with their uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.discrepancy.candidates import bounded, shifted
from drake_dress.discrepancy.experiment import Experiment, Level, level_of
from drake_dress.discrepancy.regression import (
    Extrapolation,
    Solution,
    misleading,
    solve_pooled,
)
from drake_dress.discrepancy.whitening import NUMERICS_SHARE, Whitening
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray
from drake_dress.models.effects.effect import Effect, Parameter

# Level of each recording, effects.
_Job = tuple[tuple[Level, ...], Sequence[Effect]]

# Step of finite differences and largest step of an iteration, in typical sizes.
_DIFFERENCE, _TRUST = 0.25, 4.0
# Growth of a recording's loss above which its coarse simulation counts as diverged: coarse cloth
# may fold differently.
_ASTRAY = 1.2
# A block of a voice that keeps more than this multiple of the noise's variance is weighted down in
# proportion: cloth that snaps a moment too early carries no information on parameters. Number of
# reweightings.
_PLAUSIBLE, _REWEIGHTED = 2.0, 3
# A step shorter than this, in typical sizes, does not update the slopes.
_TELLING = 0.03


@dataclass(frozen=True)
class Evidence:
    """Data and numerical error that fits are based on.

    Attributes:
        whitening: whitening, with the data.
        extrapolation: extrapolation of the refined simulation to zero time step.
        numerics: (N,) change by refinement of the scenario's simulation, without the part that
            `extrapolation` explains.
    """

    whitening: Whitening
    extrapolation: Extrapolation
    numerics: FloatArray

    @classmethod
    def of(
        cls, whitening: Whitening, extrapolation: Extrapolation, numerics: FloatArray
    ) -> Evidence:
        """Returns the evidence for the full change by refinement, `numerics` (N,)."""
        every = np.ones(len(numerics), dtype=np.bool_)
        return cls(whitening, extrapolation, extrapolation.without(numerics, every))


@dataclass(frozen=True)
class Fit:
    """Effects fitted jointly; steps are in units of the parameters' typical sizes.

    Attributes:
        effects: effects with parameters fitted to all data.
        std: standard deviation of each parameter, by name of effect and parameter. It includes
            random error, robust to correlation within blocks, and numerical error.
        told: (N,) whitened prediction of the simulation with `effects`, linear in the last step.
        change: (N,) its change with parameters fitted to the blocks that an entry does not belong
            to.
        slopes: (N,k) derivatives of `told` by the parameters.
        step: (k,) step that led to these parameters.
    """

    effects: tuple[Effect, ...]
    std: dict[str, dict[str, float]]
    told: FloatArray
    change: FloatArray
    slopes: FloatArray
    step: FloatArray


def fit_all(
    experiment: Experiment,
    evidence: Evidence,
    reference: FloatArray,
    start: Sequence[Sequence[Effect]],
    about: Sequence[Effect] = (),
    iterations: int = 3,
    progress: Callable[[], None] | None = None,
) -> list[Fit]:
    """Returns a fit for each set of effects in `start`; their simulations run in parallel.

    Simulations run at the coarsest level that resolves the effects. Cloth this coarse may fold
    differently from the measured cloth. If a fit makes a recording much worse, that recording is
    simulated at the scenario's level from then on.

    Args:
        experiment: the recordings and their simulations.
        evidence: data and numerical error.
        reference: (N,) whitened prediction of the refined simulation with the effects `about`.
        start: sets of effects with initial parameters.
        about: effects that `reference` includes.
        iterations: number of Gauss–Newton steps.
        progress: called after each replay.
    """
    recordings = len(experiment.recordings)
    sets = [tuple(effects) for effects in start]
    levels: list[tuple[Level, ...]] = [(level_of(*effects),) * recordings for effects in sets]

    def changes(jobs: Sequence[_Job]) -> list[FloatArray]:
        bases = list(dict.fromkeys(level for level, _ in jobs))
        told = experiment.tell([*jobs, *((level, tuple(about)) for level in bases)], progress)
        vectors = [evidence.whitening.vector(t) for t in told]
        zero = dict(zip(bases, vectors[len(jobs) :], strict=True))
        return [v - zero[level] for v, (level, _) in zip(vectors, jobs, strict=False)]

    fits: list[Fit] = []
    for _ in range(iterations):
        here = changes(list(zip(levels, sets, strict=True)))
        raised = [
            _raised(level, _astray(evidence, reference, reference + change))
            for level, change in zip(levels, here, strict=True)
        ]
        if raised != levels:
            levels = raised
            here = changes(list(zip(levels, sets, strict=True)))
        jobs = [
            (level, moved)
            for level, effects in zip(levels, sets, strict=True)
            for moved, _ in _moved(effects)
        ]
        moved_on = iter(changes(jobs))
        fits = []
        for effects, change in zip(sets, here, strict=True):
            slopes = [(next(moved_on) - change) / step for _, step in _moved(effects)]
            fits.append(_stepped(evidence, effects, reference + change, np.stack(slopes, axis=1)))
        sets = [f.effects for f in fits]
    return fits


def with_slopes(
    experiment: Experiment,
    whitening: Whitening,
    fit: Fit,
    told: FloatArray,
    progress: Callable[[], None] | None = None,
) -> Fit:
    """Returns a fit at the same effects, with slopes from the refined simulation and a zero step.

    Args:
        experiment: the recordings and their simulations.
        whitening: whitening of the data.
        fit: fit whose effects are used.
        told: (N,) whitened prediction of the refined simulation with them.
        progress: called after each replay.
    """
    # central differences: a snap between any two of the three points enters them in the same way
    both = (_moved(fit.effects), _moved(fit.effects, -_DIFFERENCE))
    jobs: list[tuple[Level, Sequence[Effect]]] = [
        ("refined", effects) for side in both for effects, _ in side
    ]
    vectors = [whitening.vector(t) for t in experiment.tell(jobs, progress)]
    count = len(both[0])
    slopes = []
    for k, ((_, ahead), (_, behind)) in enumerate(zip(*both, strict=True)):
        # at a bound both shifts are to the same side: a one-sided difference
        low, at = (told, 0.0) if ahead == behind else (vectors[count + k], behind)
        slopes.append((vectors[k] - low) / (ahead - at))
    nothing = np.zeros_like(told)
    return Fit(fit.effects, fit.std, told, nothing, np.stack(slopes, axis=1), np.zeros(count))


def fit_again(evidence: Evidence, fit: Fit, told: FloatArray) -> Fit:
    """Returns a fit one step further, from a better simulation's prediction and the same slopes.

    Args:
        evidence: data and numerical error.
        fit: fit to continue from.
        told: (N,) whitened prediction of the better simulation with the fit's effects.
    """
    return _stepped(evidence, fit.effects, told, fit.slopes)


def bettered(fit: Fit, change: FloatArray) -> Fit:
    """Returns a fit whose slopes agree with the change by its last step (Broyden 1965).

    Args:
        fit: fit after its step.
        change: (N,) change of the better simulation's whitened prediction by that step.
    """
    length2 = float(fit.step @ fit.step)
    if length2 < _TELLING**2:
        return fit
    off = change - fit.slopes @ fit.step
    return replace(fit, slopes=fit.slopes + np.outer(off, fit.step / length2))


def _astray(evidence: Evidence, before: FloatArray, after: FloatArray) -> list[bool]:
    """Returns for each recording whether prediction `after` (N,) is much worse than `before`."""
    w = evidence.whitening
    every = np.ones(len(w.data), dtype=np.bool_)
    first, last = (
        np.bincount(w.recording, evidence.extrapolation.without(w.data - told, every) ** 2)
        for told in (before, after)
    )
    return list(last > _ASTRAY * first)


def _raised(levels: Sequence[Level], astray: Sequence[bool]) -> tuple[Level, ...]:
    """Returns the levels of recordings, with the scenario's level where one diverged."""
    return tuple("scenario" if far else level for level, far in zip(levels, astray, strict=True))


def _parameters(effects: Sequence[Effect]) -> list[tuple[int, Parameter]]:
    """Returns the parameters of effects, each with the index of its effect."""
    return [(k, p) for k, e in enumerate(effects) for p in e.parameters()]


def _moved(
    effects: Sequence[Effect], by: float = _DIFFERENCE
) -> list[tuple[tuple[Effect, ...], float]]:
    """Returns, for each parameter, the effects with it shifted, and the shift in typical sizes."""
    found = []
    for k, p in _parameters(effects):
        changed = list(effects)
        changed[k] = shifted(effects[k], p.name, by * p.typical)
        step = (getattr(changed[k], p.name) - getattr(effects[k], p.name)) / p.typical
        found.append((tuple(changed), step))
    return found


def _stepped(
    evidence: Evidence, effects: Sequence[Effect], told: FloatArray, slopes: FloatArray
) -> Fit:
    """Returns the fit one Gauss–Newton step from effects whose whitened prediction is `told` (N,).

    The change by refinement would move the parameters, too; a share of that shift is part of their
    uncertainty. Blocks with large residuals are weighted down (iteratively reweighted least
    squares).
    """
    w, free = evidence.whitening, _parameters(effects)
    now = np.array([getattr(effects[k], p.name) for k, p in free])
    size = np.array([p.typical for _, p in free])
    low = np.maximum((np.array([p.low for _, p in free]) - now) / size, -_TRUST)
    high = np.minimum((np.array([p.high for _, p in free]) - now) / size, _TRUST)
    residual = w.data - told

    def solved(rows: BoolArray) -> tuple[Solution, FloatArray, FloatArray, FloatArray]:
        reduced, left = (evidence.extrapolation.without(v, rows) for v in (slopes, residual))
        after, trust = left, np.ones_like(left)
        for _ in range(_REWEIGHTED):
            trust = _trust(w, after, rows)
            found = solve_pooled(
                trust[rows, None] * slopes[rows],
                trust[rows, None] * reduced[rows],
                trust[rows] * left[rows],
                w.voice[rows],
                low,
                high,
            )
            after = left - reduced @ found.x
        return found, trust[:, None] * reduced, trust * after, trust

    every = np.ones(len(residual), dtype=np.bool_)
    best, reduced, after, trust = solved(every)
    change = np.zeros_like(residual)
    for rows in w.trained_on:
        change[~rows] = slopes[~rows] @ (solved(rows)[0].x - best.x)
    drawn = _robust_std(reduced, after, w.block)
    biased = NUMERICS_SHARE * misleading(
        trust[:, None] * slopes, reduced, trust * evidence.numerics, w.voice
    )
    values = iter(now + best.x * size)
    spread = iter(size * np.hypot(np.maximum(drawn, best.std), biased))
    return Fit(
        tuple(bounded(type(e), {p.name: next(values) for p in e.parameters()}) for e in effects),
        {e.NAME: {p.name: float(next(spread)) for p in e.parameters()} for e in effects},
        told + slopes @ best.x,
        change,
        slopes,
        best.x,
    )


def _trust(w: Whitening, residual: FloatArray, rows: BoolArray) -> FloatArray:
    """Returns (N,) the square root of the weight of each entry's block and kind of signal."""
    part = 2 * w.block + w.is_force
    count = np.maximum(np.bincount(part[rows], minlength=part.max() + 1), 1)
    size = np.bincount(part[rows], residual[rows] ** 2, part.max() + 1) / count
    root: FloatArray = np.sqrt(np.minimum(1.0, _PLAUSIBLE / np.maximum(size, _PLAUSIBLE)))[part]
    return root


def _robust_std(columns: FloatArray, residual: FloatArray, block: IndexArray) -> FloatArray:
    """Returns (k,) standard deviations for residuals that are correlated within a block.

    The sandwich estimator (JᵀJ)⁻¹ Σ_b (J_bᵀ r_b)(J_bᵀ r_b)ᵀ (JᵀJ)⁻¹ of clustered least squares.
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
