"""Cameras of a simulated station, which look at the person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from drake_dress.diagrams.person import Person
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.systems.garment_geometry import GarmentGeometry
from drake_dress.systems.joint_oracle import JointOracle
from drake_dress.systems.skin_geometry import SkinGeometry
from drake_dress.systems.surface_geometry import SurfaceGeometry

_RENDERER = "vtk"
_NEAR, _FAR = 0.05, 6.0  # range of rendering, m
_DEPTH = (0.1, 5.0)  # range of depth measurement, m
# Ports of an RgbdSensor, and the names under which they are exported.
IMAGES = {"color_image": "color_image", "depth_image_32f": "depth_image"}


@dataclass(frozen=True)
class Camera:
    """A fixed pinhole camera for colour and depth.

    Attributes:
        name: of its ports and channel.
        position: p_WC (3,), m.
        target: point in the middle of its image (3,), m.
        width, height: of the image, pixels.
        fov: vertical, rad.
        rate: of images, Hz.
    """

    name: str
    position: np.ndarray
    target: np.ndarray
    width: int
    height: int
    fov: float
    rate: float

    @property
    def info(self) -> CameraInfo:
        """Its intrinsics."""
        return CameraInfo(self.width, self.height, self.fov)

    @property
    def pose(self) -> RigidTransform:
        """X_WC: z to the target, y down, x to the right."""
        return RigidTransform(RotationMatrix(looking(self.position, self.target)), self.position)


def looking(position: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Returns R_WC (3,3) of a camera at `position` (3,) that looks at `target` (3,), m.

    Raises:
        ValueError: one is straight above the other, or both coincide.
    """
    ahead = np.asarray(target, dtype=float) - position
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-6:
        raise ValueError("looks straight up or down, or nowhere")
    z, x = ahead / np.linalg.norm(ahead), right / np.linalg.norm(right)
    return np.stack([x, np.cross(z, x), z], axis=1)


def export_cameras(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    mesh: GarmentMesh,
    garment_position: OutputPort,
    cameras: Sequence[Camera],
) -> None:
    """Adds cameras that see the garment; exports `NAME.color_image` and `NAME.depth_image`.

    Args:
        builder: of the station.
        scene_graph: with the person and all other visible bodies.
        mesh: the true garment.
        garment_position: its nodes, (3n,) m.
        cameras: with distinct names; without any, the scene graph is left unchanged.
    """
    if not cameras:
        return
    scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(RenderEngineVtkParams()))
    garment = builder.AddNamedSystem("garment_geometry", GarmentGeometry(scene_graph, mesh))
    _connect(builder, scene_graph, garment, garment_position)
    for camera in cameras:
        core = RenderCameraCore(
            _RENDERER, camera.info, ClippingRange(_NEAR, _FAR), RigidTransform()
        )
        sensor = builder.AddNamedSystem(
            f"camera_{camera.name}",
            RgbdSensor(
                scene_graph.world_frame_id(),
                camera.pose,
                ColorRenderCamera(core, False),
                DepthRenderCamera(core, DepthRange(*_DEPTH)),
            ),
        )
        builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
        for port, name in IMAGES.items():
            builder.ExportOutput(sensor.GetOutputPort(port), f"{camera.name}.{name}")


def show_skin(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    person: Person,
    skin: PersonSkin,
) -> None:
    """Makes cameras see a person's skin in place of the round cones.

    The cones keep their other roles: they touch, and Meshcat shows them.

    Args:
        builder: of the station.
        plant: finalized, with the person.
        scene_graph: of the plant.
        person: of the plant.
        skin: the person's skin.
    """
    for body in person.body_indices.values():
        for geometry in plant.GetVisualGeometriesForBody(plant.get_body(body)):
            scene_graph.RemoveRole(plant.get_source_id(), geometry, Role.kPerception)
    joints = builder.AddNamedSystem("skin_joints", JointOracle(person.joint_points))
    builder.Connect(plant.get_body_poses_output_port(), joints.get_input_port())
    seen = builder.AddNamedSystem("skin_geometry", SkinGeometry(scene_graph, skin))
    _connect(builder, scene_graph, seen, joints.get_output_port())


def _connect(
    builder: DiagramBuilder, scene_graph: SceneGraph, surface: SurfaceGeometry, port: OutputPort
) -> None:
    """Connects a surface's input and its scene graph."""
    builder.Connect(port, surface.get_input_port())
    configuration = scene_graph.get_source_configuration_port(surface.source)
    builder.Connect(surface.get_output_port(), configuration)
