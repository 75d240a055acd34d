"""Newton's VBD: vertex block descent over coloured vertices.

Its membrane is Neo-Hookean with μ = half the stretch stiffness and λ = 0, which equals this
package's to second order. Its hinges are dihedral with their rest angle. Ten solver steps of five
iterations are the fewest that kept the 99 % edge strain of the stiff fabric near 1 % at h = 10 ms
(one of ten: 33 %, one of fifty: 8 %, five of ten: 2.4 %). Self-collision is off, as here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.cloth.engines import Engine, Recipe
from benchmarks.cloth.peers.flat import dihedral_stiffness
from benchmarks.cloth.peers.newton_cloth import NewtonCloth, missing
from benchmarks.cloth.scene import Scene

_SUBSTEPS = 10
_ITERATIONS = 5


class NewtonVBD(NewtonCloth):
    """A garment in VBD."""

    def __init__(self, scene: Scene, time_step: float) -> None:
        super().__init__(scene, time_step, _SUBSTEPS)

    def _add_cloth(self, builder: Any) -> None:
        warp, scene = self._warp, self._scene
        m = scene.material
        builder.add_cloth_mesh(
            pos=warp.vec3(0.0, 0.0, 0.0),
            rot=warp.quat_identity(),
            scale=1.0,
            vel=warp.vec3(0.0, 0.0, 0.0),
            vertices=scene.position.tolist(),
            indices=scene.faces.ravel().tolist(),
            density=m.surface_density,
            tri_ke=0.5 * m.stretch_stiffness,
            tri_ka=0.0,
            tri_kd=0.0,
            edge_ke=1.0,
            edge_kd=0.0,
            particle_radius=m.margin,
        )
        builder.color(include_bending=True)

    def _prepare_model(self) -> None:
        super()._prepare_model()
        scene = self._scene
        edges = self.model.edge_indices.numpy()
        stiffness = dihedral_stiffness(
            scene.position, edges[:, 2:4], edges[:, 0:2], scene.material.bending_stiffness
        )
        properties = self.model.edge_bending_properties.numpy()
        properties[:, 0] = stiffness.astype(np.float32)
        self.model.edge_bending_properties.assign(properties)

    def _make_solver(self) -> Any:
        return self._newton.solvers.SolverVBD(self.model, iterations=_ITERATIONS)


def _make(scene: Scene, time_step: float) -> Engine:
    return NewtonVBD(scene, time_step)


def recipe() -> Recipe:
    """Returns VBD."""
    return Recipe(f"Newton VBD, {_SUBSTEPS} x {_ITERATIONS} it.", _make, missing)
