"""A scene to simulate: mesh, material, held nodes with their motion, and obstacles."""

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
# The fabric of the package's coats: soft enough for one iteration per step.
SOFT = Material()
# A real coat's fabric: 0.2 kg/m², E·t = 5,000 N/m. Figures of the peers are for this one.
STIFF = Material(surface_density=0.2, stretch_stiffness=5000.0, bending_stiffness=1e-4)
# A node counts as in contact up to this distance beyond its margin, m.
_TOUCH = 1e-3


@dataclass(frozen=True)
class Scene:
    """A task for an engine.

    Attributes:
        name: Name for tables and cached references.
        position: (n,3) rest shape, and start by default, m.
        faces: (F,3) triangles.
        held: (k,) nodes whose motion is prescribed.
        material: Material, SI units.
        motion: Time, s → (k,3) positions of the held nodes, m.
        duration: Duration, s.
        obstacles: Obstacles at rest.
        velocity: (n,3) initial velocities, m/s; None for a garment at rest.
        start: (n,3) initial positions, m; None for the rest shape.
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
        """Returns the initial positions (n,3), m."""
        return self.position if self.start is None else self.start

    def first_velocity(self) -> FloatArray:
        """Returns the initial velocities (n,3), m/s."""
        return np.zeros_like(self.position) if self.velocity is None else self.velocity

    def touching(self, x: FloatArray) -> BoolArray:
        """Returns (n,) whether nodes of `x` are within the contact margin plus a millimetre."""
        if not self.obstacles.count:
            return np.zeros(len(x), dtype=np.bool_)
        near = find_proximity(x, self.obstacles, self.material.margin)
        return np.asarray(near.gap < _TOUCH)

    def penetration(self, x: FloatArray) -> float:
        """Returns the greatest penetration of a node of `x`, m; 0 if none penetrates."""
        if not self.obstacles.count:
            return 0.0
        return max(0.0, -float(find_proximity(x, self.obstacles, 0.0).gap.min()))
