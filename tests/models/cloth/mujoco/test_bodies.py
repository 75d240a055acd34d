"""Bodies in a MuJoCo model are where the obstacles are, have their shapes, and move as they do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.mujoco.bodies import Bodies, bodies_xml, meshes_xml, shapes_of

mujoco = pytest.importorskip("mujoco", reason="needs MuJoCo: pip install -e '.[mujoco]'")

SHAPES = {
    "capsule": (0.3, 0.04, 0.04),
    "sphere": (0.0, 0.05, 0.05),
    "thicker end": (0.3, 0.03, 0.06),
    "thinner end": (0.25, 0.05, 0.035),
    "one sphere": (0.02, 0.03, 0.06),
}


def limb(kind: str, axis: FloatArray, velocity: FloatArray, spin: FloatArray) -> Obstacles:
    """Returns one obstacle whose end a is at (0.1, 0.2, 0.3)."""
    length, first, second = SHAPES[kind]
    a = np.array([[0.1, 0.2, 0.3]])
    at_rest = Obstacles.resting(a, a + length * axis, np.array([[first, second]]))
    return replace(at_rest, velocity=velocity[None], angular_velocity=spin[None])


def placed(obstacles: Obstacles) -> tuple[Any, Any]:
    """Returns a model and its data with the obstacles in place."""
    shapes = shapes_of(obstacles)
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><asset>{meshes_xml(shapes)}</asset>"
        f"<worldbody>{bodies_xml(shapes, 0.3)}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    Bodies(model, shapes).place(model, data, obstacles)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)
    return model, data


def surface_points(model: Any, data: Any) -> FloatArray:
    """Returns (k,3) points of the first geom's surface in the world, m."""
    R, p = data.geom_xmat[0].reshape(3, 3), data.geom_xpos[0]
    if model.geom_type[0] == mujoco.mjtGeom.mjGEOM_MESH:
        return model.mesh_vert[: model.mesh_vertnum[0]].astype(np.float64) @ R.T + p
    r, half = model.geom_size[0, :2]
    normal = np.random.default_rng(0).normal(size=(200, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return (r * normal + half * np.sign(normal[:, 2:]) * [0.0, 0.0, 1.0]) @ R.T + p


unit = st.builds(
    lambda z, turn: np.array([*(np.sqrt(1.0 - z * z) * np.array([np.cos(turn), np.sin(turn)])), z]),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 6.3),
)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(sorted(SHAPES)), unit, unit, unit)
def test_bodies_are_the_obstacles(
    kind: str, axis: FloatArray, velocity: FloatArray, spin: FloatArray
) -> None:
    obstacles = limb(kind, axis, velocity, spin)
    model, data = placed(obstacles)
    points = surface_points(model, data)
    np.testing.assert_allclose(find_proximity(points, obstacles, 0.0).gap, 0.0, atol=2e-5)

    twist = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, 1, twist, 0)
    np.testing.assert_allclose(twist[:3], spin, atol=1e-9)
    of_center = velocity + np.cross(spin, data.xpos[1] - obstacles.a[0])
    np.testing.assert_allclose(twist[3:], of_center, atol=1e-9)


def test_only_limbs_that_taper_need_a_mesh() -> None:
    still = np.zeros(3)
    tapers = {k: shapes_of(limb(k, np.array([0.0, 0.0, 1.0]), still, still))[0] for k in SHAPES}
    assert [k for k, shape in tapers.items() if shape.any()] == ["thicker end", "thinner end"]
    np.testing.assert_allclose(tapers["thicker end"], SHAPES["thicker end"], atol=1e-9)
