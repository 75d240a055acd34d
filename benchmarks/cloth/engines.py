"""This package's cloth schemes behind one small interface, which the peers share.

All differences between their constructors are handled here.
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
    """A garment simulation."""

    def step(self, held: FloatArray) -> None:
        """Advances by one time step, which moves the held nodes to `held` (k,3), m."""

    def positions(self) -> FloatArray:
        """Returns the positions (n,3), m."""


@dataclass(frozen=True)
class Recipe:
    """How to create an engine.

    Attributes:
        name: Name for tables.
        make: Scene and time step, s → engine.
        missing: Returns why it is not available here, in one line; None if it is.
    """

    name: str
    make: Callable[[Scene, float], Engine]
    missing: Callable[[], str | None] = lambda: None


class ExplicitBiasEngine:
    """The controller's scheme.

    Args:
        scene: Scene to simulate.
        time_step: h, s.
        iterations: Limit of the inner solver's iterations; 1 gives the paper's scheme.
        thickness: Least distance of the garment's layers, m; 0 disables self-collision.
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
        """Returns the positions (n,3), m."""
        return self.x

    def held_force(self) -> FloatArray:
        """Returns (k,3) force of the grippers on the held nodes over the last step, N."""
        return np.asarray(self.reaction[self.cloth.held])


class StateEngine:
    """A scheme that steps a `ClothState`: implicit Euler, Projective Dynamics.

    Args:
        cloth: Scheme with the step `(state, obstacles, held_velocity) -> (state, info)`.
        scene: Scene to simulate.
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
        """Returns the positions (n,3), m."""
        return self.state.x

    def held_force(self) -> FloatArray:
        """Returns (k,3) force of the grippers on the held nodes over the last step, N."""
        return np.asarray(self.state.reaction[self._held])


def explicit_bias(iterations: int = 1, thickness: float = 0.0) -> Recipe:
    """Returns the controller's scheme with at most `iterations` inner iterations.

    With a thickness, m, it keeps the garment's layers that far apart.
    """
    return Recipe(
        f"explicit bias, {iterations} it." + (", layers" if thickness else ""),
        lambda scene, h: ExplicitBiasEngine(scene, h, iterations, thickness),
    )


def _make_implicit(scene: Scene, h: float) -> Engine:
    # Like the peers and the other schemes: contact at nodes only.
    cloth = ImplicitCloth(
        scene.elements(),
        scene.material,
        h,
        scene.held,
        settings=ImplicitSettings(sample_elements=False),
    )
    return StateEngine(cloth, scene, h)


def implicit() -> Recipe:
    """Returns the plant's scheme, but with contact at nodes only, like the others."""
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
