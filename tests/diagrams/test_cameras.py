"""Cameras of a station see the skin of a parametric body in place of the round cones."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scipy.spatial import cKDTree

from drake_dress.diagrams.cameras import Camera, export_cameras, show_skin
from drake_dress.diagrams.person import add_person, joint_positions
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.human.body import ArmPose
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.models.sides import Side
from tests.models.human.skin.bodies import OLD_WOMAN, skin_of
from tests.report import synthetic

CAMERA = Camera("front", np.array([2.4, 0.5, 1.3]), np.array([0.0, 0.0, 0.8]), 320, 400, 0.8, 15.0)
ARMS: dict[Side, ArmPose] = {"left": ArmPose(0.4, 0.2, 0.1, 0.5), "right": ArmPose(0.3, -0.3)}


def seen(with_skin: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns points that the camera sees (p,3), points of the skin (n,3), colours (p,3)."""
    skin = PersonSkin(skin_of(OLD_WOMAN), "standing")
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    body = body_measures(skin_measures(skin.rest))
    person = add_person(plant, body, "standing", ARMS, JointParameters())
    plant.Finalize()
    if with_skin:
        show_skin(builder, plant, scene_graph, person, skin)
    mesh = synthetic.coat(0.06)
    far = (mesh.rest_position + [-20.0, 0.0, 0.0]).ravel()
    garment = builder.AddSystem(ConstantVectorSource(far))
    export_cameras(builder, scene_graph, mesh, garment.get_output_port(), [CAMERA])
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    depth = diagram.GetOutputPort("front.depth_image").Eval(context).data[..., 0]
    color = diagram.GetOutputPort("front.color_image").Eval(context).data[..., :3]
    there = np.isfinite(depth) & (depth > 0.0)
    v, u = np.nonzero(there)
    z = depth[there].astype(float)
    info = CAMERA.info
    in_camera = np.stack(
        [
            (u - info.center_x()) * z / info.focal_x(),
            (v - info.center_y()) * z / info.focal_y(),
            z,
        ]
    )
    points = (CAMERA.pose @ in_camera).T
    joints = joint_positions(plant, plant.GetMyContextFromRoot(context), person)
    return points, spread(skin.vertices(joints), skin.faces), color[there].astype(float)


def spread(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Returns points (15 F,3) all over a surface's triangles."""
    shares = [(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]
    points: FloatArray = np.einsum("ki,fij->fkj", np.array(shares) / 4.0, vertices[faces])
    return points.reshape(-1, 3)


def test_the_skin_is_seen_and_nothing_of_the_cones() -> None:
    points, skin, color = seen(with_skin=True)
    assert len(points) > 6000
    distance, _ = cKDTree(skin).query(points)
    # a pixel is 5 mm wide, and points of the skin are up to a centimetre apart
    assert distance.max() < 0.012
    assert np.median(distance) < 0.004
    red, _, blue = color.mean(axis=0)
    assert red > blue + 30.0
    # from head to toe
    assert points[:, 2].max() == pytest.approx(1.58, abs=0.02)
    assert points[:, 2].min() < 0.05


def test_without_a_skin_the_cones_are_seen() -> None:
    points, skin, _ = seen(with_skin=False)
    distance, _ = cKDTree(skin).query(points)
    assert distance.max() > 0.04  # a cone's foot is a ball
