import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.skin.cuts import cut, girth_with_circle, plane_axes
from drake_dress.models.rotation import rotation_about
from tests.models.human.skin.bodies import tube

UP = np.array([0.0, 0.0, 1.0])
CORNERS = 96
# girth of a polygon of that many corners over that of its circle
SHARE = CORNERS / np.pi * np.sin(np.pi / CORNERS)


def test_cut_of_a_cone_is_a_circle_of_its_radius_there() -> None:
    vertices, faces = tube(np.array([0.06, 0.04]), np.array([0.0, 0.5]), CORNERS)
    for height in (0.1, 0.25, 0.4):
        level = cut(vertices, faces, height * UP, UP)
        radius = 0.06 - 0.02 * height / 0.5
        assert level.radius == pytest.approx(SHARE * radius, rel=1e-3)
        assert level.area == pytest.approx(np.pi * radius**2, rel=3e-3)
        assert level.extents == pytest.approx([2.0 * radius] * 2, rel=2e-3)
        assert level.mean_distance == pytest.approx(radius, rel=2e-3)


def test_cut_does_not_depend_on_where_the_mesh_is() -> None:
    vertices, faces = tube(np.array([0.06, 0.04]), np.array([0.0, 0.5]))
    rotation = rotation_about("x", 0.7) @ rotation_about("z", 1.1)
    there = cut(vertices @ rotation.T + 1.0, faces, rotation @ (0.2 * UP) + 1.0, rotation @ UP)
    here = cut(vertices, faces, 0.2 * UP, UP)
    assert there.girth == pytest.approx(here.girth, rel=1e-9)
    assert there.area == pytest.approx(here.area, rel=1e-9)


@pytest.mark.parametrize("normal", [UP, [1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [0.0, -1.0, 0.0]])
def test_axes_of_a_plane_are_unit_vectors_in_it(normal: FloatArray) -> None:
    axes = plane_axes(np.array(normal))
    assert axes @ axes.T == pytest.approx(np.eye(2), abs=1e-12)
    assert axes @ normal == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.cross(axes[0], axes[1]) == pytest.approx(normal, abs=1e-12)


def test_pieces_are_the_tubes_that_are_cut() -> None:
    first, faces = tube(np.array([0.05, 0.05]), np.array([0.0, 0.5]))
    second, _ = tube(np.array([0.02, 0.02]), np.array([0.0, 0.5]))
    both = np.vstack([first, second + [0.2, 0.0, 0.0]])
    level = cut(both, np.vstack([faces, faces + len(first)]), 0.1 * UP, UP)
    large, small = level.pieces()
    assert (large.radius, small.radius) == pytest.approx((0.05, 0.02), rel=1e-2)
    assert small.hull.mean(axis=0) == pytest.approx([0.2, 0.0], abs=1e-3)
    # a tape goes around both: half of each circle and the two tangents
    tangents = 2.0 * np.hypot(0.2, 0.0) * np.sqrt(1.0 - (0.03 / 0.2) ** 2)
    turn = np.arcsin(0.03 / 0.2)
    arcs = 0.05 * (np.pi + 2.0 * turn) + 0.02 * (np.pi - 2.0 * turn)
    assert level.girth == pytest.approx(tangents + arcs, rel=3e-3)


def test_tape_around_a_circle_inside_is_as_long() -> None:
    vertices, faces = tube(np.array([0.05, 0.05]), np.array([0.0, 0.5]))
    level = cut(vertices, faces, 0.1 * UP, UP)
    assert girth_with_circle(level, np.zeros(2), 0.02) == pytest.approx(level.girth)
    assert girth_with_circle(level, np.array([0.06, 0.0]), 0.01) > level.girth + 0.01


def test_plane_beside_the_mesh_is_told() -> None:
    vertices, faces = tube(np.array([0.05, 0.05]), np.array([0.0, 0.5]))
    with pytest.raises(ValueError, match="misses"):
        cut(vertices, faces, 0.6 * UP, UP)
