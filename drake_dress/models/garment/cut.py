"""Closed lines on a mesh that a plane cuts, and meshes that have such a line as edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.optimize
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.models.arrays import FloatArray, IndexArray, IntArray

# A point of a line that is nearer to an end of its edge than this share moves there.
_SNAP = 0.25
_TILT = 0.8  # largest angle by which the plane of the shortest line is searched, rad


@dataclass(frozen=True)
class Line:
    """A closed line of k points on edges of a mesh, in order.

    Attributes:
        edges: (k,2) ends of the edge of each point.
        share: (k,) where on its edge each point is: 0 at the first end, 1 at the second.
        points: (k,3), m.
    """

    edges: IndexArray
    share: FloatArray
    points: FloatArray

    @property
    def girth(self) -> float:
        """Length, m."""
        steps = self.points - np.roll(self.points, -1, axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())


def plane_line(
    x: FloatArray, faces: IntArray, point: npt.ArrayLike, normal: npt.ArrayLike
) -> Line | None:
    """Returns the closed line in a plane that comes nearest to a point; None if there is none.

    Args:
        x: (n,3), m.
        faces: (F,3) of a manifold.
        point: (3,) in the plane, m.
        normal: (3,) of the plane.
    """
    height = (x - np.asarray(point)) @ np.asarray(normal)
    above = height >= 0.0
    count = above[faces].sum(axis=1)
    crossed = faces[(count > 0) & (count < 3)]
    if len(crossed) == 0:
        return None
    # the two edges of each face that cross the plane join in the node on its own side
    single = above[crossed] == (above[crossed].sum(axis=1) == 1)[:, None]
    k = np.argmax(single, axis=1)
    rows = np.arange(len(crossed))
    lone, ahead, behind = (crossed[rows, (k + j) % 3].astype(np.int64) for j in range(3))
    n = len(x)
    keys = [np.minimum(lone, other) * n + np.maximum(lone, other) for other in (ahead, behind)]
    edge, which = np.unique(np.concatenate(keys), return_inverse=True)
    first, second = which.reshape(2, -1)
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(len(edge), len(edge)))
    _, label = connected_components(graph, directed=False)
    ends = np.stack([edge // n, edge % n], axis=1)
    share = height[ends[:, 0]] / (height[ends[:, 0]] - height[ends[:, 1]])
    points = x[ends[:, 0]] + share[:, None] * (x[ends[:, 1]] - x[ends[:, 0]])
    whole = np.bincount(label, np.bincount(which.reshape(-1)) != 2) == 0
    if not whole.any():
        return None
    off = np.where(whole[label], np.linalg.norm(points - np.asarray(point), axis=1), np.inf)
    chosen = label[np.argmin(off)]
    order = _walk(first, second, int(np.argmax(label == chosen)))
    return Line(ends[order], share[order], points[order])


def shortest_line(
    x: FloatArray, faces: IntArray, point: npt.ArrayLike, toward: npt.ArrayLike
) -> Line | None:
    """Returns the shortest closed line through a place of a tube; None if there is none.

    Args:
        x: (n,3), m.
        faces: (F,3) of a manifold.
        point: (3,) place on the tube, m.
        toward: (3,) about the direction of the tube.
    """
    axis = np.asarray(toward) / max(float(np.linalg.norm(toward)), 1e-12)
    aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    aside /= np.linalg.norm(aside)
    across = np.cross(axis, aside)

    def line(tilt: FloatArray) -> Line | None:
        return plane_line(
            x, faces, point, axis + np.tan(tilt[0]) * aside + np.tan(tilt[1]) * across
        )

    def girth(tilt: FloatArray) -> float:
        if np.abs(tilt).max() > _TILT:
            return 1e3
        found = line(tilt)
        return 1e3 if found is None else found.girth

    start = np.array([[0.0, 0.0], [0.3, 0.0], [0.0, 0.3]])
    best = scipy.optimize.minimize(
        girth,
        start[0],
        method="Nelder-Mead",
        options={"initial_simplex": start, "maxiter": 60, "xatol": 0.01, "fatol": 1e-4},
    )
    return line(best.x)


def cut_along(x: FloatArray, faces: IntArray, line: Line) -> tuple[FloatArray, IntArray, IntArray]:
    """Returns a mesh of the same surface that has a line as edges, and the nodes of the line.

    Old nodes keep their index and their place. The line is moved to nodes that are near.

    Args:
        x: (n,3), m.
        faces: (F,3) of a manifold.
        line: on the mesh.
    """
    node = np.where(line.share < _SNAP, line.edges[:, 0], -1)
    node = _without_returns(np.where(line.share > 1.0 - _SNAP, line.edges[:, 1], node))
    new = np.flatnonzero(node < 0)
    node[new] = len(x) + np.arange(len(new))
    position = np.concatenate([x, line.points[new]])
    for k in new:
        faces = _edge_parted(faces, line.edges[k], int(node[k]))
    loop = node[node != np.roll(node, 1)]
    return position, faces, loop.astype(np.int32)


def _without_returns(node: IndexArray) -> IndexArray:
    """Returns the nodes (k,) of a closed line, -1 for new ones, without ways from a node to itself.

    Of the points on the edges of one node, those at both ends may be moved to it, but not one in
    between.
    """
    node = node.copy()
    count = len(node)
    for old in np.unique(node[node >= 0]):
        at = np.flatnonzero(node == old)
        gaps = np.diff(np.append(at, at[0] + count))
        # the longest gap is the rest of the line
        after = at[(int(np.argmax(gaps)) + 1) % len(at)]
        node[(after + np.arange(count - int(gaps.max()) + 1)) % count] = old
    return node


def _walk(first: IndexArray, second: IndexArray, start: int) -> list[int]:
    """Returns the points of a closed line in order; pairs of `first` and `second` are next."""
    beside: dict[int, list[int]] = {}
    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    order, before, at = [start], -1, start
    while True:
        one, other = beside[at]
        before, at = at, (other if one == before else one)
        if at == start:
            return order
        order.append(at)


def _edge_parted(faces: IntArray, edge: IndexArray, node: int) -> IntArray:
    """Returns the faces with those at an edge parted by a node on it."""
    a, b = int(edge[0]), int(edge[1])
    at = np.flatnonzero((faces == a).any(axis=1) & (faces == b).any(axis=1))
    kept, added = faces.copy(), []
    for face in at:
        corners = faces[face]
        kept[face] = np.where(corners == a, node, corners)
        added.append(np.where(corners == b, node, corners))
    return np.concatenate([kept, np.array(added, dtype=faces.dtype).reshape(-1, 3)])
