"""Newton's Style3D: projective dynamics with Jacobi-preconditioned conjugate gradients.

Weft and warp have the stretch stiffness, shear has half of it, which equals this package's energy
to second order. Bending is the same hinge energy with a flat rest shape. The number of nonlinear
iterations is a choice: one (with ten linear ones) is the fastest setting and stable at every time
step of the benchmark; ten is the solver's default. Self-collision is off, as here. The solver
itself scales velocities by 0.998 per step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.cloth.engines import Engine, Recipe
from benchmarks.cloth.peers.flat import flat_triangles
from benchmarks.cloth.peers.newton_cloth import NewtonCloth, load, missing
from benchmarks.cloth.scene import Scene


class NewtonStyle3D(NewtonCloth):
    """A garment in Style3D.

    Args:
        scene: Scene to simulate.
        time_step: h, s.
        iterations: Nonlinear iterations per step.
    """

    def __init__(self, scene: Scene, time_step: float, iterations: int) -> None:
        self._iterations = iterations
        super().__init__(scene, time_step, substeps=1)

    def _add_cloth(self, builder: Any) -> None:
        newton, warp, scene = load(), self._warp, self._scene
        m = scene.material
        k, bending = m.stretch_stiffness, m.bending_stiffness
        newton.solvers.SolverStyle3D.register_custom_attributes(builder)
        newton.solvers.style3d.add_cloth_mesh(
            builder,
            pos=warp.vec3(0.0, 0.0, 0.0),
            rot=warp.quat_identity(),
            vel=warp.vec3(0.0, 0.0, 0.0),
            vertices=scene.position.tolist(),
            indices=scene.faces.ravel().tolist(),
            # each triangle is a panel, since a garment's rest shape is not one flat piece
            panel_verts=flat_triangles(scene.position, scene.faces).reshape(-1, 2).tolist(),
            panel_indices=np.arange(3 * len(scene.faces)).tolist(),
            density=m.surface_density,
            tri_aniso_ke=warp.vec3(k, k, 0.5 * k),
            edge_aniso_ke=warp.vec3(bending, bending, bending),
            particle_radius=m.margin,
        )

    def _make_solver(self) -> Any:
        kind = self._newton.solvers.SolverStyle3D
        solver = kind(self.model, config=kind.Config(iterations=self._iterations))
        if self._scene.obstacles.count:
            solver.collision.stiff_vf = 0.0
            solver.collision.stiff_ee = 0.0
            solver.collision.stiff_ef = 0.0
        else:
            solver.collision = None
        return solver


def recipe(iterations: int) -> Recipe:
    """Returns Style3D with `iterations` nonlinear iterations per step."""

    def make(scene: Scene, time_step: float) -> Engine:
        return NewtonStyle3D(scene, time_step, iterations)

    return Recipe(f"Newton Style3D, {iterations} it.", make, missing)
