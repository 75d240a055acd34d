"""The person's skin as SceneGraph geometry, so that cameras see it."""

from __future__ import annotations

from pydrake.geometry import Rgba, SceneGraph
from pydrake.systems.framework import Context

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.systems.surface_geometry import SurfaceGeometry

# Label of the person's pixels in a label image.
SKIN_LABEL = 101
_COLOR = Rgba(0.87, 0.70, 0.58, 1.0)
_THICKNESS = 0.0002  # m, little beside the triangles of eyes and fingers


class SkinGeometry(SurfaceGeometry):
    """Updates a person's skin in a SceneGraph.

    .. pydrake_system::

        name: SkinGeometry
        input_ports:
        - joint_position
        output_ports:
        - configuration

    joint_position: (18,) row-major (6,3): shoulder, elbow, hand of left, then of right, m, world.
    configuration: see `SurfaceGeometry`.

    Args:
        scene_graph: Scene graph in which the skin is registered.
        skin: the person's skin.
    """

    def __init__(self, scene_graph: SceneGraph, skin: PersonSkin) -> None:
        super().__init__(
            scene_graph, "skin", skin.rest.vertices, skin.faces, _COLOR, SKIN_LABEL, _THICKNESS
        )
        self._skin = skin
        self.DeclareVectorInputPort("joint_position", 18)

    def vertices(self, context: Context) -> FloatArray:
        """Returns the skin's vertices (n,3), m, world."""
        return self._skin.vertices(self.get_input_port().Eval(context).reshape(6, 3))
