"""Effects on the fabric: changed material values, and laws beyond a single stiffness."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.material import Material
from drake_dress.models.effects.effect import (
    FibreEffect,
    MaterialEffect,
    ShapeEffect,
    Sheet,
    StretchEffect,
    parameter,
)


@dataclass(frozen=True)
class StretchStiffness(MaterialEffect):
    """The cloth is stiffer in stretch: k' = k + added.

    Args:
        added: change of the stretch stiffness, N/m.
    """

    NAME = "stretch_stiffness"
    added: float = parameter("N/m", -1e4, 1e4, 150.0)

    def apply(self, material: Material) -> Material:
        """Returns the fabric; its stiffness stays above a twentieth of what it was."""
        k = material.stretch_stiffness
        return replace(material, stretch_stiffness=max(k + self.added, 0.05 * k))

    def derivative(self, name: str, material: Material) -> dict[str, float]:
        """Returns ∂k'/∂added."""
        k = material.stretch_stiffness
        return {"stretch_stiffness": 1.0 if self.added > -0.95 * k else 0.0}


@dataclass(frozen=True)
class BendingStiffness(MaterialEffect):
    """The cloth is stiffer in bending: B' = B + added.

    Args:
        added: change of the bending stiffness, N·m.
    """

    NAME = "bending_stiffness"
    added: float = parameter("N·m", -0.1, 0.1, 1.5e-3)

    def apply(self, material: Material) -> Material:
        """Returns the fabric; its stiffness stays above a twentieth of what it was."""
        b = material.bending_stiffness
        return replace(material, bending_stiffness=max(b + self.added, 0.05 * b))

    def derivative(self, name: str, material: Material) -> dict[str, float]:
        """Returns ∂B'/∂added."""
        b = material.bending_stiffness
        return {"bending_stiffness": 1.0 if self.added > -0.95 * b else 0.0}


@dataclass(frozen=True)
class InternalDamping(MaterialEffect):
    """Deformation dissipates energy: β' = β + added, damping forces β K₊ v (Rayleigh).

    Args:
        added: change of the damping time, s.
    """

    NAME = "internal_damping"
    added: float = parameter("s", -0.1, 0.5, 0.02)

    def apply(self, material: Material) -> Material:
        """Returns the fabric; its damping is never negative."""
        return replace(material, damping=max(material.damping + self.added, 0.0))

    def derivative(self, name: str, material: Material) -> dict[str, float]:
        """Returns ∂β'/∂added."""
        return {"damping": 1.0 if material.damping + self.added > 0.0 else 0.0}


@dataclass(frozen=True)
class RestSize(ShapeEffect):
    """The garment has shrunk or grown at the same mass: rest lengths (1 + strain) L.

    Args:
        strain: relative change of all rest lengths; negative for shrinkage.
    """

    NAME = "rest_size"
    strain: float = parameter("1", -0.3, 0.3, 0.02)

    def apply(self, rest_position: FloatArray) -> FloatArray:
        """Returns (n,3) rest positions, m."""
        return (1.0 + self.strain) * rest_position

    def derivative(self, name: str, rest_position: FloatArray) -> FloatArray:
        """Returns (n,3)."""
        return rest_position


@dataclass(frozen=True)
class AnisotropicStiffness(FibreEffect):
    """The warp is stiffer than the weft: adds ½ k_a A (‖F d‖ − 1)² per triangle, d along the grain.

    Fabrics are orthotropic (Kawabata, "The standardization and analysis of hand evaluation", 1980).

    Args:
        warp: k_a, additional stiffness along the warp, N/m.
    """

    NAME = "anisotropic_stiffness"
    warp: float = parameter("N/m", 0.0, 2e4, 1000.0)

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns (F,) N/m."""
        return np.full(len(sheet.elements.triangle), self.warp)

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (F,)."""
        return np.ones(len(sheet.elements.triangle))


@dataclass(frozen=True)
class StrainStiffening(StretchEffect):
    """Yarns straighten before they stretch: k(ε) = k (1 + c ε), ε the larger principal strain.

    In compression (ε ≤ 0) k is unchanged. (The tensile curve of Kawabata 1980 to first order.)

    Args:
        rate: c, relative increase of stiffness per unit strain.
    """

    NAME = "strain_stiffening"
    rate: float = parameter("1", 0.0, 300.0, 15.0)

    def apply(self, strain: FloatArray) -> FloatArray:
        """Returns the factor (F,)."""
        return 1.0 + self.rate * np.maximum(strain, 0.0)

    def derivative(self, name: str, strain: FloatArray) -> FloatArray:
        """Returns (F,)."""
        return np.maximum(strain, 0.0)
