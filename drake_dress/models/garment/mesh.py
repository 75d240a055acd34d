"""A garment as a labelled triangle mesh, and what every such mesh must obey."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.errors import UserError
from drake_dress.models.sides import SIDES

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

# Gives a node or face its name in messages, such as the one it has in a file.
Named = Callable[[int], str]

REGION_NAMES = ("body", "left_sleeve", "right_sleeve", "collar")
LOOP_NAMES = ("left_armhole", "left_cuff", "right_armhole", "right_cuff")


@dataclass(frozen=True)
class GarmentMesh:
    """A garment at rest, with the openings and patches that dressing speaks of.

    Canonical rest pose of a coat: it faces +x, +y is its wearer's left, z is up, the hem is lowest,
    the sleeves point sideways and down; the origin is the midpoint between the shoulder tips.

    Attributes:
        rest_position: (n,3) float64, m.
        faces: (F,3) int32, counter-clockwise seen from outside.
        loops: node indices in order around each opening of `LOOP_NAMES`, the first not repeated.
        grasp: nodes held by each gripper, keys `left` and `right`.
        region: (n,) int8, index into `REGION_NAMES`.
    """

    rest_position: FloatArray
    faces: IntArray
    loops: dict[str, IntArray]
    grasp: dict[str, IntArray]
    region: npt.NDArray[np.int8]

    def scaled(self, factor: float) -> GarmentMesh:
        """Returns the same mesh with every length multiplied by `factor` about the origin.

        Raises:
            UserError: `factor` is not a positive finite number.
        """
        if not (np.isfinite(factor) and factor > 0):
            raise UserError("garment", "scale", f"is {factor}, expected a positive number")
        return replace(self, rest_position=self.rest_position * factor)

    def validate(self, source: str = "garment") -> None:
        """Checks all that the rest of the package relies on.

        Args:
            source: file or name put in front of the message.

        Raises:
            UserError: the mesh is empty, holds NaN or infinity, a face has no area, it is not a
                connected oriented manifold (see `check_manifold`), a loop is missing or is not a
                closed chain of edges, or a grasp patch or region is unusable.
        """
        check_positions(self.rest_position, source)
        n = len(self.rest_position)
        check_manifold(self.faces, n, source)
        areas = face_areas(self.rest_position, self.faces)
        flat = np.flatnonzero(areas < 1e-6 * np.mean(areas))
        if len(flat):
            raise UserError(
                source, "faces", f"{len(flat)} without area, the first is face {flat[0]}"
            )
        _check_loops(self.loops, self.faces, n, source)
        for side in SIDES:
            _check_indices(self.grasp.get(side), n, source, f"grasp.{side}")
        if self.region.shape != (n,):
            raise UserError(
                source, "region", f"has shape {self.region.shape}, expected ({n},) as the nodes"
            )
        if self.region.min() < 0 or self.region.max() >= len(REGION_NAMES):
            raise UserError(source, "region", f"holds values outside 0…{len(REGION_NAMES) - 1}")


def check_positions(position: FloatArray, source: str = "mesh") -> None:
    """Checks that there are nodes and that all are finite.

    Args:
        position: what should be (n,3), m.
        source: file or name put in front of the message.

    Raises:
        UserError: no nodes, another shape, NaN or infinity.
    """
    if position.size == 0:
        raise UserError(source, "nodes", "the mesh is empty, expected at least one triangle")
    if position.ndim != 2 or position.shape[1] != 3:
        raise UserError(source, "nodes", f"have shape {position.shape}, expected (n, 3)")
    bad = np.flatnonzero(~np.isfinite(position).all(axis=1))
    if len(bad):
        raise UserError(
            source,
            "nodes",
            f"{len(bad)} of {len(position)} hold NaN or infinity, the first is node {bad[0]}",
        )


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
        node: names nodes in messages.
        face: names faces in messages.

    Raises:
        UserError: no faces, an index out of range, a face that names a node twice, a face given
            twice, an edge of more than two faces, neighbours oriented against each other, nodes
            of no face, several components, or a node where two sheets only touch.
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


def check_loop(
    loop: IntArray,
    faces: IntArray,
    n: int,
    source: str,
    key: str,
    node: Named = plain_node,
) -> None:
    """Checks that nodes form a closed chain of edges of the mesh.

    Args:
        loop: node indices in order, the first not repeated.
        faces: (F,3) node indices.
        n: number of nodes.
        source: file or name put in front of the message.
        key: of the loop in the source, for the message.
        node: names nodes in messages.

    Raises:
        UserError: indices out of range or repeated, fewer than three, or no edge joins neighbours.
    """
    _check_indices(loop, n, source, key)
    if len(loop) < 3:
        raise UserError(source, key, f"has {len(loop)} nodes, expected at least 3")
    edges = unique_edges(faces).astype(np.int64) @ np.array([n, 1])
    pairs = np.sort(np.stack([loop, np.roll(loop, -1)], axis=1), axis=1).astype(np.int64)
    broken = np.flatnonzero(~np.isin(pairs @ np.array([n, 1]), edges))
    if len(broken):
        at = broken[0]
        raise UserError(
            source,
            key,
            f"is not a closed chain of mesh edges: no edge joins {node(loop[at])} and "
            f"{node(loop[(at + 1) % len(loop)])}",
        )


def unique_edges(faces: npt.NDArray[np.integer]) -> IntArray:
    """Returns (E,2) node indices of every edge once, the smaller first, in lexical order."""
    n = int(faces.max()) + 1
    key = np.sort(np.sort(half_edges(faces).astype(np.int64), axis=1) @ np.array([n, 1]))
    key = key[np.concatenate([[True], key[1:] > key[:-1]])]  # np.unique hashes: three times slower
    return np.stack([key // n, key % n], axis=1).astype(np.int32)


def components(faces: npt.NDArray[np.integer], n: int) -> IntArray:
    """Returns (n,) the number of the connected part that each node belongs to, from 0."""
    half = half_edges(faces)
    graph = coo_array((np.ones(len(half)), (half[:, 0], half[:, 1])), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int32)


def border_edges(faces: npt.NDArray[np.integer], n: int) -> npt.NDArray[np.int64]:
    """Returns (b,2) half-edges of faces that no half-edge of another face runs against.

    Args:
        faces: (F,3) node indices.
        n: number of nodes.
    """
    half = half_edges(faces).astype(np.int64)
    inner = np.isin(half[:, 0] * n + half[:, 1], half[:, 1] * n + half[:, 0])
    return np.asarray(half[~inner])


def boundary_loops(faces: npt.NDArray[np.integer]) -> list[IntArray]:
    """Returns each boundary as node indices in order, the longest first.

    The order is that of the faces' own half-edges: the garment lies to the left of the walk.
    Each loop begins at its smallest index.

    Args:
        faces: (F,3) node indices of a manifold.

    Raises:
        UserError: boundaries meet in a node, so that they cannot be told apart.
    """
    border = border_edges(faces, int(faces.max()) + 1)
    if len(np.unique(border[:, 0])) < len(border):
        raise UserError("mesh", "faces", "boundaries meet in a node (the mesh is not manifold)")
    following = dict(zip(border[:, 0].tolist(), border[:, 1].tolist(), strict=True))
    loops: list[IntArray] = []
    while following:
        start = min(following)
        loop = [start]
        node = following.pop(start)
        while node != start:
            loop.append(node)
            if node not in following:
                raise UserError("mesh", "faces", f"the boundary ends at node {node}")
            node = following.pop(node)
        loops.append(np.array(loop, dtype=np.int32))
    return sorted(loops, key=lambda loop: (-len(loop), int(loop[0])))


def face_areas(position: FloatArray, faces: npt.NDArray[np.integer]) -> FloatArray:
    """Returns (F,) areas, m²."""
    a, b, c = (position[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), dtype=np.float64)


def loop_length(position: FloatArray, loop: npt.NDArray[np.integer]) -> float:
    """Returns the length of a closed loop of nodes, m: a girth."""
    points = position[loop]
    return float(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).sum())


def edge_lengths(position: FloatArray, faces: npt.NDArray[np.integer]) -> FloatArray:
    """Returns (E,) lengths of `unique_edges`, m; their mean is the spacing of the mesh."""
    edges = unique_edges(faces)
    chord = position[edges[:, 0]] - position[edges[:, 1]]
    return np.asarray(np.linalg.norm(chord, axis=1), dtype=np.float64)


def half_edges(faces: npt.NDArray[np.integer]) -> npt.NDArray[np.integer]:
    """Returns (3F,2) the sides of all faces, each from node to node as its face turns."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


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
    """At each node of a manifold the faces form one fan: they hang together by their edges."""
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


def _check_loops(loops: dict[str, IntArray], faces: IntArray, n: int, source: str) -> None:
    missing = [name for name in LOOP_NAMES if name not in loops]
    if missing:
        raise UserError(source, "loops", f"{', '.join(missing)} missing, expected {LOOP_NAMES}")
    for name, loop in loops.items():
        check_loop(loop, faces, n, source, f"loops.{name}")


def _check_indices(indices: IntArray | None, n: int, source: str, key: str) -> None:
    if indices is None or len(indices) == 0:
        raise UserError(source, key, "is missing or empty, expected node indices")
    if indices.ndim != 1 or not np.issubdtype(indices.dtype, np.integer):
        raise UserError(source, key, "expected a list of node indices")
    if indices.min() < 0 or indices.max() >= n:
        raise UserError(
            source,
            key,
            f"node indices reach from {indices.min()} to {indices.max()}, expected 0 to {n - 1}",
        )
    if len(np.unique(indices)) < len(indices):
        raise UserError(source, key, "names a node twice, expected each once")
