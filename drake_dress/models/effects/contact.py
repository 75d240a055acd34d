"""Effects on contact between garment and person: friction and adhesion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.material import Material
from drake_dress.models.effects.effect import (
    AdhesionEffect,
    FrictionEffect,
    MaterialEffect,
    Sheet,
    Sliding,
    norms,
    parameter,
)

# Below this speed, m/s, the direction of sliding is taken from the friction force.
_CREEP = 2e-3


@dataclass(frozen=True)
class Friction(MaterialEffect):
    """A different Coulomb coefficient: μ' = μ + added.

    Args:
        added: change of the coefficient of friction.
    """

    NAME = "friction"
    NEEDS_CONTACT = True
    added: float = parameter("1", -2.0, 2.0, 0.2)

    def apply(self, material: Material) -> Material:
        """Returns the fabric; its friction is never negative."""
        return replace(material, friction=max(material.friction + self.added, 0.0))

    def derivative(self, name: str, material: Material) -> dict[str, float]:
        """Returns ∂μ'/∂added."""
        return {"friction": 1.0 if material.friction + self.added > 0.0 else 0.0}


@dataclass(frozen=True)
class VelocityDependentFriction(FrictionEffect):
    """Friction rises with speed: μ(v) = μ + c ‖v_T‖, never negative.

    The viscous branch of the Stribeck curve (Olsson et al., "Friction models and friction
    compensation", 1998).

    Args:
        rate: c, increase of the coefficient of friction with sliding speed, s/m.
    """

    NAME = "velocity_dependent_friction"
    rate: float = parameter("s/m", -5.0, 20.0, 2.0)

    def apply(self, friction: float, sliding: Sliding) -> FloatArray:
        """Returns the change of μ, (c,)."""
        return np.maximum(self.rate * norms(sliding.velocity), -friction)

    def derivative(self, name: str, friction: float, sliding: Sliding) -> FloatArray:
        """Returns (c,)."""
        speed = norms(sliding.velocity)
        return np.where(self.rate * speed > -friction, speed, 0.0)


@dataclass(frozen=True)
class AnisotropicFriction(FrictionEffect):
    """Friction depends on the direction in which the cloth slides: μ(φ) = μ (1 + a cos 2φ).

    φ is the angle from the warp to the velocity, or to the force if the node hardly moves. The
    friction cone is orthotropic to first order (Zmitrowicz 2006, "Models of kinematics dependent
    anisotropic and heterogeneous friction").

    Args:
        contrast: contrast a, positive if sliding along the warp meets more friction.
    """

    NAME = "anisotropic_friction"
    contrast: float = parameter("1", -1.0, 1.0, 0.75)

    def apply(self, friction: float, sliding: Sliding) -> FloatArray:
        """Returns the change of μ, (c,)."""
        return self.contrast * self.derivative("contrast", friction, sliding)

    def derivative(self, name: str, friction: float, sliding: Sliding) -> FloatArray:
        """Returns (c,)."""
        moving = norms(sliding.velocity) > _CREEP
        way = np.where(moving[:, None], sliding.velocity, sliding.force)
        length = norms(way)
        along = np.einsum("ij,ij->i", way, sliding.grain) / np.where(length > 0.0, length, 1.0)
        return np.where(length > 0.0, friction * (2.0 * along**2 - 1.0), 0.0)


@dataclass(frozen=True)
class Adhesion(AdhesionEffect):
    """Cloth clings to the skin: a contact bears the pull σ A, and friction is μ (r_N + σ A).

    (Derjaguin's law, "Molekulartheorie der äußeren Reibung", 1934.)

    Args:
        strength: σ, tensile strength of the contact, Pa.
    """

    NAME = "adhesion"
    strength: float = parameter("Pa", 0.0, 500.0, 90.0)

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns (n,) N."""
        return self.strength * sheet.elements.node_area

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (n,)."""
        return sheet.elements.node_area
