"""Effects that are missing from the list of `models/effects`, to hide in generated data.

`explain` does not know them, and has to say that something is unexplained.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import Effect, ForceEffect, Sheet, norms, parameter

# Where the magnet sits in the rest shape: nodes this near to the lowest of the left sleeve, m.
_CUFF = 0.06
# The magnet's pull does not grow within this distance, m.
_NEAREST = 0.08
# Speed below which dry friction of the lining is taken as viscous, m/s.
_CREEP = 0.01
# Share of the garment's height, from the top, that the lining is sewn to.
_SEWN = 0.06


@dataclass(frozen=True)
class MagnetisedCuff(ForceEffect):
    """A magnet in the left cuff that a steel post attracts: F = strength (d₀ / max(d, d₀))³.

    Args:
        strength: N at d₀ = 0.08 m and nearer.
        x: of the post relative to the highest node at the same side, m.
        y: m.
        z: m.
    """

    NAME = "magnetised_cuff"
    strength: float = parameter("N", 0.0, 50.0, 5.0)
    x: float = parameter("m", -2.0, 2.0, 0.1)
    y: float = parameter("m", -2.0, 2.0, 0.1)
    z: float = parameter("m", -2.0, 2.0, 0.1)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns the force (n,3), N."""
        rest = sheet.rest_position
        outermost = rest[np.argmax(rest[:, 1])]
        cuff = np.flatnonzero(norms(rest - outermost) < _CUFF)
        top = x[np.argmax(rest[:, 2] + 0.01 * rest[:, 1])]
        away = top + np.array([self.x, self.y, self.z]) - x[cuff].mean(axis=0)
        distance = float(np.linalg.norm(away))
        pull = self.strength * (_NEAREST / max(distance, _NEAREST)) ** 3
        force = np.zeros_like(x)
        force[cuff] = pull * away / (max(distance, 1e-9) * len(cuff))
        return force


@dataclass(frozen=True)
class Snag(ForceEffect):
    """A burr at a fixed point of the world that holds cloth near it: F = k d exp(−d² / r²) a node.

    Args:
        stiffness: k, N/m.
        radius: r, m.
        x: of the point, world, m.
        y: m.
        z: m.
    """

    NAME = "snag"
    stiffness: float = parameter("N/m", 0.0, 500.0, 20.0)
    radius: float = parameter("m", 0.0, 0.5, 0.05)
    x: float = parameter("m", -5.0, 5.0, 0.1)
    y: float = parameter("m", -5.0, 5.0, 0.1)
    z: float = parameter("m", -5.0, 5.0, 0.1)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns the force (n,3), N."""
        if self.radius == 0.0:
            return np.zeros_like(x)
        away = np.array([self.x, self.y, self.z]) - x
        near = np.exp(-((norms(away) / self.radius) ** 2))
        force: FloatArray = self.stiffness * near[:, None] * away
        return force


@dataclass(frozen=True)
class SlidingLayer(ForceEffect):
    """A stiff lining that hangs from the same seams, over which the cloth slides with dry friction.

    The lining moves as the top of the garment does; with w the cloth's velocity relative to it,
    F = −τ A w / max(‖w‖, 1 cm/s) for a node of area A.

    Args:
        stress: τ, N/m².
    """

    NAME = "sliding_layer"
    stress: float = parameter("N/m²", 0.0, 20.0, 0.5)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns the force (n,3), N."""
        height = sheet.rest_position[:, 2]
        top = height >= height.max() - _SEWN * np.ptp(height)
        slip = v - v[top].mean(axis=0)
        speed = np.maximum(norms(slip), _CREEP)
        area = np.where(top, 0.0, sheet.elements.node_area)
        force: FloatArray = -self.stress * (area / speed)[:, None] * slip
        return force


UNLISTED: Mapping[str, type[Effect]] = {e.NAME: e for e in (MagnetisedCuff, Snag, SlidingLayer)}
