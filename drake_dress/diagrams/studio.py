"""Renders a station's pictures in a process of its own, so that it does not delay the arms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from drake import lcmt_image_array
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import PassThrough
from pydrake.systems.sensors import ImageToLcmImageArrayT, PixelType

from drake_dress.diagrams.arms import add_arms
from drake_dress.diagrams.cameras import export_cameras, show_skin
from drake_dress.diagrams.person import add_person
from drake_dress.diagrams.station import StationParameters
from drake_dress.models.effects.composition import body_with_effects
from drake_dress.models.sides import SIDES
from drake_dress.systems.lcm_inbox import cpp_serializer

# Images of a picture message, in the order in which they are sent.
_KINDS = (("color", PixelType.kRgba8U), ("depth", PixelType.kDepth32F))


def add_picture_messages(builder: DiagramBuilder, station: Diagram, name: str) -> Any:
    """Adds the packing of a camera's images as `lcmt_image_array`; returns its output port."""
    images = builder.AddNamedSystem(f"{name}_images", ImageToLcmImageArrayT(True))
    for kind, pixels in _KINDS:
        port = images.DeclareImageInputPort[pixels](kind)
        builder.Connect(station.GetOutputPort(f"{name}.{kind}_image"), port)
    return images.image_array_t_msg_output_port()


class Studio:
    """Renders the pictures of a station's cameras as bytes of `lcmt_image_array`.

    It can be pickled, because the scene is built only at the first request for a picture.

    Args:
        parameters: of the station.
    """

    def __init__(self, parameters: StationParameters) -> None:
        # the scene does not need effects, and they may not be picklable
        self._parameters = replace(parameters, effects=(), camera_faults=None)
        self._body = body_with_effects(parameters.measures, parameters.effects)
        self._scene: tuple[Any, ...] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_scene": None}

    def __call__(self, name: str, time: float, state: np.ndarray, garment: np.ndarray) -> bytes:
        """Returns a camera's picture.

        Args:
            name: of the camera.
            time: s, written to the message.
            state: of the station's plant.
            garment: (3n,) nodes of the true garment, m.
        """
        if self._scene is None:
            self._scene = self._made()
        diagram, plant, garment_port, context, serializer = self._scene
        context.SetTime(time)
        plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), state)
        garment_port.FixValue(context, garment)
        picture: bytes = serializer.Serialize(diagram.GetOutputPort(name).EvalAbstract(context))
        return picture

    def _made(self) -> tuple[Any, ...]:
        p = self._parameters
        inner = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(inner, p.body_time_step)
        turns = p.behaviour.turns
        person = add_person(
            plant, self._body, p.posture, p.arms, p.joints, turns=turns, chair=p.chair
        )
        if p.placement is not None:
            add_arms(plant, {side: p.placement.base(side) for side in SIDES})
        plant.Finalize()
        skin = p.skin()
        if skin is not None:
            show_skin(inner, plant, scene_graph, person, skin)
        garment = inner.AddSystem(PassThrough(3 * len(p.mesh.rest_position)))
        inner.ExportInput(garment.get_input_port(), "garment_position")
        export_cameras(inner, scene_graph, p.mesh, garment.get_output_port(), p.cameras)
        builder = DiagramBuilder()
        scene = builder.AddNamedSystem("scene", inner.Build())
        builder.ExportInput(scene.GetInputPort("garment_position"), "garment_position")
        for camera in p.cameras:
            builder.ExportOutput(add_picture_messages(builder, scene, camera.name), camera.name)
        diagram = builder.Build()
        return (
            diagram,
            plant,
            diagram.GetInputPort("garment_position"),
            diagram.CreateDefaultContext(),
            cpp_serializer(lcmt_image_array),
        )
