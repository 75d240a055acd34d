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
from drake_dress.models.effects.composition import world_points, world_rates
from drake_dress.models.effects.effect import Effect
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.models.perception.camera_errors import CameraErrors, drawn_pose_error
from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.systems.depth_camera import DepthCamera
from drake_dress.systems.garment_geometry import GarmentGeometry
from drake_dress.systems.joint_oracle import JointOracle
from drake_dress.systems.skin_geometry import SkinGeometry
from drake_dress.systems.surface_geometry import SurfaceGeometry

_RENDERER = "vtk"
_NEAR, _FAR = 0.05, 6.0  # range of rendering, m
_DEPTH = (0.1, 5.0)  # range of depth measurement, m
# Second numbers of the seeds of a camera's errors.
_POSE, _IMAGES = 11, 12
# Ports of an RgbdSensor, and the names under which they are exported.
_PERFECT = {"color_image": "color_image", "depth_image_32f": "depth_image"}
# Ports of an RgbdSensor, and the inputs and outputs of a `DepthCamera`.
_MEASURED = {
    "depth_image_32f": ("true_depth", "depth_image"),
    "label_image": ("true_labels", "label_image"),
}


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

    @property
    def pinhole(self) -> Pinhole:
        """Where points are in its images."""
        rotation = looking(self.position, self.target)
        return Pinhole(self.width, self.height, self.info.focal_x(), rotation, self.position)


@dataclass(frozen=True)
class CameraFaults:
    """What makes images of simulated cameras differ from perfect ones.

    Attributes:
        errors: of depth, labels, time and pose.
        seed: of the errors.
        effects: physical effects; those of cameras displace what they see.
    """

    errors: CameraErrors
    seed: int
    effects: Sequence[Effect] = ()

    def true_pose(self, camera: Camera, number: int) -> RigidTransform:
        """Returns where a camera stands that is believed to be at `camera.pose`.

        Args:
            camera: as believed.
            number: of the camera in the station.
        """
        rng = np.random.default_rng([self.seed, _POSE, number])
        turned, moved = drawn_pose_error(self.errors, rng)
        position = world_points(camera.position[None], self.effects)[0] + moved
        # rows are the camera's axes
        axes = world_rates(camera.pose.rotation().matrix().T, self.effects)
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(axes.T @ turned), position)


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
    faults: CameraFaults | None = None,
) -> None:
    """Adds cameras that see the garment; exports their images.

    These are `NAME.color_image` and `NAME.depth_image`, and with faults `NAME.label_image` and
    `NAME.image_time`, the time of depth and labels.

    Args:
        builder: of the station.
        scene_graph: with the person and all other visible bodies.
        mesh: the true garment.
        garment_position: its nodes, (3n,) m.
        cameras: with distinct names; without any, the scene graph is left unchanged.
        faults: what makes depth and labels differ from perfect ones; None for perfect images.
    """
    if not cameras:
        return
    scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(RenderEngineVtkParams()))
    garment = builder.AddNamedSystem("garment_geometry", GarmentGeometry(scene_graph, mesh))
    _connect(builder, scene_graph, garment, garment_position)
    for number, camera in enumerate(cameras):
        pose = camera.pose if faults is None else faults.true_pose(camera, number)
        sensor = _add_sensor(builder, scene_graph, camera, pose)
        for port, name in _PERFECT.items():
            if faults is None or port not in _MEASURED:
                builder.ExportOutput(sensor.GetOutputPort(port), f"{camera.name}.{name}")
        if faults is not None:
            _export_measured(builder, sensor, camera, faults, number)


def _add_sensor(
    builder: DiagramBuilder, scene_graph: SceneGraph, camera: Camera, pose: RigidTransform
) -> RgbdSensor:
    """Adds a perfect camera at a pose in the world."""
    core = RenderCameraCore(_RENDERER, camera.info, ClippingRange(_NEAR, _FAR), RigidTransform())
    sensor: RgbdSensor = builder.AddNamedSystem(
        f"camera_{camera.name}",
        RgbdSensor(
            scene_graph.world_frame_id(),
            pose,
            ColorRenderCamera(core, False),
            DepthRenderCamera(core, DepthRange(*_DEPTH)),
        ),
    )
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    return sensor


def _export_measured(
    builder: DiagramBuilder,
    sensor: RgbdSensor,
    camera: Camera,
    faults: CameraFaults,
    number: int,
) -> None:
    """Exports depth and labels of a camera as a real one tells them, and their time."""
    device = builder.AddNamedSystem(
        f"depth_camera_{camera.name}",
        DepthCamera(
            (camera.width, camera.height),
            camera.info.focal_x(),
            1.0 / camera.rate,
            faults.errors,
            (faults.seed, _IMAGES, number),
        ),
    )
    for port, (true, measured) in _MEASURED.items():
        builder.Connect(sensor.GetOutputPort(port), device.GetInputPort(true))
        builder.ExportOutput(device.GetOutputPort(measured), f"{camera.name}.{measured}")
    builder.ExportOutput(device.GetOutputPort("image_time"), f"{camera.name}.image_time")


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
