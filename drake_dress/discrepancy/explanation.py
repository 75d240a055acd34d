"""From recordings to a verdict: what the simulation gets wrong, why, and by how much it is mended.

The story: hold the simulation against the data at three levels of numerics; ask first whether finer
numerics explain what is wrong; screen all effects, fit the likely ones, keep the one that explains
most of what was held out; look for another in what is left, until nothing more stands out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.attribution import (
    Comparison,
    best_of_each,
    block_loss,
    compare,
    fitted,
    held_out,
    probe,
    screen,
    shortlist,
)
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.fitting import Fit, fit_all
from drake_dress.models.effects.effect import Effect

FloatArray = npt.NDArray[np.float64]

DISCRETISATION = "discretisation"
# Least share of the held-out loss that a cause takes away; what numerics can feign stays below.
LEAST_GAIN = 0.03
# Numerics are named where they are off by so many times the markers' noise, and refining them takes
# away at least this share of the squared residual beyond noise.
_COARSE, _MENDED = 2.5, 0.5
# Two causes are not told apart where the first is the better one in less than this share of the
# resamples of blocks.
_SURE = 0.9
# A second candidate is refined too where it takes away this share of what the best does, unless the
# best is the better one in this share of the resamples.
_NEAR, _CERTAIN = 0.3, 0.99
# Refinements of a fit at most; it is settled where a step is within its uncertainty, or this share.
_POLISHED, _STEADY = 3, 0.04
# A residual is unexplained where so many times the noise's variance is left, and less than this
# share of what exceeds noise has been explained.
_LEFT, _EXPLAINED = 1.12, 0.7
_MOST_CAUSES = 3
_RESAMPLES = 1000


@dataclass(frozen=True)
class Cause:
    """One cause with its parameters.

    Attributes:
        name: of the effect.
        effect: with its values; None for discretisation.
        std: of its parameters.
        gain: share of the held-out loss that it takes away.
        confidence: that it is this one.
    """

    name: str
    effect: Effect | None
    std: dict[str, float]
    gain: float
    confidence: float


@dataclass(frozen=True)
class Score:
    """How one effect did.

    Attributes:
        name: of the effect.
        screened: linear gain.
        fitted: gain after a fit; None where it was not worth one.
        effect: as fitted or as screened.
    """

    name: str
    screened: float
    fitted: float | None
    effect: Effect | None


@dataclass
class Explanation:
    """What was found.

    Attributes:
        verdict: nothing, named, ambiguous or unexplained.
        causes: in the order found.
        scores: of every effect tried, best first, in the first round.
        loss: mean squared whitened residual on held-out blocks: scenario, refined, extended.
        gain: 1 − (after − 1) / (before − 1) of it, and its 90 % interval.
        before, after: RMS of the residual on held-out blocks, m and N; noise likewise.
        numerics: RMS difference of scenario and refined simulation, m.
        comparison: all levels without further effects.
        predicted: (N,) whitened, with all causes, fitted on the training blocks.
    """

    verdict: str
    causes: list[Cause]
    scores: list[Score]
    loss: dict[str, float]
    gain: tuple[float, float, float]
    before: tuple[float, float]
    after: tuple[float, float]
    noise: tuple[float, float]
    numerics: float
    comparison: Comparison
    predicted: FloatArray

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The physical effects found."""
        return tuple(c.effect for c in self.causes if c.effect is not None)


def explain(
    experiment: Experiment,
    seed: int = 0,
    stage: Callable[[str], None] = lambda _: None,
    progress: Callable[[], None] | None = None,
) -> Explanation:
    """Returns what the simulation gets wrong about the experiment's recordings.

    Args:
        experiment: open.
        seed: of the resampling.
        stage: told what is being done.
        progress: called after each replay.
    """
    rng = np.random.default_rng(seed)
    stage("comparing")
    comparison = compare(experiment, progress)
    w = comparison.whitening
    scenario = w.vector(comparison.told["scenario"])
    refined = w.vector(comparison.told["refined"])
    judged = held_out(w)
    training = ~judged[w.block]
    numerics = _rms(w.size(scenario - refined), ~w.is_force)
    causes = _coarse(comparison, scenario, refined, numerics)

    stage("screening effects")
    columns = probe(experiment, comparison, (), progress)
    screened = screen(comparison, columns, refined)
    scores = {
        s.candidate.name: Score(s.candidate.name, s.gain, None, s.start)
        for s in best_of_each(screened)
    }
    predicted, reference = refined, refined
    found: tuple[Effect, ...] = ()
    rival = False
    for round_ in range(_MOST_CAUSES):
        named = {e.NAME for e in found}
        chosen = [s for s in shortlist(screened) if s.candidate.name not in named]
        if not chosen or chosen[0].gain < 0.5 * LEAST_GAIN:
            break
        stage(f"fitting {', '.join(s.candidate.name for s in chosen)}")
        fits = fitted(experiment, comparison, reference, found, chosen, progress)
        before = block_loss(w, predicted)
        after = [block_loss(w, f.predicted) for f in fits]
        order = np.argsort([a[judged].sum() for a in after])
        gains = [1.0 - float(a[judged].sum() / before[judged].sum()) for a in after]
        if round_ == 0:
            for s, f, g in zip(chosen, fits, gains, strict=True):
                name = s.candidate.name
                scores[name] = Score(name, scores[name].screened, g, f.effects[-1])
        best = int(order[0])
        if gains[best] < LEAST_GAIN:
            break
        # those that come near the best, if any, are told apart by the refined simulation
        near = [i for i in order[:2].tolist() if gains[i] >= _NEAR * gains[best]]
        if _confidence(before, after, best, judged, rng) >= _CERTAIN:
            near = [best]
        stage(f"refining {', '.join(chosen[i].candidate.name for i in near)}")
        contenders = [_refined(experiment, comparison, fits[i], progress) for i in near]
        for _ in range(_POLISHED):
            if all(c.settled for c in contenders):
                break
            contenders = [
                c if c.settled else _polished(experiment, comparison, c, training, progress)
                for c in contenders
            ]
            after = [block_loss(w, c.predicted) for c in contenders]
            gains = [1.0 - float(a[judged].sum() / before[judged].sum()) for a in after]
            best = int(np.argmax(gains))
            confidence = _confidence(before, after, best, judged, rng)
            # who falls behind is not refined further
            contenders = [
                replace(c, settled=c.settled or (k != best and confidence >= _CERTAIN))
                for k, c in enumerate(contenders)
            ]
        if gains[best] < LEAST_GAIN:
            break
        fit, reference, predicted = (
            contenders[best].fit,
            contenders[best].reference,
            contenders[best].predicted,
        )
        causes = _updated(causes, fit) + [_cause(fit, gains[best], confidence)]
        found = fit.effects
        if confidence < _SURE and len(contenders) > 1:
            rival = True
            causes.append(_cause(contenders[1 - best].fit, gains[1 - best], 1.0 - confidence))
            break
        screened = screen(comparison, columns, predicted)
    return _concluded(
        comparison, causes, scores, scenario, refined, predicted, numerics, rival, rng
    )


@dataclass(frozen=True)
class _Polished:
    """A fit, what the refined simulation says at it, and that with what is held out held out."""

    fit: Fit
    reference: FloatArray
    predicted: FloatArray
    settled: bool = False


def _refined(
    experiment: Experiment,
    comparison: Comparison,
    fit: Fit,
    progress: Callable[[], None] | None,
) -> _Polished:
    told = comparison.whitening.vector(experiment.tell([("refined", fit.effects)], progress)[0])
    return _Polished(fit, told, told + fit.predicted - fit.predicted_all)


def _polished(
    experiment: Experiment,
    comparison: Comparison,
    last: _Polished,
    training: npt.NDArray[np.bool_],
    progress: Callable[[], None] | None,
) -> _Polished:
    """Returns a fit about what the refined simulation says at the last one.

    Coarse contact feels friction more than fine contact does: by the slopes of the screening level
    alone a coefficient of friction came out at half of what it was.
    """
    effects = last.fit.effects
    (better,) = fit_all(
        experiment,
        comparison.whitening,
        last.reference,
        [effects],
        training,
        level="scenario",
        about=effects,
        iterations=1,
        progress=progress,
    )
    moved = [
        abs(getattr(new, p.name) - getattr(old, p.name))
        <= max(better.std[new.NAME][p.name], _STEADY * abs(getattr(new, p.name)))
        for old, new in zip(effects, better.effects, strict=True)
        for p in new.parameters()
    ]
    if all(moved):
        # so short a step is linear
        return _Polished(better, better.predicted_all, better.predicted, settled=True)
    return _refined(experiment, comparison, better, progress)


def _coarse(
    comparison: Comparison, scenario: FloatArray, refined: FloatArray, numerics: float
) -> list[Cause]:
    """Returns discretisation as a cause where it is one."""
    w = comparison.whitening
    markers = ~w.is_force
    noise = _rms(w.sensor, markers)
    before = max(_rms(w.size(w.data - scenario), markers) ** 2 - noise**2, 1e-12)
    after = _rms(w.size(w.data - refined), markers) ** 2 - noise**2
    mended = 1.0 - after / before
    if numerics < _COARSE * noise or mended < _MENDED:
        return []
    return [Cause(DISCRETISATION, None, {}, mended, float(np.clip(mended, 0.0, 1.0)))]


def _cause(fit: Fit, gain: float, confidence: float) -> Cause:
    effect = fit.effects[-1]
    return Cause(effect.NAME, effect, fit.std[effect.NAME], gain, confidence)


def _updated(causes: list[Cause], fit: Fit) -> list[Cause]:
    """Returns earlier causes with the parameters of a joint fit."""
    new = {e.NAME: e for e in fit.effects}
    return [
        Cause(c.name, new[c.name], fit.std[c.name], c.gain, c.confidence) if c.name in new else c
        for c in causes
    ]


def _confidence(
    before: FloatArray,
    after: Sequence[FloatArray],
    best: int,
    judged: npt.NDArray[np.bool_],
    rng: np.random.Generator,
) -> float:
    """Returns the share of block resamples in which the best stays the best, and is a gain."""
    rows = np.flatnonzero(judged)
    draws = rng.integers(len(rows), size=(_RESAMPLES, len(rows)))
    totals = np.stack([a[rows][draws].sum(axis=1) for a in after])
    wins = (totals.argmin(axis=0) == best) & (totals[best] < before[rows][draws].sum(axis=1))
    return float(wins.mean())


def _concluded(
    comparison: Comparison,
    causes: list[Cause],
    scores: dict[str, Score],
    scenario: FloatArray,
    refined: FloatArray,
    predicted: FloatArray,
    numerics: float,
    rival: bool,
    rng: np.random.Generator,
) -> Explanation:
    w = comparison.whitening
    judged = held_out(w)
    size = np.bincount(w.block)[judged]
    # with discretisation among the causes, the scenario is what is mended
    start = scenario if any(c.name == DISCRETISATION for c in causes) else refined
    first, last = block_loss(w, start)[judged], block_loss(w, predicted)[judged]
    gain = _interval(first - size, last - size, rng)
    left = float(last.sum() / size.sum())
    physical = [c for c in causes if c.name != DISCRETISATION]
    if not causes:
        verdict = "unexplained" if left > _LEFT else "nothing"
    elif rival:
        verdict = "ambiguous"
    elif physical and left > _LEFT and gain[0] < _EXPLAINED:
        verdict = "unexplained"
    else:
        verdict = "named"
    entries = judged[w.block]

    def sizes(residual: FloatArray) -> tuple[float, float]:
        return _rms(residual, entries & ~w.is_force), _rms(residual, entries & w.is_force, 1)

    ranked = sorted(scores.values(), key=lambda s: -(s.fitted or s.screened))
    return Explanation(
        verdict,
        causes,
        ranked,
        {
            "scenario": float(block_loss(w, scenario)[judged].sum() / size.sum()),
            "refined": float(block_loss(w, refined)[judged].sum() / size.sum()),
            "extended": left,
        },
        gain,
        sizes(w.size(w.data - start)),
        sizes(w.size(w.data - predicted)),
        sizes(w.sensor),
        numerics,
        comparison,
        predicted,
    )


def _interval(
    before: FloatArray, after: FloatArray, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Returns 1 − Σ after / Σ before over blocks, with its 90 % bootstrap interval."""

    def gain(rows: npt.NDArray[np.int64]) -> float:
        whole = before[rows].sum()
        return float(1.0 - max(after[rows].sum(), 0.0) / whole) if whole > 0.0 else 0.0

    count = len(before)
    draws = [gain(rng.integers(count, size=count)) for _ in range(_RESAMPLES)]
    low, high = np.quantile(draws, [0.05, 0.95])
    return gain(np.arange(count)), float(low), float(high)


def _rms(values: FloatArray, rows: npt.NDArray[np.bool_], dimensions: int = 3) -> float:
    """Returns the RMS of vectors whose components are entries."""
    chosen = values[rows]
    return float(np.sqrt(dimensions * np.mean(chosen**2))) if len(chosen) else 0.0
