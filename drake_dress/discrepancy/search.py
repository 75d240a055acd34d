"""The search for causes: rounds of screening, fitting and refinement that each add an effect.

Fits use coarse simulations. So the best fits are compared with the refined simulation and refitted
around it until they converge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.discrepancy.attribution import (
    Comparison,
    Screened,
    block_loss,
    compare_with,
    probe,
    screen,
    shortlist,
)
from drake_dress.discrepancy.candidates import Candidate
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.fitting import Evidence, Fit, bettered, fit_again, fit_all, with_slopes
from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import Effect

# Least share of the held-out loss that a first cause removes, and that a further one removes of the
# rest. Numerical error alone stays below these. Least share of resamples in which it is a gain.
_LEAST_GAIN, _FURTHER, _SURELY = 0.012, 0.025, 0.9
# Two causes are not distinguished if the first is the better one in less than this share of the
# resamples of blocks.
_SURE = 0.9
# A second candidate is refined, too, if its gain is at least this share of the best one's, unless
# the best is better in this share of the resamples.
_NEAR, _CERTAIN = 0.3, 0.99
# Most refinements of a fit. It has converged if each parameter's step is within these shares of its
# standard deviation or of its value.
_POLISHED, _WITHIN, _STEADY = 5, 0.35, 0.03
_MOST_CAUSES = 3
# Gauss–Newton steps of fits with coarse simulations: for a first effect, and for further ones.
_STEPS, _FURTHER_STEPS = 3, 2
_RESAMPLES = 1000


@dataclass(frozen=True)
class Model:
    """The simulation with effects.

    Attributes:
        fit: fit of the effects; None without any.
        reference: (N,) whitened prediction of the refined simulation with them.
        predicted: (N,) held-out prediction: for each entry, the parameters and the error of the
            time step are found from the blocks that it does not belong to.
        settled: whether the fit has converged.
    """

    fit: Fit | None
    reference: FloatArray
    predicted: FloatArray
    settled: bool = True

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects with their parameters."""
        return () if self.fit is None else self.fit.effects


@dataclass(frozen=True)
class Named:
    """One effect that was named.

    Attributes:
        name: name of the effect.
        gain: share of the held-out loss that it removed when it was found.
        confidence: share of the resamples in which it is the best.
    """

    name: str
    gain: float
    confidence: float


@dataclass(frozen=True)
class Found:
    """Result of the search.

    Attributes:
        comparison: simulations at all levels without effects, whitened like the models.
        plain: model without effects; model: model with all effects found.
        named: effects in the order found.
        rival: another effect that explains nearly as much in place of the last one, and the model
            with it; None if there is none.
        screened: all candidates at the start.
        fitted: effect and gain of the candidates that were fitted in the first round, by name.
    """

    comparison: Comparison
    plain: Model
    model: Model
    named: tuple[Named, ...]
    rival: tuple[Named, Model] | None
    screened: list[Screened]
    fitted: dict[str, tuple[Effect, float]]


class Search:
    """A search for what the refined simulation lacks.

    Args:
        experiment: an open experiment.
        comparison: its simulations at all levels without effects.
        rng: random number generator for the resampling.
        stage: called with a description of each stage.
        progress: called after each replay.
    """

    def __init__(
        self,
        experiment: Experiment,
        comparison: Comparison,
        rng: np.random.Generator,
        stage: Callable[[str], None],
        progress: Callable[[], None] | None,
    ) -> None:
        self._experiment, self._rng = experiment, rng
        self._stage, self._progress = stage, progress
        self._columns: list[tuple[Candidate, FloatArray]] = []
        self._take(comparison, _numerics(comparison))

    def _take(self, comparison: Comparison, numerics: FloatArray) -> None:
        """Continues with a comparison, and with the change by refinement `numerics` (N,)."""
        self._comparison, self._whitening = comparison, comparison.whitening
        self._evidence = Evidence.of(self._whitening, comparison.extrapolation, numerics)
        self._plain = self._model(None, comparison.vector["refined"])

    def run(self) -> Found:
        """Runs the search and returns its result."""
        self._stage("screening effects")
        self._columns = probe(self._experiment, self._comparison, self._progress)
        first = screened = screen(self._comparison, self._columns, self._plain.reference)
        model, named = self._plain, list[Named]()
        fitted: dict[str, tuple[Effect, float]] = {}
        refused = set[str]()
        while len(model.effects) < _MOST_CAUSES:
            begun = model is self._plain
            there = refused | {e.NAME for e in model.effects}
            chosen = [s for s in shortlist(screened) if s.candidate.name not in there]
            least = _LEAST_GAIN if begun else _FURTHER
            if not chosen or chosen[0].gain < 0.5 * least:
                break
            self._stage(f"fitting {', '.join(s.candidate.name for s in chosen)}")
            fits = self._fits(model, [(*model.effects, s.start) for s in chosen])
            if begun:
                gains = {f.effects[-1].NAME: (f.effects[-1], self._gain(model, f)) for f in fits}
                fitted = gains | fitted
            best, rest, confidence = self._best(model, fits)
            gain = self._gain(model, best)
            if gain < least or self._confidence(model, [best]) < _SURELY:
                if not begun:
                    break
                refused.add(best.effects[-1].NAME)
                continue
            news = [Named(best.effects[-1].NAME, gain, confidence)]
            if rest is not None and confidence < _SURE:
                other = Named(rest.effects[-1].NAME, self._gain(model, rest), 1.0 - confidence)
                both = self._both(model, best, rest)
                if both is None:
                    named = [*named, *news]
                    return self._found(best, named, (other, rest), first, fitted)
                news = [
                    replace(news[0], confidence=self._confidence(rest, [both])),
                    replace(other, confidence=self._confidence(best, [both])),
                ]
                best = both
            without = self._comparison, self._columns
            best = self._with_its_numerics(best)
            if begun and not self._is_gain(best):
                # its own numerical error explains as much, so this is not the cause
                refused.add(news[0].name)
                self._comparison, self._columns = without
                self._take(self._comparison, _numerics(self._comparison))
                model = self._plain
                continue
            model, named = self._lean(best, named + news)
            screened = screen(self._comparison, self._columns, model.reference)
        return self._found(model, named, None, first, fitted)

    def _found(
        self,
        model: Model,
        named: Sequence[Named],
        rival: tuple[Named, Model] | None,
        screened: list[Screened],
        fitted: dict[str, tuple[Effect, float]],
    ) -> Found:
        return Found(self._comparison, self._plain, model, tuple(named), rival, screened, fitted)

    def _is_gain(self, model: Model) -> bool:
        """Returns whether a model is a significant gain over the one without effects."""
        return (
            self._gain(self._plain, model) >= _LEAST_GAIN
            and self._confidence(self._plain, [model]) >= _SURELY
        )

    def _with_its_numerics(self, model: Model) -> Model:
        """Returns a model refined until it converges, judged by its own numerical error.

        The change by refinement depends on the effects. For example, cloth snaps from a limb a
        little earlier or later on another mesh, at a time that depends on the actual friction. From
        here on, all residuals are whitened by the numerical error with the effects. The last steps
        use slopes of the refined simulation: where cloth snaps, coarse slopes may have the wrong
        sign.
        """
        if model.fit is None:
            return model
        self._stage(f"weighing the numerics with {', '.join(e.NAME for e in model.effects)}")
        scenario, refined = self._experiment.tell(
            [("scenario", model.effects), ("refined", model.effects)], self._progress
        )
        last = self._whitening
        comparison = compare_with(self._experiment, self._comparison, scenario, refined)
        w = comparison.whitening

        self._columns = [
            (candidate, np.stack([w.of_size(last.size(c)) for c in columns.T], axis=1))
            for candidate, columns in self._columns
        ]
        told = w.vector(refined)
        self._take(comparison, told - w.vector(scenario))
        fit = with_slopes(self._experiment, w, model.fit, told, self._progress)
        return self._settled(self._model(fit, told, settled=False))

    def _gain(self, before: Model, after: Model) -> float:
        """Returns the share of the held-out loss of model `before` that `after` removes."""
        return 1.0 - self._loss(after) / self._loss(before)

    def _loss(self, model: Model) -> float:
        return float(self._blocks(model).sum())

    def _blocks(self, model: Model) -> FloatArray:
        """Returns the held-out loss of each block."""
        return block_loss(self._whitening, model.predicted)

    def _fits(self, about: Model, start: Sequence[Sequence[Effect]]) -> list[Model]:
        """Returns fits of sets of effects; coarse simulations give the change from `about`."""
        fits = fit_all(
            self._experiment,
            self._evidence,
            about.reference,
            start,
            about.effects,
            iterations=_STEPS if about is self._plain else _FURTHER_STEPS,
            progress=self._progress,
        )
        return [self._model(f, f.told, settled=False) for f in fits]

    def _model(self, fit: Fit | None, reference: FloatArray, settled: bool = True) -> Model:
        """Returns the model whose refined simulation predicts `reference` (N,)."""
        told = reference if fit is None else reference + fit.change
        predicted = self._whitening.data.copy()
        for rows in self._whitening.trained_on:
            left = self._comparison.extrapolation.without(self._whitening.data - told, rows)
            predicted[~rows] -= left[~rows]
        return Model(fit, reference, predicted, settled)

    def _best(self, before: Model, fits: Sequence[Model]) -> tuple[Model, Model | None, float]:
        """Returns the best fit, the second if it comes near, and the confidence in the best."""
        ranked = sorted(fits, key=self._loss)[:2]
        gains = [self._gain(before, f) for f in ranked]
        if gains[0] < _LEAST_GAIN:
            return ranked[0], None, 0.0
        confidence = self._confidence(before, ranked)
        if confidence >= _CERTAIN or gains[-1] < _NEAR * gains[0]:
            ranked = ranked[:1]
        self._stage(f"refining {', '.join(f.effects[-1].NAME for f in ranked)}")
        ranked = [self._refined(f) for f in ranked]
        if len(ranked) == 1:
            # a gain in coarse simulations may be none in the refined one until it is polished
            confidence = min(confidence, self._confidence(before, ranked))
        for _ in range(_POLISHED):
            if confidence >= _CERTAIN or all(f.settled for f in ranked):
                break
            ranked = [self._polished(f) for f in ranked]
            ranked.sort(key=self._loss)
            confidence = self._confidence(before, ranked)
        return ranked[0], ranked[1] if len(ranked) > 1 else None, confidence

    def _settled(self, model: Model) -> Model:
        """Returns a refined fit, polished until it converges."""
        for _ in range(_POLISHED):
            model = self._polished(model)
        return model

    def _both(self, before: Model, one: Model, other: Model) -> Model | None:
        """Returns `one` with the last effect of `other` added; None if that gains too little."""
        effects = (*one.effects, other.effects[-1])
        if len(effects) > _MOST_CAUSES:
            return None
        self._stage(f"fitting {' with '.join(e.NAME for e in effects[len(before.effects) :])}")
        (both,) = self._fits(one, [effects])
        if self._gain(one, both) < _FURTHER:
            return None
        both = self._settled(self._refined(both))
        return both if self._gain(one, both) >= _FURTHER else None

    def _lean(self, model: Model, named: Sequence[Named]) -> tuple[Model, list[Named]]:
        """Returns the model without earlier effects that later ones have made superfluous."""
        named = list(named)
        for name in [n.name for n in named[:-1]]:
            rest = [e for e in model.effects if e.NAME != name]
            self._stage(f"fitting {', '.join(e.NAME for e in rest)} alone")
            # around the model: coarse simulations give only the small change by dropping an effect
            (leaner,) = self._fits(model, [rest])
            # refinement may improve the leaner fit, but not by this much
            if self._gain(leaner, model) > 5.0 * _FURTHER:
                continue
            leaner = self._settled(self._refined(leaner))
            if self._gain(leaner, model) < _FURTHER:
                model, named = leaner, [n for n in named if n.name != name]
        if len(named) == 1:
            named = [replace(named[0], gain=self._gain(self._plain, model))]
        return model, named

    def _refined(self, model: Model) -> Model:
        """Returns a fit with the refined simulation's prediction in place of the coarse one's."""
        return self._model(model.fit, self._told(model.effects), settled=False)

    def _told(self, effects: Sequence[Effect]) -> FloatArray:
        """Returns (N,) the whitened prediction of the refined simulation with effects."""
        (told,) = self._experiment.tell([("refined", effects)], self._progress)
        return self._whitening.vector(told)

    def _polished(self, last: Model) -> Model:
        """Returns the fit refitted around the refined simulation at its parameters.

        A converged fit is returned unchanged. The slopes come from coarser simulations and turn
        into those of the refined one on the way. Coarse contact is more sensitive to friction: with
        the slopes of the screening level alone, a coefficient of friction came out at half its
        value.
        """
        if last.fit is None or last.settled:
            return last
        better = fit_again(self._evidence, last.fit, last.reference)
        moved = [
            abs(getattr(new, p.name) - getattr(old, p.name))
            <= max(_WITHIN * better.std[new.NAME][p.name], _STEADY * abs(getattr(new, p.name)))
            for old, new in zip(last.effects, better.effects, strict=True)
            for p in new.parameters()
        ]
        if all(moved):
            # for such a short step the linear prediction is good enough
            return self._model(better, better.told)
        told = self._told(better.effects)
        return self._model(bettered(better, told - last.reference), told, settled=False)

    def _confidence(self, before: Model, after: Sequence[Model]) -> float:
        """Returns the share of resamples of blocks in which the first is the best and a gain."""
        start, losses = self._blocks(before), [self._blocks(m) for m in after]
        draws = self._rng.integers(len(start), size=(_RESAMPLES, len(start)))
        totals = np.stack([a[draws].sum(axis=1) for a in losses])
        wins = (totals.argmin(axis=0) == 0) & (totals[0] < start[draws].sum(axis=1))
        return float(wins.mean())


def _numerics(comparison: Comparison) -> FloatArray:
    """Returns (N,) the whitened change by refinement of the scenario's simulation, no effects."""
    return comparison.vector["refined"] - comparison.vector["scenario"]
