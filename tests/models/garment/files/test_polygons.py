import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.files.polygons import triangulated


def areas(x: FloatArray, faces: IndexArray) -> FloatArray:
    return np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])


def star(radii: FloatArray, tilt: float) -> FloatArray:
    """A polygon that is seen whole from the origin, in a tilted plane."""
    angle = np.linspace(0.0, 2 * np.pi, len(radii), endpoint=False)
    flat = np.stack([radii * np.cos(angle), radii * np.sin(angle), 0 * angle], axis=1)
    c, s = np.cos(tilt), np.sin(tilt)
    return flat @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T


@settings(max_examples=60)
@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=24), st.floats(-1.5, 1.5))
def test_triangles_cover_a_polygon_once_and_face_its_way(radii: list[float], tilt: float) -> None:
    x = star(np.array(radii), tilt)
    n = len(x)
    faces, owner = triangulated(x, [range(n)])
    assert faces.shape == (n - 2, 3)
    assert (owner == 0).all()
    away = x - x[0]
    whole = np.cross(away, np.roll(away, -1, axis=0)).sum(axis=0)
    parts = areas(x, faces)
    assert np.allclose(parts.sum(axis=0), whole)
    if n > 3 and np.linalg.norm(whole) > 1e-6:
        normal = whole / np.linalg.norm(whole)
        assert (parts @ normal >= -1e-9).all()
        # with all turned alike and the sum right, nothing is covered twice
        assert np.linalg.norm(parts, axis=1).sum() == pytest.approx(np.linalg.norm(whole))


def test_quads_are_cut_inside_and_along_the_shorter_diagonal() -> None:
    x = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0.5, 0.2, 0], [0, 3, 0]], dtype=float)
    concave, _ = triangulated(x, [[0, 1, 3, 4]])
    assert (areas(x, concave)[:, 2] > 0).all()
    kite = np.array([[0, 0, 0], [3, -0.5, 0], [6, 0, 0], [3, 0.5, 0]])
    faces, _ = triangulated(kite, [[0, 1, 2, 3]])
    assert all({1, 3} <= set(face) for face in faces.tolist())


@pytest.mark.parametrize("off", [0.0, 1e-7, -1e-7])
@pytest.mark.parametrize("start", range(4))
def test_a_quad_with_a_straight_corner_is_cut_there(off: float, start: int) -> None:
    # the diagonal that leaves the straight corner out is the shorter one
    x = np.array([[0, 0, 0], [1, off, 0], [2, 0, 0], [1.2, 3, 0]])
    quad = np.roll(np.arange(4), start).tolist()
    faces, _ = triangulated(x, [quad])
    assert np.linalg.norm(areas(x, faces), axis=1).min() > 1.0


def test_mixed_polygons_keep_their_order() -> None:
    x = star(np.ones(8), 0.0)
    faces, owner = triangulated(x, [[0, 1, 2], range(8), [0, 2, 4, 6], [5, 6, 7]])
    assert owner.tolist() == [0] + [1] * 6 + [2] * 2 + [3]
    assert faces[0].tolist() == [0, 1, 2]
    assert faces[-1].tolist() == [5, 6, 7]
