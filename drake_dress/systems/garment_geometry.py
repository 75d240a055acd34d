"""The garment as SceneGraph geometry, so that cameras see it."""

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

from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.shell import Shell, make_shell

# Label of the garment's pixels in a label image.
GARMENT_LABEL = 100
_COLOR = Rgba(0.22, 0.44, 0.70, 1.0)
_THICKNESS = 0.002  # m


class GarmentGeometry(LeafSystem):
    """Updates the garment in a SceneGraph: a deformable geometry, a thin shell of tetrahedra.

    .. pydrake_system::

        name: GarmentGeometry
        input_ports:
        - garment_position
        output_ports:
        - configuration

    garment_position: (3n,) row-major (n,3), m, world. configuration: GeometryConfigurationVector
    for the scene graph's configuration port of `source`.

    Args:
        scene_graph: Scene graph in which the garment is registered.
        mesh: Mesh of the garment.
    """

    def __init__(self, scene_graph: SceneGraph, mesh: GarmentMesh) -> None:
        super().__init__()
        self._shell = make_shell(mesh.rest_position, mesh.faces, _THICKNESS)
        self.source = scene_graph.RegisterSource("garment")
        file = MemoryFile(_vtk(self._shell, mesh.rest_position), ".vtk", "garment")
        shape = Mesh(InMemoryMesh(mesh_file=file))
        instance = GeometryInstance(RigidTransform(), shape, "garment")
        seen = PerceptionProperties()
        seen.AddProperty("phong", "diffuse", _COLOR)
        seen.AddProperty("label", "id", RenderLabel(GARMENT_LABEL))
        instance.set_perception_properties(seen)
        self._id = scene_graph.RegisterDeformableGeometry(
            self.source, scene_graph.world_frame_id(), instance, 1.0
        )
        self.DeclareVectorInputPort("garment_position", 3 * len(mesh.rest_position))
        self.DeclareAbstractOutputPort(
            "configuration", lambda: Value(GeometryConfigurationVector()), self._calc
        )

    def _calc(self, context: Context, output: AbstractValue) -> None:
        position = self.get_input_port().Eval(context).reshape(-1, 3)
        configuration = GeometryConfigurationVector()
        configuration.set_value(self._id, self._shell.nodes(position).ravel())
        output.set_value(configuration)


def _vtk(shell: Shell, position: np.ndarray) -> str:
    """Returns the shell as a legacy VTK file of tetrahedra."""
    nodes, cells = shell.nodes(position), shell.tetrahedra
    points = "\n".join(" ".join(f"{x:.9g}" for x in node) for node in nodes)
    corners = "\n".join("4 " + " ".join(map(str, cell)) for cell in cells)
    return "\n".join(
        [
            "# vtk DataFile Version 3.0",
            "garment",
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
