"""Cut lines are closed, lie in their plane, and leave the surface as it was."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import example, given
from hypothesis import strategies as st

from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.cut import cut_along, plane_line, shortest_line
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.mesh import check_loop, face_areas, loop_length

COAT = make_coat(CoatParameters(), 0.05)
X, FACES = COAT.rest_position, COAT.faces
RADIUS = 0.1
TUBE = trimesh.creation.cylinder(RADIUS, 0.8, sections=64).subdivide_to_size(0.05)
TUBE.update_faces(np.abs(TUBE.face_normals[:, 2]) < 0.5)
TUBE.remove_unreferenced_vertices()
TUBE.merge_vertices()


def sleeve_point(share: float) -> np.ndarray:
    cuff, armhole = (X[COAT.loops[f"left_{end}"]].mean(axis=0) for end in ("cuff", "armhole"))
    return cuff + share * (armhole - cuff)


@given(st.floats(0.1, 0.8), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
@example(0.1, -0.2421875, 0.0)  # a new node between two points that move to the same old one
def test_line_is_closed_and_the_surface_stays(share: float, a: float, b: float) -> None:
    axis = sleeve_point(1.0) - sleeve_point(0.0)
    axis /= np.linalg.norm(axis)
    normal = axis + a * np.array([1.0, 0.0, 0.0]) + b * np.array([0.0, 0.0, 1.0])
    line = plane_line(X, FACES, sleeve_point(share), normal)
    assert line is not None
    np.testing.assert_allclose((line.points - sleeve_point(share)) @ normal, 0.0, atol=1e-9)
    position, faces, loop = cut_along(X, FACES, line)
    np.testing.assert_array_equal(position[: len(X)], X)
    check_manifold(faces, len(position))
    check_loop(loop, faces, len(position), "coat", "cut")
    area = face_areas(position, faces)
    assert area.sum() == pytest.approx(face_areas(X, FACES).sum(), rel=1e-9)
    assert area.min() > 0.0
    # the line is moved by a quarter of an edge at most
    assert loop_length(position, loop) == pytest.approx(line.girth, rel=0.2)


@given(st.floats(-0.3, 0.3), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_shortest_line_around_a_tube_is_its_girth(height: float, a: float, b: float) -> None:
    x, faces = np.asarray(TUBE.vertices), np.asarray(TUBE.faces, dtype=np.int32)
    line = shortest_line(x, faces, [RADIUS, 0.0, height], [a, b, 1.0])
    if line is None:
        # a plane that leaves the tube at its end cuts no closed line
        assert abs(height) + RADIUS * np.hypot(a, b) > 0.2
        return
    assert line.girth == pytest.approx(2.0 * np.pi * RADIUS, rel=5e-3)


def test_where_a_plane_cuts_no_closed_line_there_is_none() -> None:
    # the coat is open in front
    assert plane_line(X, FACES, [0.1, 0.0, -0.5], [0.0, 0.0, 1.0]) is None
    assert plane_line(X, FACES, [0.0, 0.0, 9.0], [0.0, 0.0, 1.0]) is None


def test_of_two_sleeves_the_line_near_the_point_is_meant() -> None:
    for side, sign in (("left", 1.0), ("right", -1.0)):
        point = X[COAT.loops[f"{side}_cuff"]].mean(axis=0) + [0.0, -0.1 * sign, 0.1]
        line = plane_line(X, FACES, point, [0.0, 0.0, 1.0])
        assert line is not None
        assert (sign * line.points[:, 1] > 0.1).all()
