"""Halves the edges of a mesh that are too long, and no others.

Every edge above the bound gets a node at its midpoint, and each face is cut at the nodes on its
sides. A face with one or two of them is cut from the midpoint of its longest side; a face with
three is cut into four similar triangles. Neighbours agree because they share the nodes. Cutting
the longest side first keeps angles from shrinking pass by pass (Rosenberg and Stenger 1975, "A
lower bound on the angles of triangles constructed by bisecting the longest side"). Passes repeat
until no edge is too long.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray, IntArray
from drake_dress.models.garment.edges import half_edges

MOST_NODES = 200_000  # of a refined mesh


def refine(
    position: FloatArray,
    faces: IntArray,
    loops: Sequence[IntArray],
    longest: float,
    most_nodes: int = MOST_NODES,
) -> tuple[FloatArray, IntArray, list[IntArray]]:
    """Returns the mesh with no edge above `longest`, and the loops through their new nodes.

    Old nodes keep their index, and new ones lie on the old surface.

    Args:
        position: (n,3), m.
        faces: (F,3) of an oriented manifold.
        loops: closed chains of edges, as node indices.
        longest: largest edge length, m.
        most_nodes: largest number of nodes of the result.

    Raises:
        UserError: the result would have more than `most_nodes` nodes.
    """
    kept = [np.asarray(loop, dtype=np.int32) for loop in loops]
    while True:
        n = len(position)
        half = np.sort(half_edges(faces).astype(np.int64), axis=1) @ np.array([n, 1])
        key, which = np.unique(half, return_inverse=True)
        start, end = key // n, key % n
        length = np.linalg.norm(position[start] - position[end], axis=1)
        long = length > longest
        count = int(np.count_nonzero(long))
        if count == 0:
            return position, faces, kept
        if n + count > most_nodes:
            raise UserError(
                "mesh",
                "spacing",
                f"edges up to {longest:.3g} m take over {most_nodes:,} nodes, expected a larger "
                "spacing",
            )
        middle = np.where(long, n + np.cumsum(long) - 1, -1)
        sides = which.reshape(3, -1).T  # (F,3): the edge from corner k to the next
        position = np.concatenate([position, 0.5 * (position[start] + position[end])[long]])
        faces = _cut(faces, middle[sides], length[sides])
        kept = [_through(loop, key, middle, n) for loop in kept]


def _cut(faces: IntArray, middle: IndexArray, length: FloatArray) -> IntArray:
    """Returns faces cut at the midpoints of their sides (-1: none), in the old faces' order."""
    rows = np.arange(len(faces))
    first = np.argmax(length, axis=1)  # rotate each face so that its longest side comes first
    a, b, c = (faces[rows, (first + k) % 3] for k in range(3))
    m, p, q = (middle[rows, (first + k) % 3] for k in range(3))
    on_ab, on_bc, on_ca = m >= 0, p >= 0, q >= 0
    pieces: list[tuple[BoolArray, Sequence[npt.NDArray[np.integer]]]] = [
        (~on_ab, (faces[:, 0], faces[:, 1], faces[:, 2])),
        (on_ab & ~on_ca, (a, m, c)),
        (on_ab & on_ca, (a, m, q)),
        (on_ab & ~on_bc, (m, b, c)),
        (on_ab & on_bc, (m, b, p)),
        (on_ab & on_bc & ~on_ca, (m, p, c)),
        (on_ab & on_ca & ~on_bc, (m, c, q)),
        (on_ab & on_bc & on_ca, (q, p, c)),
        (on_ab & on_bc & on_ca, (m, p, q)),
    ]
    cut = np.concatenate([np.stack(corners, axis=1)[chosen] for chosen, corners in pieces])
    owner = np.concatenate([rows[chosen] for chosen, _ in pieces])
    return np.asarray(cut[np.argsort(owner, kind="stable")], dtype=np.int32)


def _through(loop: IntArray, key: IndexArray, middle: IndexArray, n: int) -> IntArray:
    pair = np.sort(np.stack([loop, np.roll(loop, -1)], axis=1).astype(np.int64), axis=1)
    between = middle[np.searchsorted(key, pair @ np.array([n, 1]))]
    chain = np.stack([loop, between], axis=1).ravel()
    return np.asarray(chain[chain >= 0], dtype=np.int32)
