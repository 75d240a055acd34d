"""Effects to hide in generated data that are not in the list of `models/effects`.

`explain` does not know them and should call such data unexplained.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import Effect, ForceEffect, Sheet, norms, parameter

# The magnet is at nodes this close to the outermost node on the left of the rest shape, m.
_CUFF = 0.06
# Distance d₀ below which the magnet's pull is constant, m.
_NEAREST = 0.08
# Speed below which the lining's dry friction is regularised as viscous, m/s.
_CREEP = 0.01
# Share of the garment's height, from the top, to which the lining is sewn.
_SEWN = 0.06


@dataclass(frozen=True)
class MagnetisedCuff(ForceEffect):
    """A magnet in the left cuff that a steel post attracts: F = strength (d₀ / max(d, d₀))³.

    Args:
        strength: force at d₀ = 0.08 m and nearer, N.
        x: position of the post relative to the highest node on the same side, m.
        y: likewise, m.
        z: likewise, m.
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
    """A burr at a fixed point that holds cloth near it: F = k d exp(−d² / r²) on each node.

    Args:
        stiffness: k, N/m.
        radius: r, m.
        x: position of the point, world frame, m.
        y: likewise, m.
        z: likewise, m.
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
    """A stiff lining sewn to the garment's top, over which the cloth slides with dry friction.

    The lining moves with the top of the garment. With w the cloth's velocity relative to it,
    F = −τ A w / max(‖w‖, 1 cm/s) on a node of area A.

    Args:
        stress: friction stress τ, N/m².
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
