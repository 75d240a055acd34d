"""The garment as SceneGraph geometry, so that cameras see it."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Rgba, SceneGraph
from pydrake.systems.framework import Context

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.systems.surface_geometry import SurfaceGeometry

# Label of the garment's pixels in a label image.
GARMENT_LABEL = 100
_COLOR = Rgba(0.22, 0.44, 0.70, 1.0)
_THICKNESS = 0.002  # m


class GarmentGeometry(SurfaceGeometry):
    """Updates the garment in a SceneGraph.

    .. pydrake_system::

        name: GarmentGeometry
        input_ports:
        - garment_position
        output_ports:
        - configuration

    garment_position: (3n,) row-major (n,3), m, world. configuration: see `SurfaceGeometry`.

    Args:
        scene_graph: Scene graph in which the garment is registered.
        mesh: Mesh of the garment.
    """

    def __init__(self, scene_graph: SceneGraph, mesh: GarmentMesh) -> None:
        super().__init__(
            scene_graph,
            "garment",
            mesh.rest_position,
            mesh.faces,
            _COLOR,
            GARMENT_LABEL,
            _THICKNESS,
        )
        self.DeclareVectorInputPort("garment_position", 3 * len(mesh.rest_position))

    def vertices(self, context: Context) -> FloatArray:
        """Returns the garment's nodes (n,3), m, world."""
        return np.asarray(self.get_input_port().Eval(context).reshape(-1, 3))
