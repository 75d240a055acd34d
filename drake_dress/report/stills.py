"""Still images of a dressing, rendered by Drake without a display."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    Cylinder,
    GeometryInstance,
    LightParameter,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Rgba,
    SceneGraph,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo

from drake_dress.models.arm.description import link_meshes
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.report.arm_stand import STAND_COLOR, arm_stand
from drake_dress.report.shapes import CHAIR_COLOR, limb_shape, mesh_shape

_Color = tuple[float, float, float]

OUTSIDE_COLOR = (0.22, 0.44, 0.70)
LINING_COLOR = (0.87, 0.62, 0.28)
SKIN_COLOR = (0.87, 0.70, 0.58)
GRIPPER_COLOR = (0.25, 0.26, 0.28)
_FLOOR_COLOR = (0.76, 0.77, 0.79)
_BACKGROUND = (0.95, 0.96, 0.97)
_FLOOR_RADIUS = 1.6  # m
_GRIPPER_SIZE = 0.05  # m
# A glTF mesh, such as an arm's link, makes VTK use physically based shading, darker by this factor.
_PHYSICAL = 2.6
_KEY_DIRECTION = (-0.6, -0.35, -1.2)  # in which the key light shines
_LINING_OFFSET = 2e-3  # m, avoids z-fighting between the lining and the outside


class Surface(NamedTuple):
    """A surface of triangles.

    Attributes:
        vertices: (n,3), world, m.
        faces: (F,3), counter-clockwise from outside.
    """

    vertices: FloatArray
    faces: IntArray


# A person as round cones: ends (c,3), (c,3) and radii (c,2), world, m.
Limbs = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class Seated:
    """A person in a wheelchair.

    Attributes:
        body: the person's limbs, or skin.
        chair: parts of the wheelchair.
    """

    body: Limbs | Surface
    chair: Limbs


@dataclass(frozen=True)
class CameraPose:
    """Position and view of a camera.

    Attributes:
        eye: (3,) p_WC, m.
        target: (3,) the point in the middle of the image, m.
        field_of_view: Vertical field of view, rad.
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field_of_view: float = 0.6


def render_still(
    faces: IntArray,
    position: FloatArray,
    person: Limbs | Surface | Seated,
    grippers: FloatArray,
    camera: CameraPose,
    size: tuple[int, int] = (640, 480),
    floor: float | None = None,
    arms: FloatArray | None = None,
) -> npt.NDArray[np.uint8]:
    """Returns an image (height, width, 3), RGB.

    Args:
        faces: (F,3) triangles of the garment; their normals point outward.
        position: (n,3) nodes, world, m.
        person: The person's limbs, or skin; with a wheelchair, if any.
        grippers: (g,3) positions of the grippers, world, m.
        camera: Camera pose.
        size: Width and height, pixels.
        floor: Height of the floor, m; None: just below garment and person.
        arms: (a,8,4,4) X_WL of base and links of robot arms.
    """
    with_arms = arms is not None and len(arms) > 0
    scene = _Scene(with_arms)
    scene.add_garment(faces, position)
    body = person.body if isinstance(person, Seated) else person
    if isinstance(body, Surface):
        scene.add_surface(body, SKIN_COLOR)
    else:
        scene.add_capsules(*body, SKIN_COLOR)
    if isinstance(person, Seated):
        scene.add_capsules(*person.chair, CHAIR_COLOR)
    # with arms, the box is only the held cloth between the fingers
    gripper = [_GRIPPER_SIZE * (0.5 if with_arms else 1.0)] * 3
    for p in np.reshape(grippers, (-1, 3)):
        scene.add(Box(*gripper), RigidTransform(p), GRIPPER_COLOR)
    if floor is None:
        floor = floor_height(position, body)
    if arms is not None:
        scene.add_arms(arms, floor)
    middle = [camera.target[0], camera.target[1], floor - 0.01]
    scene.add(Cylinder(_FLOOR_RADIUS, 0.02), RigidTransform(middle), _FLOOR_COLOR)
    return scene.picture(camera, size)


def floor_height(position: FloatArray, person: Limbs | Surface) -> float:
    """Returns a height just below the garment's nodes (n,3) and the person, m."""
    low = float(position[:, 2].min())
    if isinstance(person, Surface):
        low = min(low, float(person.vertices[:, 2].min()))
    elif len(person[2]):
        ends = np.stack([person[0][:, 2], person[1][:, 2]], axis=1) - person[2]
        low = min(low, float(ends.min()))
    return low - 0.005


def node_normals(faces: IntArray, position: FloatArray) -> FloatArray:
    """Returns unit normals (n,3) at the nodes: area-weighted means of the triangle normals."""
    p = position[faces]
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normals = np.zeros_like(position)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], face)
    unit: FloatArray = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    return unit


class _Scene:
    """The scene of an image: shapes in the world, each of one colour."""

    def __init__(self, with_arms: bool) -> None:
        self._graph: SceneGraph = SceneGraph()
        brightness = _PHYSICAL if with_arms else 1.0
        self._graph.AddRenderer("vtk", MakeRenderEngineVtk(_render_parameters(brightness)))
        self._source = self._graph.RegisterSource("still")

    def add(self, shape: Shape, X_WG: RigidTransform, color: _Color | None = None) -> None:
        """Adds a shape; pass no colour for a mesh file that has its own."""
        name = f"g{self._graph.model_inspector().num_geometries()}"
        instance = GeometryInstance(X_WG, shape, name)
        properties = PerceptionProperties()
        if color is not None:
            properties.AddProperty("phong", "diffuse", Rgba(*color, 1.0))
        properties.AddProperty("label", "id", RenderLabel(1))
        instance.set_perception_properties(properties)
        self._graph.RegisterAnchoredGeometry(self._source, instance)

    def add_garment(self, faces: IntArray, position: FloatArray) -> None:
        """Adds a garment with nodes (n,3), m: its outside, and the lining behind it."""
        normals = node_normals(faces, position)
        self.add(mesh_shape(faces, position, normals, "garment"), RigidTransform(), OUTSIDE_COLOR)
        lining = position - _LINING_OFFSET * normals
        self.add(
            mesh_shape(faces[:, ::-1], lining, -normals, "garment"), RigidTransform(), LINING_COLOR
        )

    def add_surface(self, surface: Surface, color: _Color) -> None:
        """Adds a closed surface, shaded smoothly."""
        vertices = surface.vertices
        faces = _nearest_last(surface.faces, vertices)
        normals = node_normals(faces, vertices)
        self.add(mesh_shape(faces, vertices, normals, "surface"), RigidTransform(), color)

    def add_arms(self, poses: FloatArray, floor: float) -> None:
        """Adds robot arms with bases and links at `poses` (a,8,4,4), on columns from the floor."""
        for arm in poses:
            stand = arm_stand(RigidTransform(arm[0]), floor)
            if stand is not None:
                self.add(*stand, STAND_COLOR)
            for X_WL, meshes in zip(arm, link_meshes(), strict=True):
                for path, X_LM in meshes:
                    self.add(Mesh(str(path)), RigidTransform(X_WL @ X_LM))

    def add_capsules(
        self, first: FloatArray, second: FloatArray, radius: FloatArray, color: _Color
    ) -> None:
        """Adds limbs with ends (c,3), (c,3) and radii (c,2) at both, m."""
        for a, b, radii in zip(first, second, radius, strict=True):
            self.add(*limb_shape(a, b, (radii[0], radii[1])), color)

    def picture(self, camera: CameraPose, size: tuple[int, int]) -> npt.NDArray[np.uint8]:
        """Returns the camera image (height, width, 3), RGB."""
        graph = self._graph
        query = graph.get_query_output_port().Eval(graph.CreateDefaultContext())
        image = query.RenderColorImage(_camera(camera, size), graph.world_frame_id(), _pose(camera))
        return np.array(image.data[:, :, :3])


def _nearest_last(faces: IntArray, vertices: FloatArray) -> IntArray:
    """Returns triangles in an order in which the nearest to the key light is the last.

    VTK draws its map of shadows without a test of depth, so the last triangle that is drawn casts
    the shadow, also on those before it.
    """
    along = vertices[faces].mean(axis=1) @ np.array(_KEY_DIRECTION)
    return np.ascontiguousarray(faces[np.argsort(-along)])


def _render_parameters(brightness: float) -> RenderEngineVtkParams:
    # A key light from the upper front left casts shadows; lamps on all sides, without shadows,
    # brighten the shaded side.
    def lamp(x: float, y: float, z: float, intensity: float) -> LightParameter:
        return LightParameter(
            type="point", frame="world", position=(x, y, z), intensity=brightness * intensity
        )

    key = LightParameter(
        type="directional",
        frame="world",
        direction=_KEY_DIRECTION,
        intensity=0.55 * brightness,
    )
    return RenderEngineVtkParams(
        default_clear_color=_BACKGROUND,
        cast_shadows=True,
        shadow_map_size=2048,
        lights=[
            key,
            lamp(4.0, 3.0, 2.2, 0.5),
            lamp(4.0, -3.0, 1.5, 0.5),
            lamp(-4.0, 2.5, 2.0, 0.55),
            lamp(-4.0, -2.5, 2.0, 0.5),
        ],
    )


def _camera(camera: CameraPose, size: tuple[int, int]) -> ColorRenderCamera:
    info = CameraInfo(size[0], size[1], camera.field_of_view)
    return ColorRenderCamera(
        RenderCameraCore("vtk", info, ClippingRange(0.05, 20.0), RigidTransform()), False
    )


def _pose(camera: CameraPose) -> RigidTransform:
    """Returns X_WC with Cz from eye to target and Cy downward."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return RigidTransform(RotationMatrix(np.stack([x, np.cross(z, x), z], axis=1)), eye)
