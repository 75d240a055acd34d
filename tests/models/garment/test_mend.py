"""A mended surface is the sound one again: no face is lost, none is joined that was apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.edges import border_edges, components
from drake_dress.models.garment.files import RawMesh
from drake_dress.models.garment.load import MeshOptions, read_garment
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.mend import mended

COAT = make_coat(CoatParameters(), 0.05)
X, FACES = COAT.rest_position, COAT.faces.astype(np.int64)
seeds = st.integers(0, 2**32 - 1)


def raw(position: FloatArray, faces: np.ndarray) -> RawMesh:
    return RawMesh.of("coat", position, np.asarray(faces, dtype=np.int64))


def same_faces(found: np.ndarray, wanted: np.ndarray, oriented: bool = True) -> bool:
    """Returns whether faces are the same, apart from their order and first corner."""

    def canonical(faces: np.ndarray) -> set[tuple[int, ...]]:
        if not oriented:
            return {tuple(sorted(f)) for f in faces.tolist()}
        return {tuple(f[f.index(min(f)) :] + f[: f.index(min(f))]) for f in faces.tolist()}

    return canonical(found) == canonical(wanted)


def with_fin(
    rng: np.random.Generator, rows: int, height: float = 0.02
) -> tuple[FloatArray, np.ndarray, int]:
    """Returns nodes and faces of the coat with a fin on a chain of inner edges, and its faces."""
    inner = np.setdiff1d(np.arange(len(X)), border_edges(FACES, len(X)))
    start = int(rng.choice(inner))
    chain = [start]
    for _ in range(rows):
        around = np.unique(FACES[(FACES == chain[-1]).any(axis=1)])
        ahead = [int(q) for q in around if q in inner and q not in chain]
        if not ahead:
            break
        chain.append(int(rng.choice(ahead)))
    normal = X[chain] - X.mean(axis=0)
    top = X[chain] + height * normal / np.linalg.norm(normal, axis=1, keepdims=True)
    fin = []
    for k in range(len(chain) - 1):
        a, b = chain[k], chain[k + 1]
        c, d = len(X) + k, len(X) + k + 1
        fin += [[a, b, d], [a, d, c]]
    return np.concatenate([X, top]), np.concatenate([FACES, fin]), len(fin)


def test_sound_garment_is_left_alone() -> None:
    mesh = raw(X, FACES)
    found = mended(mesh)
    assert found.mesh is mesh
    assert found.notes == ()


@given(seeds, st.floats(0.0, 0.45))
def test_faces_wound_the_other_way_are_turned(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    faces = FACES.copy()
    wrong = rng.random(len(faces)) < share
    faces[wrong] = faces[wrong][:, ::-1]
    found = mended(raw(X, faces))
    assert same_faces(found.mesh.faces, FACES) or same_faces(found.mesh.faces, FACES[:, ::-1])
    check_manifold(found.mesh.faces, len(X))
    assert len(found.notes) == (1 if wrong.any() else 0)


@given(seeds, st.integers(1, 6))
def test_what_hangs_on_inner_edges_is_left_out_and_the_coat_is_whole(seed: int, rows: int) -> None:
    rng = np.random.default_rng(seed)
    position, faces, fin = with_fin(rng, rows)
    found = mended(raw(position, faces[rng.permutation(len(faces))]))
    check_manifold(found.mesh.faces, len(found.mesh.position))
    assert len(found.mesh.faces) == len(faces) - fin
    assert found.mesh.faces.shape == FACES.shape
    back = found.mesh.file_node[found.mesh.faces]
    assert same_faces(back, FACES) or same_faces(back, FACES[:, ::-1])
    assert "more than two faces" in found.notes[0]
    assert "left out" in found.notes[1]


@given(seeds, st.integers(1, 9))
def test_triangles_given_twice_are_kept_once(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    again = FACES[rng.choice(len(FACES), count, replace=False)]
    again = np.where(rng.random((count, 1)) < 0.5, again, again[:, [1, 0, 2]])
    found = mended(raw(X, np.concatenate([FACES, again])))
    assert same_faces(found.mesh.faces, FACES)
    assert found.notes[0].startswith(f"{count} triangles are given twice")


def test_sheets_that_touch_at_a_node_are_parted() -> None:
    # two sleeves' ends that share one node
    joined = FACES.copy()
    left, right = int(COAT.loops["left_cuff"][0]), int(COAT.loops["right_cuff"][0])
    joined[joined == right] = left
    found = mended(raw(X, joined).only(np.ones(len(joined), dtype=bool)))
    check_manifold(found.mesh.faces, len(found.mesh.position))
    assert len(found.mesh.position) == len(X)
    assert "1 nodes sheets only touch" in found.notes[0]


def test_two_layers_that_share_edges_and_one_sided_strips_are_refused() -> None:
    sleeve = np.flatnonzero((COAT.region[FACES] == 1).all(axis=1))
    doubled = FACES[sleeve].copy()
    inner = np.setdiff1d(np.unique(doubled), COAT.loops["left_cuff"])
    inner = np.setdiff1d(inner, np.unique(FACES[(COAT.region[FACES] != 1).any(axis=1)]))
    new = np.arange(len(X))
    new[inner] = len(X) + np.arange(len(inner))
    lining = raw(np.concatenate([X, X[inner] * 0.99]), np.concatenate([FACES, new[doubled]]))
    with pytest.raises(UserError, match="does not leave one layer of cloth"):
        mended(lining)
    angle = np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False)
    across = np.stack(
        [np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], 1
    )
    ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], 1)
    low, high = np.arange(20), 20 + np.arange(20)
    after_low, after_high = np.append(low[1:], high[0]), np.append(high[1:], low[0])
    strip = np.concatenate(
        [np.stack([low, after_low, high], 1), np.stack([after_low, after_high, high], 1)]
    )
    with pytest.raises(UserError, match="Möbius"):
        mended(raw(np.concatenate([ring - 0.2 * across, ring + 0.2 * across]), strip))


def test_a_large_part_is_not_left_out_without_a_word() -> None:
    position, faces, _ = with_fin(np.random.default_rng(2), 12, 0.8)
    with pytest.raises(
        UserError, match=r"of the cloth.*hangs on edges of more than two faces only"
    ):
        mended(raw(position, faces))


def test_every_third_face_doubled_is_no_small_place() -> None:
    position, faces = X, FACES
    for k in range(0, len(FACES), 3):
        a, b, _ = FACES[k]
        position = np.concatenate([position, [0.5 * (X[a] + X[b]) + [0.0, 0.0, 0.02]]])
        faces = np.concatenate([faces, [[a, b, len(position) - 1]]])
    with pytest.raises(UserError, match="expected one layer of cloth"):
        mended(raw(position, faces))


def test_loops_named_in_the_file_stay_on_the_garment_that_is_kept(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    position, faces, _ = with_fin(rng, 4)
    lines = [f"v {a} {b} {c}" for a, b, c in position]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path = tmp_path / "coat.obj"
    path.write_text("\n".join(lines) + "\n")
    loops = {name: loop.tolist() for name, loop in COAT.loops.items()}
    whole = read_garment(path, MeshOptions(loops=loops))
    for name, loop in COAT.loops.items():
        np.testing.assert_allclose(whole.position[whole.loops[name]], X[loop], atol=1e-9)
    assert len(whole.notes) == 2
    assert components(whole.faces, len(whole.position)).max() == 0
    assert replace(whole, notes=()).mesh().faces.shape == COAT.faces.shape
