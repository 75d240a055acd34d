"""Checks that triangles form one connected, oriented manifold."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.errors import UserError
from drake_dress.models.garment.edges import components, half_edges

# Returns the name of a node or face for messages, such as its number in a file.
Named = Callable[[int], str]


def plain_node(i: int) -> str:
    """Returns the name of a node of a mesh that comes from no file."""
    return f"node {i}"


def plain_face(i: int) -> str:
    """Returns the name of a face of a mesh that comes from no file."""
    return f"face {i}"


def check_manifold(
    faces: npt.NDArray[np.integer],
    n: int,
    source: str = "mesh",
    node: Named = plain_node,
    face: Named = plain_face,
) -> None:
    """Checks that faces form one connected, consistently oriented manifold with boundary.

    Args:
        faces: (F,3) node indices.
        n: number of nodes.
        source: file or name put in front of the message.
        node: returns a node's name for messages.
        face: returns a face's name for messages.

    Raises:
        UserError: no faces, an index out of range, a face that names a node twice, a face given
            twice, an edge of more than two faces, neighbours of opposite orientation, nodes
            without a face, several components, or a node where two sheets only touch.
    """
    if faces.size == 0:
        raise UserError(source, "faces", "the mesh is empty, expected at least one triangle")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise UserError(source, "faces", f"have shape {faces.shape}, expected (F, 3)")
    if faces.min() < 0 or faces.max() >= n:
        raise UserError(
            source,
            "faces",
            f"node indices reach from {faces.min()} to {faces.max()}, expected 0 to {n - 1}",
        )
    twice = np.flatnonzero((faces == np.roll(faces, 1, axis=1)).any(axis=1))
    if len(twice):
        raise UserError(
            source,
            "faces",
            f"{len(twice)} are degenerate (name a node twice), the first is {face(twice[0])}",
        )
    _check_repeated(faces, source, face)
    _check_edges(faces, n, source, node)
    used = np.zeros(n, dtype=bool)
    used[faces] = True
    if not used.all():
        raise UserError(
            source,
            "nodes",
            f"{np.count_nonzero(~used)} belong to no face, the first is "
            f"{node(int(np.argmin(used)))}",
        )
    count = int(components(faces, n).max()) + 1
    if count > 1:
        raise UserError(
            source, "faces", f"the mesh falls into {count} separate parts, expected one"
        )
    _check_fans(faces, n, source, node)


def _check_repeated(faces: npt.NDArray[np.integer], source: str, face: Named) -> None:
    _, first, which, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    if len(first) < len(faces):
        again = int(np.setdiff1d(np.arange(len(faces)), first)[0])
        raise UserError(
            source,
            "faces",
            f"a triangle is given twice: {face(int(first[which.reshape(-1)[again]]))} and "
            f"{face(again)}; {np.count_nonzero(count > 1)} of {len(first)} are, expected each once",
        )


def _check_edges(faces: npt.NDArray[np.integer], n: int, source: str, node: Named) -> None:
    half = half_edges(faces).astype(np.int64)
    edge, count = np.unique(np.sort(half, axis=1) @ np.array([n, 1]), return_counts=True)
    if count.max() > 2:
        first = int(edge[np.argmax(count > 2)])
        raise UserError(
            source,
            "faces",
            f"not manifold: {np.count_nonzero(count > 2)} edges belong to more than two faces, "
            f"the first joins {node(first // n)} and {node(first % n)}",
        )
    directed, count = np.unique(half @ np.array([n, 1]), return_counts=True)
    if count.max() > 1:
        first = int(directed[np.argmax(count > 1)])
        raise UserError(
            source,
            "faces",
            f"{np.count_nonzero(count > 1)} pairs of neighbours are oriented against each other, "
            f"the first at {node(first // n)} and {node(first % n)}",
        )


def _check_fans(faces: npt.NDArray[np.integer], n: int, source: str, node: Named) -> None:
    """Checks that the faces at each node form one fan, connected by shared edges."""
    count = len(faces)
    half = half_edges(faces).astype(np.int64)
    corner = np.arange(3 * count).reshape(3, count)  # corner k of face f is entry (k, f)
    tail, head = corner.ravel(), np.roll(corner, -1, axis=0).ravel()
    forward, backward = half[:, 0] * n + half[:, 1], half[:, 1] * n + half[:, 0]
    _, here, there = np.intersect1d(forward, backward, assume_unique=True, return_indices=True)
    rows = np.concatenate([tail[here], head[here]])
    columns = np.concatenate([head[there], tail[there]])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(3 * count, 3 * count))
    fans, label = connected_components(graph, directed=False)
    if fans > n:
        of_fan = np.empty(fans, dtype=np.int64)
        of_fan[label] = faces.T.ravel()
        pinched = np.flatnonzero(np.bincount(of_fan, minlength=n) > 1)
        raise UserError(
            source,
            "faces",
            f"not manifold: at {len(pinched)} nodes two sheets only touch, "
            f"the first is {node(int(pinched[0]))}",
        )
