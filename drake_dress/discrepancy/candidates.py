"""The effects that may explain a residual, and how each is probed around its off state."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.air import Wind
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS


@dataclass(frozen=True)
class Probe:
    """An effect at a typical size, whose change of the prediction is one column.

    Attributes:
        effect: the effect at coefficient 1, which gives the column.
        parameter: parameter that the coefficient scales.
        low: lower bound on the coefficient; there is no upper one.
    """

    effect: Effect
    parameter: str
    low: float


@dataclass(frozen=True)
class Candidate:
    """One form that an effect may take.

    Attributes:
        name: name of the effect.
        probes: probes with a column each; the effect is their combination.
    """

    name: str
    probes: tuple[Probe, ...]

    def effect(self, coefficients: FloatArray) -> Effect:
        """Returns the effect for coefficients of its columns, clipped to its bounds."""
        first = self.probes[0].effect
        values = {p.name: getattr(first, p.name) for p in first.parameters() if p.shapes}
        for probe, a in zip(self.probes, coefficients, strict=True):
            value = getattr(probe.effect, probe.parameter)
            # the pressure of wind grows with the square of its speed
            a = np.sign(a) * np.sqrt(abs(a)) if self.name == Wind.NAME else a
            values[probe.parameter] = float(a * value)
        return bounded(type(first), values)


def bounded(kind: type[Effect], values: dict[str, float]) -> Effect:
    """Returns an effect with values clipped to its bounds."""
    limits = {p.name: p for p in kind.parameters()}
    return kind(**{n: float(np.clip(v, limits[n].low, limits[n].high)) for n, v in values.items()})


def candidates(
    rest_position: FloatArray,
    on: Sequence[Effect] = (),
    among: Collection[str] | None = None,
) -> list[Candidate]:
    """Returns all candidates.

    Args:
        rest_position: (n,3) rest shape of the garment, on which local effects are placed, m.
        on: effects that the scenario already has; they are not tried.
        among: names of the effects to try; by default all known ones.
    """
    taken = {e.NAME for e in on}
    found: list[Candidate] = []
    for name, kind in EFFECTS.items():
        if name not in taken and (among is None or name in among):
            for start in kind.starts(rest_position):
                found += _ways(start)
    return found


def _ways(start: Effect) -> list[Candidate]:
    """Returns the candidates for an effect that is shaped like `start`."""
    name, sizes = start.NAME, start.sizes()
    if start.NEEDS_CONTACT and len(sizes) == 1 and sizes[0].low < sizes[0].off:
        # stick and slip respond differently to the two signs
        (p,) = sizes
        size = getattr(start, p.name)
        both = (replace(start, **{p.name: sign * size}) for sign in (1.0, -1.0))
        return [Candidate(name, (Probe(effect, p.name, p.off),)) for effect in both]
    probes = []
    for p in sizes:
        others = {q.name: q.off for q in sizes if q is not p}
        probes.append(Probe(replace(start, **others), p.name, -np.inf if p.low < p.off else 0.0))
    return [Candidate(name, tuple(probes))]


def shifted(effect: Effect, parameter: str, by: float) -> Effect:
    """Returns the effect with one parameter shifted, in the other direction if a bound is near."""
    p = next(q for q in effect.parameters() if q.name == parameter)
    value = getattr(effect, parameter)
    moved = value + by if p.low <= value + by <= p.high else value - by
    return replace(effect, **{parameter: moved})
