"""Which effects may explain a residual, and how each is probed from where it is off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.air import Wind
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.mass import LocalMass
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.garment.sampling import spread_out

# Effects that show only where the garment touches the person.
NEED_CONTACT = frozenset(
    {
        "friction",
        "velocity_dependent_friction",
        "anisotropic_friction",
        "adhesion",
        "limb_radius",
        "limb_compliance",
    }
)
# Places on the garment at which a local mass is tried.
_PLACES = 8
_PROBED_WIND = 1.0


@dataclass(frozen=True)
class Probe:
    """An effect at a size that matters, whose change of the prediction is one column.

    Attributes:
        effect: so that its column is its linear share at coefficient 1.
        parameter: that is scaled by the coefficient.
        low: bound on the coefficient; the other one is open.
    """

    effect: Effect
    parameter: str
    low: float


@dataclass(frozen=True)
class Candidate:
    """One way in which an effect may be there.

    Attributes:
        name: of the effect.
        probes: a column each; the effect is their combination.
    """

    name: str
    probes: tuple[Probe, ...]

    def effect(self, coefficients: FloatArray) -> Effect:
        """Returns the effect with its columns' coefficients, within its bounds."""
        first = self.probes[0].effect
        values = first.values() if self.name == LocalMass.NAME else {}
        for probe, a in zip(self.probes, coefficients, strict=True):
            value = getattr(probe.effect, probe.parameter)
            # the pressure of wind grows with its square
            a = np.sign(a) * np.sqrt(abs(a)) if self.name == Wind.NAME else a
            values[probe.parameter] = float(a * value)
        return bounded(EFFECTS[self.name], values)


def bounded(kind: type[Effect], values: dict[str, float]) -> Effect:
    """Returns an effect with values cut to its bounds."""
    limits = {p.name: p for p in kind.parameters()}
    return kind(**{n: float(np.clip(v, limits[n].low, limits[n].high)) for n, v in values.items()})


def candidates(rest_position: FloatArray, on: Sequence[Effect] = ()) -> list[Candidate]:
    """Returns all candidates.

    Args:
        rest_position: (n,3) of the garment, m, where local masses are tried.
        on: effects that the scenario has already; these are not tried again.
    """
    taken = {e.NAME for e in on}
    found = []
    for name, kind in EFFECTS.items():
        if name in taken:
            continue
        if kind is LocalMass:
            lowest = int(np.argmin(rest_position[:, 2]))
            for place in rest_position[spread_out(rest_position, _PLACES, lowest)]:
                x, y, z = place.tolist()
                mass = LocalMass(mass=0.05, x=x, y=y, z=z)
                found.append(Candidate(name, (Probe(mass, "mass", 0.0),)))
            continue
        (first, *more) = kind.parameters()
        if name in NEED_CONTACT and not more and first.low < first.off:
            # what sticks or slides does not answer to both signs alike
            for size in (first.typical, -first.typical):
                probe = Probe(kind(**{first.name: size}), first.name, 0.0)
                found.append(Candidate(name, (probe,)))
            continue
        probes = []
        for p in (first, *more):
            if name == "gripper_slip" and p.name == "threshold":
                continue
            size = _PROBED_WIND if kind is Wind else p.typical
            low = -np.inf if p.low < p.off else 0.0
            probes.append(Probe(kind(**{p.name: size}), p.name, low))
        found.append(Candidate(name, tuple(probes)))
    return found


def shifted(effect: Effect, parameter: str, by: float) -> Effect:
    """Returns the effect with one parameter changed, to the other side where a bound is near."""
    p = next(q for q in effect.parameters() if q.name == parameter)
    value = getattr(effect, parameter)
    moved = value + by if p.low <= value + by <= p.high else value - by
    return replace(effect, **{parameter: moved})
