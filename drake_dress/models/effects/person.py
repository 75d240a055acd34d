"""Effects on the person: thicker limbs, and limbs that yield."""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import BodyEffect, MountEffect, parameter
from drake_dress.models.human.measures import THINNEST, BodyMeasures, arm_radius_names


@dataclass(frozen=True)
class LimbRadius(BodyEffect):
    """Arms and hands are thicker: R' = R + added.

    Args:
        added: change of the radius of arms and hands, m.
    """

    NAME = "limb_radius"
    added: float = parameter("m", -0.025, 0.05, 0.01)

    def apply(self, measures: BodyMeasures) -> BodyMeasures:
        """Returns the sizes; no radius below 5 mm. Masses stay."""
        return measures.thickened(self.added)

    def derivative(self, name: str, measures: BodyMeasures) -> dict[str, float]:
        """Returns the derivative of the radii."""
        return {
            name: 1.0 if getattr(measures, name) + self.added > THINNEST else 0.0
            for name in arm_radius_names(measures)
        }


@dataclass(frozen=True)
class LimbCompliance(MountEffect):
    """A limb yields by c times the force on it, on a critically damped mount; see `mounts`.

    Args:
        compliance: c, displacement of each upper arm and forearm per force, m/N.
    """

    NAME = "limb_compliance"
    NEEDS_CONTACT = True
    compliance: float = parameter("m/N", 0.0, 0.2, 0.025)

    def apply(self, force: FloatArray) -> FloatArray:
        """Returns the limb's rest deflection (…,3), m, under forces (…,3), N."""
        return self.compliance * force

    def derivative(self, name: str, force: FloatArray) -> FloatArray:
        """Returns (…,3)."""
        return force
