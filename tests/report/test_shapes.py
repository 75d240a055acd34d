"""Shapes of limbs are the round cones that the garment touches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.geometry import (
    Capsule,
    GeometryInstance,
    MakePhongIllustrationProperties,
    Mesh,
    ProximityProperties,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.report.shapes import limb_pose, limb_shape


def distances(shape: Shape, pose: RigidTransform, points: FloatArray) -> FloatArray:
    """Returns Drake's signed distances (n,) of points (n,3) from a shape."""
    graph = SceneGraph()
    source = graph.RegisterSource("limb")
    instance = GeometryInstance(pose, shape, "limb")
    instance.set_proximity_properties(ProximityProperties())
    instance.set_illustration_properties(MakePhongIllustrationProperties(np.ones(4)))
    graph.RegisterAnchoredGeometry(source, instance)
    query = graph.get_query_output_port().Eval(graph.CreateDefaultContext())
    return np.array([query.ComputeSignedDistanceToPoint(p)[0].distance for p in points])


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_shape_for_collisions_is_half_a_percent_of_the_radius_inside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(0.0, 0.3, (2, 3))
    radii = rng.uniform(0.03, 0.06, 2)
    x = 0.5 * (a + b) + rng.normal(0.0, 0.3, (30, 3))
    found = distances(*limb_shape(a, b, (radii[0], radii[1]), collides=True), x)
    expected = find_proximity(x, Obstacles.resting(a[None], b[None], radii[None]), 0.0).gap
    outside = expected > 0.0
    assert (found[outside] >= expected[outside] - 1e-6).all()
    assert (found[outside] <= expected[outside] + 0.02 * radii.max()).all()


def test_equal_radii_are_drakes_own_shapes() -> None:
    a, b = np.zeros(3), np.array([0.0, 0.2, 0.0])
    capsule, pose = limb_shape(a, b, (0.05, 0.05))
    assert isinstance(capsule, Capsule)
    assert (capsule.radius(), capsule.length()) == (0.05, 0.2)
    np.testing.assert_allclose(pose @ np.array([0.0, 0.0, 0.1]), b, atol=1e-15)
    sphere, pose = limb_shape(b, b, (0.05, 0.05))
    assert isinstance(sphere, Sphere)
    np.testing.assert_array_equal(pose.translation(), b)


@pytest.mark.parametrize(("radii", "center"), [((0.3, 0.05), 0.0), ((0.05, 0.3), 0.2)])
def test_sphere_that_holds_the_other_is_drawn_alone(
    radii: tuple[float, float], center: float
) -> None:
    shape, pose = limb_shape(np.zeros(3), np.array([0.0, 0.2, 0.0]), radii)
    assert isinstance(shape, Sphere)
    assert shape.radius() == 0.3
    np.testing.assert_array_equal(pose.translation(), [0.0, center, 0.0])


def test_thick_end_of_a_drawn_limb_is_at_its_joint() -> None:
    a, b = np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, -0.3])
    shape, pose = limb_shape(a, b, (0.05, 0.03))
    assert isinstance(shape, Mesh)
    assert pose.IsExactlyEqualTo(limb_pose(a, b))
    text = shape.source().in_memory().mesh_file.contents().decode()
    rows = [line.split()[1:] for line in text.splitlines() if line.startswith("v ")]
    x = np.array([pose @ np.array(row, dtype=float) for row in rows])
    gap = find_proximity(x, Obstacles.resting(a[None], b[None], np.array([[0.05, 0.03]])), 0.0).gap
    np.testing.assert_allclose(gap, 0.0, atol=2e-5)
    np.testing.assert_allclose(x[:, 2].max(), 0.05, atol=1e-5)
    np.testing.assert_allclose(x[:, 2].min(), -0.33, atol=1e-5)
