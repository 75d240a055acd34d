"""From recordings to a verdict: what the simulation gets wrong, why, and how much can be corrected.

Simulations with four levels of numerics are compared with the data, to see first whether finer
numerics remove the residual. Then all effects are screened and the likely ones are fitted. The one
that explains most of the held-out data is kept. This repeats on the rest of the residual until no
effect stands out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.discrepancy.attribution import (
    Comparison,
    best_of_each,
    block_loss,
    compare,
)
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.search import Found, Model, Named, Search
from drake_dress.discrepancy.whitening import Whitening, whiten
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray
from drake_dress.models.effects.effect import Effect

DISCRETISATION = "discretisation"
# A cause below this confidence is reported as likely, not as found.
BELIEVED = 0.9
# Discretisation is named if its error is this many times the markers' noise, and refinement removes
# at least this share of the squared residual beyond noise.
_COARSE, _MENDED = 2.5, 0.5
# A residual is unexplained if it keeps this many times the noise's variance, and less than this
# share of its excess over noise is explained. Contact always leaves some residual.
LEFT, _EXPLAINED = 1.12, 0.3
# Above the first multiple of the noise's variance, the second share is required instead.
_MUCH, _MOST = 1.5, 0.85
# Share of the change by refinement that counts as numerical error in the verdict: data are
# unexplained only if the whole change does not cover the residual. The search for causes uses 0.45,
# which is an average; in single recordings the error is up to the whole.
_WHOLE_NUMERICS = 1.0
# Confidence grows with the explained share of the excess over noise, up to this share. It is not
# reduced if less than this many times the noise's variance is left.
_WHOLE, _AT_NOISE = 0.85, 1.06
_RESAMPLES = 1000


@dataclass(frozen=True)
class Cause:
    """One cause with its parameters.

    Attributes:
        name: name of the effect.
        effect: the effect with its values; None for discretisation.
        std: standard deviations of its parameters.
        gain: share of the held-out loss that it removes.
        confidence: confidence that it is this effect, and not one that the list lacks, 0 to 1.
    """

    name: str
    effect: Effect | None
    std: dict[str, float]
    gain: float
    confidence: float


@dataclass(frozen=True)
class Score:
    """Result of one effect that was tried.

    Attributes:
        name: name of the effect.
        screened: gain in linear screening.
        fitted: gain after a fit; None if it was not fitted.
        effect: the effect as fitted or as screened.
    """

    name: str
    screened: float
    fitted: float | None
    effect: Effect | None


@dataclass
class Explanation:
    """Result of the search for causes.

    Attributes:
        verdict: nothing, named, ambiguous or unexplained.
        causes: causes in the order found.
        scores: scores of every effect tried, best first, in the first round.
        loss: mean squared whitened residual on held-out blocks: scenario, refined, extended; and
            refined with the full numerical error as noise, `beyond_numerics`.
        gain: 1 − (after − 1) / (before − 1) of the loss, and its 90 % interval.
        before, after: RMS of the residual on held-out blocks, m and N; noise likewise.
        numerics: RMS difference between scenario and refined simulation, m.
        comparison: simulations at all levels without further effects.
        predicted: (N,) whitened prediction with all causes, fitted on the other blocks.
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

    @property
    def doubted(self) -> Cause | None:
        """The cause with the least confidence, if that is below `BELIEVED`; else None."""
        least = min(self.causes, key=lambda c: c.confidence, default=None)
        return None if least is None or least.confidence >= BELIEVED else least


def explain(
    experiment: Experiment,
    seed: int = 0,
    stage: Callable[[str], None] = lambda _: None,
    progress: Callable[[], None] | None = None,
) -> Explanation:
    """Returns what the simulation gets wrong about the experiment's recordings.

    Args:
        experiment: an open experiment.
        seed: seed of the resampling.
        stage: called with a description of each stage.
        progress: called after each replay.
    """
    rng = np.random.default_rng(seed)
    stage("comparing")
    found = Search(experiment, compare(experiment, progress), rng, stage, progress).run()
    comparison = found.comparison
    w = comparison.whitening
    off = comparison.vector["scenario"] - comparison.vector["refined"]
    numerics = _rms(w.size(off), ~w.is_force)
    beyond = _beyond_numerics(experiment, found)
    return _concluded(found, _coarse(comparison, numerics), numerics, beyond, rng)


def _coarse(comparison: Comparison, numerics: float) -> list[Cause]:
    """Returns discretisation as a cause; empty if it is none."""
    w = comparison.whitening
    scenario, refined = comparison.vector["scenario"], comparison.vector["refined"]
    markers = ~w.is_force
    noise = _rms(w.sensor, markers)
    before = max(_rms(w.size(w.data - scenario), markers) ** 2 - noise**2, 1e-12)
    after = _rms(w.size(w.data - refined), markers) ** 2 - noise**2
    mended = 1.0 - after / before
    if numerics < _COARSE * noise or mended < _MENDED:
        return []
    return [Cause(DISCRETISATION, None, {}, mended, float(np.clip(mended, 0.0, 1.0)))]


def _beyond_numerics(experiment: Experiment, found: Found) -> float:
    """Returns the mean squared held-out residual without effects, relative to noise and numerics.

    The numerical error is taken as the full change by refinement of the scenario's simulation. The
    result is about 1 or less if nothing else is left.
    """
    w, told = found.comparison.whitening, found.comparison.told
    whole = whiten(
        experiment.recordings,
        experiment.samples,
        told["scenario"],
        told["refined"],
        _WHOLE_NUMERICS,
    )
    residual = whole.of_size(w.size(w.data - found.plain.predicted))
    return float(np.mean(residual**2))


def _causes(found: Found) -> list[Cause]:
    pairs = [(n, found.model) for n in found.named]
    if found.rival is not None:
        pairs.append(found.rival)
    return [_cause(named, model) for named, model in pairs]


def _cause(named: Named, model: Model) -> Cause:
    assert model.fit is not None
    effect = next(e for e in model.effects if e.NAME == named.name)
    return Cause(named.name, effect, model.fit.std[named.name], named.gain, named.confidence)


def _scores(found: Found) -> list[Score]:
    """Returns the scores of all effects in the first round, best first."""
    scores = []
    for s in best_of_each(found.screened):
        effect, gain = found.fitted.get(s.candidate.name, (s.start, None))
        scores.append(Score(s.candidate.name, s.gain, gain, effect))
    return sorted(scores, key=lambda s: -(s.screened if s.fitted is None else s.fitted))


def _concluded(
    found: Found,
    coarse: list[Cause],
    numerics: float,
    beyond: float,
    rng: np.random.Generator,
) -> Explanation:
    """Returns the explanation that follows from the search's result.

    Args:
        found: result of the search.
        coarse: discretisation as a cause, if it is one.
        numerics: RMS difference between scenario and refined simulation, m.
        beyond: mean squared residual without effects, relative to noise and numerics.
        rng: random number generator for the resampling.
    """
    comparison, w = found.comparison, found.comparison.whitening
    physical = _causes(found)
    predicted = found.model.predicted
    scenario, refined = comparison.vector["scenario"], found.plain.predicted
    # with discretisation among the causes, the gain is relative to the scenario's simulation
    start = scenario if coarse else refined
    size = np.bincount(w.block)

    def gain_of(predicted: FloatArray) -> tuple[float, float, float]:
        return _interval(block_loss(w, start) - size, block_loss(w, predicted) - size, rng)

    def mean_of(predicted: FloatArray) -> float:
        return float(block_loss(w, predicted).sum() / size.sum())

    gain, left = gain_of(predicted), mean_of(predicted)
    is_open = left > LEFT and gain[0] < (_MOST if left > _MUCH else _EXPLAINED)
    is_covered = beyond <= LEFT
    if physical and found.rival is None and is_open and is_covered:
        # the numerical error covers the residual, and no effect explains it
        physical, predicted = [], refined
        gain, left = gain_of(predicted), mean_of(predicted)
    trust = 1.0 if left < _AT_NOISE else float(np.clip(gain[0] / _WHOLE, 0.0, 1.0))
    causes = coarse + [replace(c, confidence=trust * c.confidence) for c in physical]
    mean = {
        "scenario": mean_of(scenario),
        "refined": mean_of(refined),
        "extended": left,
        "beyond_numerics": beyond,
    }
    return Explanation(
        _verdict(causes, found.rival is not None, is_open, left > LEFT and not is_covered),
        causes,
        _scores(found),
        mean,
        gain,
        _sizes(w, w.size(w.data - start)),
        _sizes(w, w.size(w.data - predicted)),
        _sizes(w, w.sensor),
        numerics,
        comparison,
        predicted,
    )


def _verdict(causes: list[Cause], has_rival: bool, is_open: bool, is_left: bool) -> str:
    """Returns the verdict, as in `Explanation`.

    Args:
        causes: causes that were found.
        has_rival: whether another effect explains nearly as much.
        is_open: whether the physical causes leave much of the residual unexplained.
        is_left: whether the residual exceeds noise and numerical error.
    """
    if not causes:
        return "unexplained" if is_left else "nothing"
    if has_rival:
        return "ambiguous"
    has_effect = any(c.effect is not None for c in causes)
    return "unexplained" if has_effect and is_open else "named"


def _sizes(w: Whitening, residual: FloatArray) -> tuple[float, float]:
    """Returns the RMS of the markers' residual, m, and of the forces', N."""
    return _rms(residual, ~w.is_force), _rms(residual, w.is_force, 1)


def _interval(
    before: FloatArray, after: FloatArray, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Returns 1 − Σ after / Σ before over blocks, with its 90 % bootstrap interval."""

    def gain(rows: IndexArray) -> float:
        whole = before[rows].sum()
        return float(1.0 - max(after[rows].sum(), 0.0) / whole) if whole > 0.0 else 0.0

    count = len(before)
    draws = [gain(rng.integers(count, size=count)) for _ in range(_RESAMPLES)]
    low, high = np.quantile(draws, [0.05, 0.95])
    return gain(np.arange(count)), float(low), float(high)


def _rms(values: FloatArray, rows: BoolArray, dimensions: int = 3) -> float:
    """Returns the RMS norm of vectors with the chosen entries as components; 0 without entries."""
    chosen = values[rows]
    return float(np.sqrt(dimensions * np.mean(chosen**2))) if len(chosen) else 0.0
