from collections import Counter

import numpy as np

from drake_dress.learning.body.collapse import Collapse
from drake_dress.models.human.skin.skin import enclosed_volume


def half_ball(rings: int = 24) -> tuple[np.ndarray, np.ndarray, set[int]]:
    """Returns the half y ≥ 0 of a unit sphere: vertices, faces, and those with y = 0."""
    azimuth = np.linspace(0.0, np.pi, rings + 1)
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    grid = [
        [np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)] for t in polar for a in azimuth
    ]
    vertices = np.array([*grid, [0, 0, 1], [0, 0, -1]], dtype=float)
    vertices[np.abs(vertices[:, 1]) < 1e-9, 1] = 0.0
    wide, last = rings + 1, len(grid)
    faces = []
    for j in range(rings):
        faces += [[last, j, j + 1], [last + 1, last - wide + j + 1, last - wide + j]]
        for i in range(rings - 2):
            a, b, c, d = (k * wide + j + s for k in (i, i + 1) for s in (0, 1))
            faces += [[a, c, d], [a, d, b]]
    return vertices, np.array(faces), set(np.flatnonzero(vertices[:, 1] == 0.0))


def whole(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Returns the faces of both halves, with mirrored vertices behind the given ones."""
    image = np.where(vertices[:, 1] == 0.0, np.arange(len(vertices)), 0)
    image[vertices[:, 1] != 0.0] += len(vertices)
    image += np.where(vertices[:, 1] != 0.0, np.arange(len(vertices)), 0)
    return np.vstack([faces, image[faces][:, ::-1]])


def directed_edges(faces: np.ndarray) -> Counter[tuple[int, int]]:
    return Counter((int(f[k]), int(f[(k + 1) % 3])) for f in faces for k in range(3))


def test_surface_stays_closed_and_near_the_sphere() -> None:
    vertices, faces, middle = half_ball()
    before = enclosed_volume(vertices, faces)
    for tolerance in (2e-3, 1e-2):
        left = Collapse(vertices, faces, middle, np.full(len(vertices), tolerance)).run()
        assert len(left) < 0.8 * len(faces)
        edges = directed_edges(whole(vertices, left))
        assert set(edges.values()) == {1}
        assert all((b, a) in edges for a, b in edges)
        # Euler: a closed surface without handles
        count = len(np.unique(whole(vertices, left)))
        assert count - len(edges) // 2 + len(left) * 2 == 2
        assert abs(enclosed_volume(vertices, left) / before - 1.0) < 6.0 * tolerance


def test_more_tolerance_leaves_fewer_faces() -> None:
    vertices, faces, middle = half_ball()
    counts = [
        len(Collapse(vertices, faces, middle, np.full(len(vertices), t)).run())
        for t in (0.0, 1e-3, 3e-3, 1e-2)
    ]
    assert counts[0] == len(faces)
    assert counts == sorted(counts, reverse=True)
    assert len(set(counts)) == 4


def test_vertices_without_tolerance_stay() -> None:
    vertices, faces, middle = half_ball()
    tolerance = np.where(vertices[:, 2] > 0.0, 0.0, 1e-2)
    left = Collapse(vertices, faces, middle, tolerance).run()
    kept = set(np.unique(left))
    assert set(np.flatnonzero(vertices[:, 2] > 0.0)) <= kept
    assert len(kept) < 0.8 * len(vertices)


def test_plane_of_symmetry_stays_the_border() -> None:
    vertices, faces, middle = half_ball()
    left = Collapse(vertices, faces, middle, np.full(len(vertices), 1e-2)).run()
    edges = directed_edges(left)
    border = {v for a, b in edges if (b, a) not in edges for v in (a, b)}
    assert border <= middle
    assert len(border) < len(middle)
