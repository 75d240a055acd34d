"""The state of a garment, and the data that all schemes share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.fibres import Fibres
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import lumped_mass

GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True)
class ClothState:
    """State of a garment between two steps.

    Attributes:
        x: (n,3) positions of the nodes, m.
        v: (n,3) velocities, m/s.
        mode: (n,) contact of each node: 0 free, 1 stick, 2 slip, 3 held.
        reaction: (n,3) force of person or gripper on each node in the last step, N.
        owner: (n,) obstacle that each node touches, -1 for none.
        solver: (2,n+1) warm start of the linear solvers in the next step, so that a step depends
            on its arguments alone. Row 0 belongs to the linearly implicit scheme, row 1 to
            Projective Dynamics. A row starts with how outdated the factor is (-1 without one),
            followed by 1 for each node that the factor leaves out.
        tangled: (n,) 1 for nodes of edges and triangles that pierce each other despite layer
            separation; 0 for the others.
        acceleration: (n,3) mean acceleration over the last step, m/s²: the warm start of MuJoCo's
            solver. Other schemes leave it at zero.
    """

    x: FloatArray
    v: FloatArray
    mode: IntArray
    reaction: FloatArray
    owner: IntArray
    solver: IntArray = field(default_factory=lambda: np.empty((2, 0), dtype=np.int32))
    tangled: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    acceleration: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    def __post_init__(self) -> None:
        if len(self.acceleration) == 0:
            object.__setattr__(self, "acceleration", np.zeros((len(self.x), 3)))
        if len(self.tangled) == 0:
            object.__setattr__(self, "tangled", np.zeros(len(self.x), dtype=np.int32))
        if self.solver.shape[1] == 0:
            no_factor = np.full((2, len(self.x) + 1), -1, dtype=np.int32)
            object.__setattr__(self, "solver", no_factor)

    @staticmethod
    def at_rest(x: FloatArray) -> ClothState:
        """Returns a garment at rest and free of contact.

        Args:
            x: (n,3) positions, m.
        """
        n = len(x)
        return ClothState(
            np.array(x, dtype=np.float64),
            np.zeros((n, 3)),
            np.zeros(n, dtype=np.int32),
            np.zeros((n, 3)),
            np.full(n, -1, dtype=np.int32),
        )


@dataclass(frozen=True)
class Additions:
    """Permanent additions of effects to a garment.

    Attributes:
        fibres: additional stiffness of the triangles along given directions.
        added_mass: (n,) additional mass of the nodes, kg.
    """

    fibres: Fibres | None = None
    added_mass: FloatArray | None = None


NO_ADDITIONS = Additions()


class SteppedCloth:
    """A garment and its time step, common to all schemes.

    Args:
        elements: rest shape, from `make_elements`.
        material: fabric.
        time_step: h, s.
        held: (k,) nodes whose motion is prescribed.
        gravity: (3,) m/s².
        additions: permanent additions of effects.

    Attributes:
        mass: (n,) mass of each node, kg.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material,
        time_step: float,
        held: npt.NDArray[np.integer],
        gravity: FloatArray,
        additions: Additions = NO_ADDITIONS,
    ) -> None:
        self.elements = elements
        self.material = material
        self.time_step = time_step
        self.held: IntArray = np.asarray(held, dtype=np.int32)
        self.gravity = np.asarray(gravity, dtype=np.float64)
        self.additions = additions
        self.mass = lumped_mass(elements, material)
        if additions.added_mass is not None:
            self.mass = self.mass + additions.added_mass
