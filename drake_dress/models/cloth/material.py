"""Material parameters of the garment's equations of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """An isotropic fabric.

    Args:
        surface_density: mass per rest area, kg/m².
        stretch_stiffness: tension per unit strain of a strip, per width, N/m.
        bending_stiffness: moment per unit curvature, per width, N·m.
        damping: stiffness-proportional damping time, s; not used by `ExplicitBiasCloth`.
        friction: Coulomb coefficient against the person, dimensionless.
        margin: distance kept between a node and the person's surface, m.

    Raises:
        ValueError: a value is not finite or outside its range.
    """

    surface_density: float = 0.3
    stretch_stiffness: float = 100.0
    bending_stiffness: float = 1.5e-3
    damping: float = 0.0
    friction: float = 0.3
    margin: float = 3e-3

    def __post_init__(self) -> None:
        for name, positive in (
            ("surface_density", True),
            ("stretch_stiffness", True),
            ("bending_stiffness", False),
            ("damping", False),
            ("friction", False),
            ("margin", False),
        ):
            value = getattr(self, name)
            if not math.isfinite(value) or value < 0.0 or (positive and value == 0.0):
                expected = "a finite number above 0" if positive else "a finite number, 0 or more"
                raise ValueError(f"{name} is {value}, expected {expected}")
