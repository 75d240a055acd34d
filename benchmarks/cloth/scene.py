"""What is simulated: a mesh of a material, nodes that are led, and what stands in the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.material import Material

Motion = Callable[[float], FloatArray]

# The paper's time steps, s.
TIME_STEPS = (0.001, 0.005, 0.01, 0.05, 0.1)
QUICK_STEPS = (0.01, 0.05)
# The fabric of the package's coats: soft enough that one iteration a step moves it.
SOFT = Material()
# A real coat's: 0.2 kg/m², E·t = 5,000 N/m. The peers' figures of the project are for this one.
STIFF = Material(surface_density=0.2, stretch_stiffness=5000.0, bending_stiffness=1e-4)
# A node counts as in contact up to this far above its margin, m.
_TOUCH = 1e-3


@dataclass(frozen=True)
class Scene:
    """A task for an engine.

    Attributes:
        name: for tables and cached references.
        position: (n,3) rest shape and start, m.
        faces: (F,3).
        held: (k,) nodes whose motion is prescribed.
        material: SI values.
        motion: time, s → (k,3) positions of the held nodes, m.
        duration: s.
        obstacles: at rest.
        velocity: (n,3) at the start, m/s; None for a garment at rest.
        start: (n,3) positions at the start, m; None for the rest shape.
    """

    name: str
    position: FloatArray
    faces: IntArray
    held: IntArray
    material: Material
    motion: Motion
    duration: float
    obstacles: Obstacles = field(default_factory=Obstacles.none)
    velocity: FloatArray | None = None
    start: FloatArray | None = None

    def elements(self) -> Elements:
        """Returns the elements of the rest shape."""
        return make_elements(self.position, self.faces)

    def first_position(self) -> FloatArray:
        """Returns (n,3) where the nodes start, m."""
        return self.position if self.start is None else self.start

    def first_velocity(self) -> FloatArray:
        """Returns (n,3) velocities at the start, m/s."""
        return np.zeros_like(self.position) if self.velocity is None else self.velocity

    def touching(self, x: FloatArray) -> BoolArray:
        """Returns (n,) which nodes of `x` lie on an obstacle, to a millimetre beyond the margin."""
        if not self.obstacles.count:
            return np.zeros(len(x), dtype=np.bool_)
        near = find_proximity(x, self.obstacles, self.material.margin)
        return np.asarray(near.gap < _TOUCH)

    def penetration(self, x: FloatArray) -> float:
        """Returns how deep the deepest node of `x` lies below a surface, m; 0 if none does."""
        if not self.obstacles.count:
            return 0.0
        return max(0.0, -float(find_proximity(x, self.obstacles, 0.0).gap.min()))
