"""Effects of the air: drag and wind.

A triangle of area A and unit normal n that moves at velocity u relative to the air feels the
pressure on a flat plate, f = −½ ρ C A ‖u·n‖ (u·n) n, a third at each corner (C ≈ 1.2 for a plate
across the flow: Hoerner, "Fluid-Dynamic Drag", 1965, ch. 3). Flow along the cloth has no effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import ForceEffect, Sheet, parameter

AIR_DENSITY = 1.2  # kg/m³
PLATE_DRAG = 1.2  # C of a plate across the flow


@dataclass(frozen=True)
class AirDrag(ForceEffect):
    """Still air resists: f = −½ ρ C A ‖v·n‖ (v·n) n on each triangle; see the module.

    Args:
        coefficient: C, drag coefficient of the cloth.
    """

    NAME = "air_drag"
    coefficient: float = parameter("1", 0.0, 10.0, 1.5)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns the force (n,3), N."""
        return self.coefficient * self.derivative("coefficient", sheet, x, v)

    def derivative(self, name: str, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns ∂f/∂C (n,3), N."""
        return _pressure(sheet, x, v, np.zeros(3))[0]


@dataclass(frozen=True)
class Wind(ForceEffect):
    """A steady wind w: the drag of a plate (C = 1.2) in the wind minus that in still air.

    The force is f(v − w) − f(v) with the module's f, so that zero wind changes nothing.

    Args:
        x: forward component of the wind's velocity in the world frame, m/s.
        y: leftward component, m/s.
        z: upward component, m/s.
    """

    NAME = "wind"
    x: float = parameter("m/s", -5.0, 5.0, 0.8)
    y: float = parameter("m/s", -5.0, 5.0, 0.8)
    z: float = parameter("m/s", -5.0, 5.0, 0.8)

    @classmethod
    def starts(cls, rest_position: FloatArray) -> tuple[Self, ...]:
        """Returns 1 m/s in each direction: pressure grows with the square, which is also 1."""
        return (cls(x=1.0, y=1.0, z=1.0),)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns the force (n,3), N."""
        wind = np.array([self.x, self.y, self.z])
        still = _pressure(sheet, x, v, np.zeros(3))[0]
        return PLATE_DRAG * (_pressure(sheet, x, v, wind)[0] - still)

    def derivative(self, name: str, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns ∂f/∂w_name (n,3)."""
        wind = np.array([self.x, self.y, self.z])
        return PLATE_DRAG * _pressure(sheet, x, v, wind)[1]["xyz".index(name)]


def _pressure(
    sheet: Sheet, x: FloatArray, v: FloatArray, wind: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the force (n,3) for C = 1, N, and its derivative by the wind (3,n,3)."""
    force = np.zeros_like(x)
    slope = np.zeros((3, *x.shape))
    _add_pressure(x, v, wind, sheet.elements.triangle, 0.5 * AIR_DENSITY, force, slope)
    return force, slope


@nb.njit(cache=True, nogil=True)
def _add_pressure(x, v, wind, triangle, half_density, force, slope):  # type: ignore[no-untyped-def]
    p, q, n, u = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for e in range(triangle.shape[0]):
        i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
        for c in range(3):
            p[c] = x[j, c] - x[i, c]
            q[c] = x[k, c] - x[i, c]
            u[c] = (v[i, c] + v[j, c] + v[k, c]) / 3.0 - wind[c]
        n[0] = p[1] * q[2] - p[2] * q[1]
        n[1] = p[2] * q[0] - p[0] * q[2]
        n[2] = p[0] * q[1] - p[1] * q[0]
        double_area = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) + 1e-300
        through = (u[0] * n[0] + u[1] * n[1] + u[2] * n[2]) / double_area
        # n has length 2A: a sixth of it is the area of a corner times the unit normal
        share = -half_density * abs(through) * through / 6.0
        steep = 2.0 * half_density * abs(through) / 6.0 / double_area
        for c in range(3):
            f = share * n[c]
            force[i, c] += f
            force[j, c] += f
            force[k, c] += f
            for d in range(3):
                g = steep * n[d] * n[c]
                slope[d, i, c] += g
                slope[d, j, c] += g
                slope[d, k, c] += g
