"""What a step of a batch and its adjoint share: the mesh on the device, P, solver, work arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from drake_dress.models.cloth.batch.inverse import Inverse
from drake_dress.models.cloth.batch.mesh import Mesh, element_vector_count, make_mesh
from drake_dress.models.cloth.batch.oblique import ObliqueSolver
from drake_dress.models.cloth.batch.parameters import central_material, share_one_system
from drake_dress.models.cloth.batch.projected_cg import ProjectedSolver
from drake_dress.models.cloth.batch.system import System, make_system, system_matrix
from drake_dress.models.cloth.elements import Elements, FloatArray, IntArray
from drake_dress.models.cloth.material import Material


@dataclass(frozen=True)
class Engine:
    """A mesh, its P and how to run kernels over a batch.

    Attributes:
        elements: the rest shape.
        time_step: h, s.
        gravity: m/s².
        batch: B.
        device: where everything is.
        mesh, system: on the device.
        held: (k,) held nodes; held_index: (n,) which of them a node is, -1 for others.
        solver: of P without slipping nodes; oblique: with them.
    """

    elements: Elements
    time_step: float
    gravity: wp.vec3d
    batch: int
    device: wp.Device
    mesh: Mesh
    system: System
    held: wp.array
    held_index: wp.array
    solver: ProjectedSolver
    oblique: ObliqueSolver

    @property
    def node_count(self) -> int:
        """N."""
        return self.elements.node_count

    def launch(self, kernel: Any, inputs: list[Any], per_garment: int | None = None) -> None:
        """Runs a kernel for all garments × nodes, or × `per_garment`."""
        count = self.node_count if per_garment is None else per_garment
        wp.launch(kernel, dim=(self.batch, count), inputs=inputs, device=self.device)

    def launch_elements(self, triangles: Any, hinges: Any, inputs: list[Any]) -> None:
        """Runs a kernel for the triangles and one for the hinges of all garments."""
        self.launch(triangles, inputs, len(self.elements.triangle))
        self.launch(hinges, inputs, len(self.elements.hinge))

    def vectors(self, zero: bool = False) -> wp.array:
        """Returns a new (B,n) array of vectors."""
        make = wp.zeros if zero else wp.empty
        return make((self.batch, self.node_count), dtype=wp.vec3d, device=self.device)

    def element_vectors(self) -> wp.array:
        """Returns a new (B,M) array of element vectors, see `mesh`."""
        shape = (self.batch, element_vector_count(self.elements))
        return wp.empty(shape, dtype=wp.vec3d, device=self.device)

    def integers(self) -> wp.array:
        """Returns a new (B,n) array of integers."""
        return wp.empty((self.batch, self.node_count), dtype=wp.int32, device=self.device)

    def scalars(self, per_garment: int | None = None) -> wp.array:
        """Returns a new (B,n) or (B,per_garment) array of numbers."""
        count = self.node_count if per_garment is None else per_garment
        return wp.empty((self.batch, count), dtype=wp.float64, device=self.device)

    def flags(self) -> wp.array:
        """Returns (B,) zeros."""
        return wp.zeros(self.batch, dtype=wp.int32, device=self.device)


def make_engine(
    elements: Elements,
    materials: Sequence[Material],
    time_step: float,
    held: IntArray,
    gravity: FloatArray,
    device: wp.Device,
    tolerance: float,
    max_iterations: int,
) -> Engine:
    """Returns the engine of a batch with one material per garment; arguments as `BatchCloth`'s."""
    n, batch = elements.node_count, len(materials)
    same = share_one_system(materials)
    preconditioning = materials[0] if same else central_material(materials)
    held_index = np.full(n, -1, dtype=np.int32)
    held_index[held] = np.arange(len(held), dtype=np.int32)
    system = make_system(elements, time_step, device)
    matrix = system_matrix(elements, preconditioning, time_step)
    inverse = Inverse(matrix, held_index >= 0, batch, device)
    solver = ProjectedSolver(system, inverse, tolerance, max_iterations)
    return Engine(
        elements,
        time_step,
        wp.vec3d(*(float(c) for c in gravity)),
        batch,
        device,
        make_mesh(elements, device),
        system,
        wp.array(held, dtype=wp.int32, device=device),
        wp.array(held_index, dtype=wp.int32, device=device),
        solver,
        ObliqueSolver(system, solver),
    )


def solve_kinds(engine: Engine, kind: int) -> wp.array:
    """Returns (B,) the same kind of solve for every garment."""
    return wp.full(engine.batch, kind, dtype=wp.int32, device=engine.device)
