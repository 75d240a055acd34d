"""Effects on mass and weight: a heavier cloth, an object in a pocket, a floor that is not level."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.material import Material
from drake_dress.models.effects.effect import (
    GravityEffect,
    MassEffect,
    MaterialEffect,
    Sheet,
    parameter,
)
from drake_dress.models.garment.sampling import spread_out
from drake_dress.models.rotation import rotation_about

# Radius over which a local mass is spread (standard deviation), m.
_SPREAD = 0.05
# Places on the garment at which a local mass is tried, and the mass, kg.
_PLACES, _TRIED = 8, 0.05


@dataclass(frozen=True)
class SurfaceDensity(MaterialEffect):
    """The cloth is heavier: ρ' = ρ + added.

    Args:
        added: change of the surface density, kg/m².
    """

    NAME = "surface_density"
    added: float = parameter("kg/m²", -0.25, 2.0, 0.05)

    def apply(self, material: Material) -> Material:
        """Returns the fabric."""
        return replace(material, surface_density=material.surface_density + self.added)

    def derivative(self, name: str, material: Material) -> dict[str, float]:
        """Returns ∂ρ'/∂added."""
        return {"surface_density": 1.0}


@dataclass(frozen=True)
class LocalMass(MassEffect):
    """A mass at a place on the garment, such as an object in a pocket.

    It is spread over the nodes in proportion to exp(−d² / 2σ²) times their area, with d the
    distance from the given point in the rest shape and σ = 5 cm. The sum is the mass, and its
    centre lies near the point.

    Args:
        mass: additional mass, kg.
        x: x of its place in the garment's frame, m.
        y: y of its place, m.
        z: z of its place, m.
    """

    NAME = "local_mass"
    mass: float = parameter("kg", 0.0, 1.0, 0.06)
    x: float = parameter("m", -1.0, 1.0, 0.1, shape=0.0)
    y: float = parameter("m", -1.0, 1.0, 0.1, shape=0.0)
    z: float = parameter("m", -1.5, 1.0, 0.1, shape=0.0)

    @classmethod
    def starts(cls, rest_position: FloatArray) -> tuple[Self, ...]:
        """Returns the effect at places all over the garment."""
        lowest = int(np.argmin(rest_position[:, 2]))
        places = rest_position[spread_out(rest_position, _PLACES, lowest)].tolist()
        return tuple(cls(mass=_TRIED, x=x, y=y, z=z) for x, y, z in places)

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns (n,) kg."""
        return self.mass * self._share(sheet)

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (n,)."""
        share = self._share(sheet)
        if name == "mass":
            return share
        slope = (sheet.rest_position - self._point)[:, "xyz".index(name)] / _SPREAD**2
        weighted: FloatArray = self.mass * share * (slope - np.sum(share * slope))
        return weighted

    @property
    def _point(self) -> FloatArray:
        return np.array([self.x, self.y, self.z])

    def _share(self, sheet: Sheet) -> FloatArray:
        distance2 = np.sum((sheet.rest_position - self._point) ** 2, axis=1)
        # relative to the nearest node, so that weights do not underflow for a point far away
        weight = sheet.elements.node_area * np.exp(
            -0.5 * (distance2 - distance2.min()) / _SPREAD**2
        )
        share: FloatArray = weight / weight.sum()
        return share


@dataclass(frozen=True)
class GravityTilt(GravityEffect):
    """The world frame is not level: gravity g R_y(about_y) R_x(about_x) (0, 0, −1).

    Args:
        about_x: rotation of gravity about x, rad.
        about_y: rotation of gravity about y, rad.
    """

    NAME = "gravity_tilt"
    about_x: float = parameter("rad", -0.6, 0.6, 0.03)
    about_y: float = parameter("rad", -0.6, 0.6, 0.03)

    def apply(self, gravity: FloatArray) -> FloatArray:
        """Returns (3,) m/s²."""
        turned: FloatArray = (
            rotation_about("y", self.about_y) @ rotation_about("x", self.about_x) @ gravity
        )
        return turned

    def derivative(self, name: str, gravity: FloatArray) -> FloatArray:
        """Returns (3,)."""
        # the derivative of a rotation is a quarter turn further, minus the part along the axis
        quarter = 0.5 * np.pi
        if name == "about_x":
            off = np.diag([1.0, 0.0, 0.0])
            slope: FloatArray = (
                rotation_about("y", self.about_y)
                @ (rotation_about("x", self.about_x + quarter) - off)
                @ gravity
            )
        else:
            off = np.diag([0.0, 1.0, 0.0])
            slope = (
                (rotation_about("y", self.about_y + quarter) - off)
                @ rotation_about("x", self.about_x)
                @ gravity
            )
        return slope
