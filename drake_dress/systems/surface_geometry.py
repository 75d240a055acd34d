"""A surface that deforms as SceneGraph geometry, so that cameras see it."""

from __future__ import annotations

import numpy as np
from pydrake.common import MemoryFile
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    GeometryConfigurationVector,
    GeometryInstance,
    InMemoryMesh,
    Mesh,
    PerceptionProperties,
    RenderLabel,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.shell import Shell, make_shell


class SurfaceGeometry(LeafSystem):
    """Updates a surface in a SceneGraph: a deformable geometry, a thin shell of tetrahedra.

    It has the perception role alone. Derived systems say where its vertices are.

    .. pydrake_system::

        name: SurfaceGeometry
        input_ports:
        - (of derived systems)
        output_ports:
        - configuration

    configuration: GeometryConfigurationVector for the scene graph's configuration port of `source`.

    Args:
        scene_graph: Scene graph in which the surface is registered.
        name: of source and geometry.
        rest: (n,3) vertices at rest, m.
        faces: (F,3) triangles.
        color: of both sides.
        label: of its pixels in a label image.
        thickness: of the shell, m; less than the edges of the finest triangles.

    Attributes:
        source: of the geometry in the scene graph.
    """

    def __init__(
        self,
        scene_graph: SceneGraph,
        name: str,
        rest: FloatArray,
        faces: IntArray,
        color: Rgba,
        label: int,
        thickness: float,
    ) -> None:
        super().__init__()
        self._shell = make_shell(rest, faces, thickness)
        self.source = scene_graph.RegisterSource(name)
        file = MemoryFile(_vtk(self._shell, rest), ".vtk", name)
        instance = GeometryInstance(RigidTransform(), Mesh(InMemoryMesh(mesh_file=file)), name)
        seen = PerceptionProperties()
        seen.AddProperty("phong", "diffuse", color)
        seen.AddProperty("label", "id", RenderLabel(label))
        instance.set_perception_properties(seen)
        self._id = scene_graph.RegisterDeformableGeometry(
            self.source, scene_graph.world_frame_id(), instance, 1.0
        )
        self.DeclareAbstractOutputPort(
            "configuration", lambda: Value(GeometryConfigurationVector()), self._calc
        )

    def vertices(self, context: Context) -> FloatArray:
        """Returns the vertices (n,3), m, world."""
        raise NotImplementedError

    def _calc(self, context: Context, output: AbstractValue) -> None:
        configuration = GeometryConfigurationVector()
        configuration.set_value(self._id, self._shell.nodes(self.vertices(context)).ravel())
        output.set_value(configuration)


def _vtk(shell: Shell, position: np.ndarray) -> str:
    """Returns the shell as a legacy VTK file of tetrahedra."""
    nodes, cells = shell.nodes(position), shell.tetrahedra
    points = "\n".join(" ".join(f"{x:.9g}" for x in node) for node in nodes)
    corners = "\n".join("4 " + " ".join(map(str, cell)) for cell in cells)
    return "\n".join(
        [
            "# vtk DataFile Version 3.0",
            "surface",
            "ASCII",
            "DATASET UNSTRUCTURED_GRID",
            f"POINTS {len(nodes)} double",
            points,
            f"CELLS {len(cells)} {5 * len(cells)}",
            corners,
            f"CELL_TYPES {len(cells)}",
            "\n".join(["10"] * len(cells)),
            "",
        ]
    )
