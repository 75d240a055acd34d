"""The flat shape does not depend on how a pattern is laid out, and tells the mesh's strain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.flat import FAR, check_pattern, flat_shape


def grid(columns: int, rows: int, step: float = 0.05) -> tuple[FloatArray, IntArray]:
    """Returns nodes (n,2), m, and triangles of a rectangle."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    node = np.arange(columns * rows).reshape(columns, rows)
    a, b, c, d = (
        node[:-1, :-1].ravel(),
        node[1:, :-1].ravel(),
        node[1:, 1:].ravel(),
        node[:-1, 1:].ravel(),
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    nodes: FloatArray = step * np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64)
    return nodes, faces.astype(np.int32)


def rolled(flat: FloatArray, radius: float = 0.15) -> FloatArray:
    """Returns (n,3) a sheet around a cylinder, without strain."""
    angle = flat[:, 0] / radius
    return np.stack([radius * np.sin(angle), flat[:, 1], radius * np.cos(angle)], axis=1)


def two_islands(uv: FloatArray, faces: IntArray, scales: tuple[float, float]) -> FloatArray:
    """Returns (F,3,2) texture coordinates whose halves are apart, and each of its own scale."""
    right = uv[faces].mean(axis=1)[:, 0] > uv[:, 0].mean()
    size = np.where(right, scales[1], scales[0])[:, None, None]
    return size * (uv[faces] + np.where(right, 5.0, 0.0)[:, None, None])


FLAT, FACES = grid(13, 9)
# the chord of a step of 5 cm on a radius of 15 cm is 0.46 % shorter than the arc
CHORD = -np.log(0.15 / 0.05 * 2.0 * np.sin(0.05 / 0.15 / 2.0))


def raw(position: FloatArray, uv: FloatArray | None, faces: IntArray = FACES) -> RawMesh:
    return RawMesh.of("sheet.obj", position, faces.astype(np.int64), uv=uv)


@settings(max_examples=20, deadline=None)
@given(
    scales=st.tuples(st.floats(1e-4, 1e4), st.floats(1e-4, 1e4)),
    angle=st.floats(0.0, 6.3),
    mirrored=st.booleans(),
    shift=st.floats(-10.0, 10.0),
)
def test_scale_turn_mirror_and_place_of_the_islands_do_not_matter(
    scales: tuple[float, float], angle: float, mirrored: bool, shift: float
) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    if mirrored:
        turn = turn @ np.diag([-1.0, 1.0])
    plain = flat_shape(raw(rolled(FLAT), two_islands(FLAT, FACES, (1.0, 1.0))))
    other = flat_shape(
        raw(rolled(FLAT), two_islands(FLAT, FACES, scales) @ turn.T + shift * min(scales))
    )
    assert other.islands == plain.islands == 2
    np.testing.assert_allclose(sides(other.corners), sides(plain.corners), rtol=1e-6)
    np.testing.assert_allclose(other.strain, plain.strain, atol=1e-6)


def sides(corners: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2))


def test_a_rolled_sheet_is_strained_by_its_chords_alone() -> None:
    flat = flat_shape(raw(rolled(FLAT), FLAT[FACES]))
    assert flat.median <= CHORD
    assert flat.is_pattern
    np.testing.assert_allclose(sides(flat.corners), sides(FLAT[FACES]), rtol=CHORD)


@settings(max_examples=20, deadline=None)
@given(along=st.floats(-0.2, 0.2), shear=st.floats(-0.05, 0.05))
def test_strain_is_that_of_the_mesh_up_to_the_size_of_the_island(
    along: float, shear: float
) -> None:
    stretch = np.array([[np.exp(along), shear], [0.0, np.exp(-along)]])
    mesh = np.column_stack([FLAT @ stretch.T, np.zeros(len(FLAT))])
    wanted = np.abs(np.log(np.linalg.svd(stretch, compute_uv=False))).max()
    for size in (1.0, 30.0):
        flat = flat_shape(raw(size * mesh, FLAT[FACES]))
        np.testing.assert_allclose(flat.strain, wanted, atol=1e-9)


def test_a_few_wild_triangles_keep_their_own_shape_and_do_not_change_the_rest() -> None:
    uv = FLAT[FACES].copy()
    uv[[5, 40], :, 0] *= 7.0
    uv[[60]] = 0.0
    flat = flat_shape(raw(rolled(FLAT), uv))
    assert set(np.flatnonzero(flat.strain > FAR)) == {5, 40, 60}
    assert flat.is_pattern
    np.testing.assert_allclose(sides(flat.corners), sides(FLAT[FACES]), rtol=0.01)


@pytest.mark.parametrize("aspect", [2.0, 0.3])
def test_what_is_no_pattern_is_refused_with_figures(aspect: float) -> None:
    uv = FLAT[FACES] * [1.0, aspect]
    flat = flat_shape(raw(rolled(FLAT), uv))
    with pytest.raises(UserError, match=r"rest.*1 islands.*differ from it by \d+ %.*or mesh"):
        check_pattern(flat, "sheet.obj")


def test_missing_texture_coordinates_are_told() -> None:
    with pytest.raises(UserError, match=r"rest.*no texture coordinates, expected mesh"):
        flat_shape(raw(rolled(FLAT), None))
    uv = FLAT[FACES].copy()
    uv[[7, 9], 1] = np.nan
    with pytest.raises(UserError, match=r"2 of 192 triangles.*the first is face 7"):
        flat_shape(raw(rolled(FLAT), uv))
