"""This package's schemes behind one small interface, the one that peers have too.

What differs between their constructors stands here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from benchmarks.cloth.scene import Scene
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import ClothState


class Engine(Protocol):
    """A garment that is stepped."""

    def step(self, held: FloatArray) -> None:
        """Advances by one time step, at whose end the held nodes are at `held` (k,3), m."""

    def positions(self) -> FloatArray:
        """Returns (n,3), m."""


@dataclass(frozen=True)
class Recipe:
    """How to make an engine.

    Attributes:
        name: for tables.
        make: scene and time step, s → engine.
        missing: why it cannot be made here, in one line; None if it can.
    """

    name: str
    make: Callable[[Scene, float], Engine]
    missing: Callable[[], str | None] = lambda: None


class ExplicitBiasEngine:
    """The controller's scheme.

    Args:
        scene: what is simulated.
        time_step: h, s.
        iterations: 1 for the paper's scheme, else the most iterations of the inner solve.
        thickness: that layers of the garment keep, m; 0 lets them pass.
    """

    def __init__(
        self, scene: Scene, time_step: float, iterations: int = 1, thickness: float = 0.0
    ) -> None:
        self.cloth = ExplicitBiasCloth(
            scene.elements(),
            scene.material,
            time_step,
            scene.held,
            settings=ExplicitSettings(iterations=iterations, self_collision=thickness),
        )
        self._obstacles = scene.obstacles
        self.x = scene.first_position().copy()
        self.v = scene.first_velocity().copy()
        self.reaction = np.zeros_like(self.x)

    def step(self, held: FloatArray) -> None:
        """Advances by one time step."""
        motion = held - self.x[self.cloth.held]
        self.x, self.v, self.reaction, _ = self.cloth.step(self.x, self.v, motion, self._obstacles)

    def positions(self) -> FloatArray:
        """Returns (n,3), m."""
        return self.x

    def held_force(self) -> FloatArray:
        """Returns (k,3) force of the grippers on the held nodes over the last step, N."""
        return np.asarray(self.reaction[self.cloth.held])


class StateEngine:
    """A scheme that steps a `ClothState`: implicit Euler, Projective Dynamics.

    Args:
        cloth: steps `(state, obstacles, held_velocity) -> (state, info)`.
        scene: what is simulated.
        time_step: h, s.
    """

    def __init__(self, cloth: Any, scene: Scene, time_step: float) -> None:
        self.cloth = cloth
        self._h = time_step
        self._held = scene.held
        self._obstacles = scene.obstacles
        start = ClothState.at_rest(scene.first_position())
        start.v[:] = scene.first_velocity()
        self.state = start
        self.unconverged = 0

    def step(self, held: FloatArray) -> None:
        """Advances by one time step."""
        velocity = (held - self.state.x[self._held]) / self._h
        self.state, info = self.cloth.step(self.state, self._obstacles, velocity)
        self.unconverged += not getattr(info, "converged", True)

    def positions(self) -> FloatArray:
        """Returns (n,3), m."""
        return self.state.x

    def held_force(self) -> FloatArray:
        """Returns (k,3) force of the grippers on the held nodes over the last step, N."""
        return np.asarray(self.state.reaction[self._held])


def explicit_bias(iterations: int = 1, thickness: float = 0.0) -> Recipe:
    """Returns the controller's scheme with so many inner iterations at most.

    With a thickness, m, it keeps the garment's layers so far apart.
    """
    return Recipe(
        f"explicit bias, {iterations} it." + (", layers" if thickness else ""),
        lambda scene, h: ExplicitBiasEngine(scene, h, iterations, thickness),
    )


def _make_implicit(scene: Scene, h: float) -> Engine:
    # Peers and the other schemes have contact at nodes only.
    cloth = ImplicitCloth(
        scene.elements(),
        scene.material,
        h,
        scene.held,
        settings=ImplicitSettings(sample_elements=False),
    )
    return StateEngine(cloth, scene, h)


def implicit() -> Recipe:
    """Returns the plant's scheme, with contact at nodes only as the others have it."""
    return Recipe("implicit", _make_implicit)


def projective_dynamics(quasi_newton: bool = False) -> Recipe:
    """Returns Projective Dynamics, the paper's baseline, plain or with Liu's acceleration."""

    def make(scene: Scene, h: float) -> Engine:
        cloth = ProjectiveDynamicsCloth(
            scene.elements(),
            scene.material,
            h,
            scene.held,
            settings=ProjectiveSettings(quasi_newton=quasi_newton),
        )
        return StateEngine(cloth, scene, h)

    return Recipe("projective dynamics" + (", quasi-Newton" if quasi_newton else ""), make)
