import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.mesh import check_loop, edge_lengths, face_areas, loop_length
from drake_dress.models.garment.refine import refine
from drake_dress.models.garment.simplify import to_spacing

JACKET = make_coat(COATS["jacket"], 0.06)
LOOPS = list(JACKET.loops.values())


def with_fan(corners: int) -> tuple[FloatArray, IntArray]:
    """The jacket with a polygon at its hem, cut as a fan from one of its corners."""
    x, faces = JACKET.rest_position, JACKET.faces
    rim = boundary_loops(faces)[0]
    low = np.flatnonzero(x[rim, 2] < x[rim, 2].min() + 0.01)
    start = next(k for k in low if (np.isin(np.arange(k, k + corners), low)).all())
    run = rim[start : start + corners]
    fan = [(run[0], run[i + 1], run[i]) for i in range(1, corners - 1)]
    return x, np.vstack([faces, np.array(fan, dtype=faces.dtype)])


@settings(max_examples=25)
@given(st.floats(0.012, 0.2), st.integers(0, 8))
def test_refined_mesh_is_the_same_surface_with_short_edges(longest: float, corners: int) -> None:
    x, faces = with_fan(corners) if corners >= 3 else (JACKET.rest_position, JACKET.faces)
    fine, cut, loops = refine(x, faces, LOOPS, longest)
    n = len(fine)
    check_manifold(cut, n)
    assert edge_lengths(fine, cut).max() <= longest
    assert np.array_equal(fine[: len(x)], x)
    assert face_areas(fine, cut).sum() == pytest.approx(face_areas(x, faces).sum())
    before, after = boundary_loops(faces), boundary_loops(cut)
    assert len(before) == len(after)
    assert sum(loop_length(fine, q) for q in after) == pytest.approx(
        sum(loop_length(x, q) for q in before)
    )
    for old, new in zip(LOOPS, loops, strict=True):
        check_loop(new, cut, n, "loop", "")
        assert set(old.tolist()) <= set(new.tolist())
        assert loop_length(fine, new) == pytest.approx(loop_length(x, old))
    # a face of sides l and height h takes some l h / bound² pieces, and l / bound where it is thin
    sides = np.linalg.norm(x[faces] - x[np.roll(faces, -1, axis=1)], axis=2)
    cells = face_areas(x, faces) / longest**2 + (sides * (sides > longest)).sum(axis=1) / longest
    assert n - len(x) <= 4.0 * cells.sum()


def test_only_edges_that_are_too_long_are_cut() -> None:
    x, faces = with_fan(8)
    plain = edge_lengths(JACKET.rest_position, JACKET.faces).max()
    assert edge_lengths(x, faces).max() > 2.0 * plain
    fine, cut, _ = refine(x, faces, LOOPS, plain)
    old = {tuple(face) for face in JACKET.faces.tolist()}
    assert len(fine) < len(x) + 30
    # away from the fan all faces are as they were
    assert len(old & {tuple(face) for face in cut.tolist()}) > 0.97 * len(old)


def test_mesh_that_would_become_too_large_is_refused() -> None:
    with pytest.raises(UserError, match="over 5,000 nodes"):
        refine(JACKET.rest_position, JACKET.faces, LOOPS, 0.002, most_nodes=5000)


@settings(max_examples=8)
@given(st.floats(0.02, 0.08))
def test_spacing_is_met_beside_a_long_fan(spacing: float) -> None:
    x, faces = with_fan(8)
    position, cut, loops, became = to_spacing(x, faces, LOOPS, spacing)
    check_manifold(cut, len(position))
    length = edge_lengths(position, cut)
    assert 0.7 * spacing < length.mean() < 1.3 * spacing
    assert length.max() <= 1.5 * spacing + 1e-12
    assert became.shape == (len(x),)
    for loop in loops:
        check_loop(loop, cut, len(position), "loop", "")
