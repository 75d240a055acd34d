"""Leads layers back that have passed through each other.

Free nodes do not cross, but a gripper that presses a fold against the person can make crossing
unavoidable (`SeparationRecord.crossing`). Crossed layers would then stay crossed for ever, because
layers are kept on their current sides. So where edges pierce triangles, layers may pass each other
again. The smallest sufficient impulses lead them back at a given speed:

- each edge relative to the triangle that it pierces, in the direction that shortens the
  intersection contour of the layers (Volino and Magnenat-Thalmann, Resolving surface collisions
  through intersection contour minimization, 2006);
- stray nodes, back through the layer that they have passed: those that piercing edges cut off from
  most of the garment (as Baraff, Witkin and Kass, Untangling cloth, 2003).

No history is needed: contours and sides follow from the current positions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba as nb
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.layers.closest import NODE_TRIANGLE
from drake_dress.models.cloth.layers.neighbours import Pairs, Passing
from drake_dress.models.cloth.layers.passes import MOST_LEVER
from drake_dress.models.cloth.layers.piercing import (
    piercing_edges,
    piercings,
    told_apart,
    within_rings,
)

# Gradient of the contour length below which an edge is led back more slowly, as its direction is
# less certain.
_SURE = 0.5
# Rings of nodes around piercings within which stray nodes may pass, and which are searched for
# piercings after a step.
_AROUND = 2
# Passes of the projections that lead layers back.
_PASSES = 8


@dataclass(frozen=True)
class Tangle:
    """Piercings at one moment, and the stray nodes.

    Attributes:
        edge, triangle: (k,) edges and the triangles that they pierce.
        passing: layers that may pass through each other.
    """

    edge: IntArray
    triangle: IntArray
    passing: Passing


@dataclass(frozen=True)
class _Ways:
    """Differences of points of two layers, and their ways back.

    Attributes:
        node: (m,5); weights: (m,5), those of the second layer negative.
        direction: (m,3) of length 1; speed: (m,) as a share of the full speed.
    """

    node: IntArray
    weights: FloatArray
    direction: FloatArray
    speed: FloatArray


class Tangles:
    """Finds piercings of a mesh, and leads layers back.

    Args:
        elements: the mesh.
        rings: nodes joined by this many edges or fewer count as one layer, as in `LayerSeparation`.
    """

    def __init__(self, elements: Elements, rings: int = 1) -> None:
        self._elements = elements
        self._rings = rings
        self._opposite = _opposite_nodes(elements)

    def everywhere(self, x: FloatArray) -> BoolArray:
        """Returns (n,) which nodes belong to a piercing edge or triangle at `x` (n,3), m."""
        return self._nodes_of(piercing_edges(x, self._elements, self._rings))

    def near(self, x: FloatArray, tangled: BoolArray) -> BoolArray:
        """Returns the same, searched for only near the nodes `tangled` (n,).

        These are the result for the previous step, plus the nodes of pairs that the step did not
        keep apart (`SeparationRecord.unparted`): elsewhere no piercing can have begun.
        """
        return self._nodes_of(self._piercings(x, self._grown(tangled, _AROUND)))

    def at(self, x: FloatArray, tangled: BoolArray) -> Tangle:
        """Returns the tangle at `x` (n,3), m, of nodes (n,) from `everywhere` or `near`."""
        found = self._piercings(x, tangled)
        around = self._grown(tangled, _AROUND)
        # Nodes further in follow by themselves: a cut-off sleeve is not drawn back as a whole.
        astray = self._astray(found[:, 0]) & around
        return Tangle(found[:, 0], found[:, 1], Passing(tangled, astray, around))

    def lead_back(
        self,
        tangle: Tangle,
        x: FloatArray,
        dx: FloatArray,
        inverse_mass: FloatArray,
        barred: FloatArray,
        pairs: Pairs,
        step: float,
    ) -> FloatArray:
        """Returns a displacement (n,3), m, that leads piercing layers and stray nodes back.

        Args:
            tangle: tangle at x.
            x: (n,3) positions at the start of the step, m.
            dx: (n,3) displacement that a scheme proposes, m.
            inverse_mass: (n,) 1/kg, 0 for nodes that must not be moved.
            barred: (n,3) unit directions along which nodes may not be moved, or zero.
            pairs: pairs that are near each other at x.
            step: distance by which layers are led back, m.
        """
        ways = _together(self._shorter(x, tangle), _back_through(tangle, pairs))
        bar = barred[ways.node]
        across = np.einsum("mij,mj->mi", bar, ways.direction)
        push = ways.direction[:, None, :] - across[:, :, None] * bar
        push *= (inverse_mass[ways.node] * ways.weights)[:, :, None]
        mobility = np.einsum("mi,mij,mj->m", ways.weights, push, ways.direction)
        furthest = np.abs(inverse_mass[ways.node] * ways.weights).max(axis=1, initial=0.0)
        push /= np.maximum(mobility, 1e-300)[:, None, None]
        push[(mobility <= 0.0) | (furthest > MOST_LEVER * mobility)] = 0.0
        moved = dx.copy()
        _project(ways.node, ways.weights, ways.direction, push, step * ways.speed, _PASSES, moved)
        return moved

    def _shorter(self, x: FloatArray, tangle: Tangle) -> _Ways:
        """Returns the ways that shorten the intersection contours."""
        e = self._elements
        rows = [
            self.meeting(x, int(k), int(t))
            for k, t in zip(tangle.edge, tangle.triangle, strict=True)
        ]
        weights = np.array([row[0] for row in rows]).reshape(-1, 5)
        way = np.array([row[1] for row in rows]).reshape(-1, 3)
        node = np.concatenate([e.edge[tangle.edge], e.triangle[tangle.triangle]], axis=1)
        length = np.linalg.norm(way, axis=1)
        direction = way / np.maximum(length, 1e-300)[:, None]
        return _Ways(node, weights, direction, length / np.sqrt(length**2 + _SURE**2))

    def meeting(self, x: FloatArray, k: int, t: int) -> tuple[FloatArray, FloatArray]:
        """Returns where edge k pierces triangle t, and the direction in which the edge should go.

        Returns:
            (5,) weights of the nodes of both in the difference of the points that meet; (3,) minus
            the gradient of the contour length by this difference, for rigid layers.
        """
        e = self._elements
        p, q = x[e.edge[k]]
        corner = x[e.triangle[t]]
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        normal /= np.linalg.norm(normal)
        along = q - p
        share = float(normal @ (corner[0] - p)) / float(normal @ along)
        point = p + share * along
        direction = along / np.linalg.norm(along)
        way = np.zeros(3)
        for other in self._opposite[k]:
            if other < 0:
                continue
            inward = x[other] - p
            inward = inward - direction * float(direction @ inward)
            line = np.cross(normal, np.cross(along, inward))
            length = float(np.linalg.norm(line))
            if length == 0.0:
                continue
            line *= np.copysign(1.0 / length, float(line @ inward))
            way += 0.5 * line - float(direction @ line) / float(direction @ normal) * normal
        return np.concatenate([[1.0 - share, share], -_barycentric(point, corner)]), way

    def _astray(self, edge: IntArray) -> BoolArray:
        """Returns (n,) which nodes edges (k,) cut off from most of their piece of the garment."""
        n, edges = self._elements.node_count, self._elements.edge
        astray = np.zeros(n, dtype=np.bool_)
        if not len(edge):
            return astray
        whole = _pieces(n, edges)
        left = _pieces(n, np.delete(edges, edge, axis=0))
        size = np.bincount(left)
        largest = np.zeros(whole.max() + 1, dtype=np.int64)
        np.maximum.at(largest, whole, size[left])
        return size[left] < largest[whole]

    def _piercings(self, x: FloatArray, marked: BoolArray) -> IntArray:
        """Returns (k,2) piercing edges and triangles, among those with all nodes marked."""
        e = self._elements
        edge = np.flatnonzero(marked[e.edge].all(axis=1))
        triangle = np.flatnonzero(marked[e.triangle].all(axis=1))
        found = piercings(x, e.edge[edge], e.triangle[triangle])
        found = np.stack([edge[found[:, 0]], triangle[found[:, 1]]], axis=1)
        return found[told_apart(found, e, self._reach)]

    @cached_property
    def _reach(self) -> list[IntArray]:
        """Rings of each node; computed on demand, because few garments need them."""
        return within_rings(self._elements, self._rings)

    def _grown(self, marked: BoolArray, rings: int) -> BoolArray:
        edge = self._elements.edge
        for _ in range(rings if marked.any() else 0):
            more = marked.copy()
            more[edge[marked[edge].any(axis=1)]] = True
            marked = more
        return marked

    def _nodes_of(self, found: IntArray) -> BoolArray:
        marked = np.zeros(self._elements.node_count, dtype=np.bool_)
        marked[self._elements.edge[found[:, 0]]] = True
        marked[self._elements.triangle[found[:, 1]]] = True
        return marked


def _back_through(tangle: Tangle, pairs: Pairs) -> _Ways:
    """Returns the ways of stray nodes, and of their triangles, back through the layer near them."""
    p = tangle.passing
    node, triangle = p.astray[pairs.node[:, 0]], p.astray[pairs.node[:, 1:]].any(axis=1)
    # if both parts are astray, they are on their right sides of each other
    chosen = (pairs.kind == NODE_TRIANGLE) & (node != triangle) & p.around[pairs.node].all(axis=1)
    nodes, weights = pairs.node[chosen], pairs.weights[chosen]
    # five nodes, as for edge and triangle; one has no weight
    return _Ways(
        np.concatenate([nodes, nodes[:, :1]], axis=1),
        np.concatenate([weights, np.zeros((len(nodes), 1))], axis=1),
        -pairs.direction[chosen],
        np.ones(len(nodes)),
    )


def _together(one: _Ways, other: _Ways) -> _Ways:
    both = zip(vars(one).values(), vars(other).values(), strict=True)
    return _Ways(*(np.concatenate(arrays) for arrays in both))


def _pieces(n: int, edge: IntArray) -> IntArray:
    """Returns (n,) the number of the piece that each node belongs to."""
    graph = coo_array((np.ones(len(edge)), (edge[:, 0], edge[:, 1])), shape=(n, n))
    piece: IntArray = connected_components(graph, directed=False)[1]
    return piece


def _opposite_nodes(e: Elements) -> IntArray:
    """Returns (E,2) the third nodes of the triangles at each edge, -1 where there is none."""
    side = np.concatenate([e.triangle[:, [0, 1]], e.triangle[:, [1, 2]], e.triangle[:, [2, 0]]])
    third = np.concatenate([e.triangle[:, 2], e.triangle[:, 0], e.triangle[:, 1]])
    n = e.node_count
    key = np.sort(e.edge, axis=1) @ [n, 1]
    order = np.argsort(key)
    row = order[np.searchsorted(key[order], np.sort(side, axis=1) @ [n, 1])]
    opposite = np.full((len(e.edge), 2), -1, dtype=np.int32)
    by_row = np.argsort(row, kind="stable")
    row, third = row[by_row], third[by_row]
    second = np.zeros(len(row), dtype=np.int64)
    second[1:] = row[1:] == row[:-1]
    opposite[row, second] = third
    return opposite


def _barycentric(point: FloatArray, corner: FloatArray) -> FloatArray:
    """Returns the weights (3,) of a triangle's corners (3,3) at a point (3,) in its plane."""
    u, v, w = corner[1] - corner[0], corner[2] - corner[0], point - corner[0]
    uu, uv, vv, wu, wv = u @ u, u @ v, v @ v, w @ u, w @ v
    scale = 1.0 / (uu * vv - uv * uv)
    second, third = (vv * wu - uv * wv) * scale, (uu * wv - uv * wu) * scale
    return np.array([1.0 - second - third, second, third])


@nb.njit(cache=True, nogil=True)
def _project(node, weights, direction, push, wanted, passes, dx):  # type: ignore[no-untyped-def]
    """Moves `dx` (n,3), m, in place until each way reaches the wanted distance (m,), m.

    Ways are treated one after the other, each by a projection onto a half-space. So conflicting
    ways move their shared nodes to and fro, but never further.
    """
    for _ in range(passes):
        for m in range(wanted.shape[0]):
            going = 0.0
            for k in range(node.shape[1]):
                i = node[m, k]
                going += weights[m, k] * (
                    direction[m, 0] * dx[i, 0]
                    + direction[m, 1] * dx[i, 1]
                    + direction[m, 2] * dx[i, 2]
                )
            lack = wanted[m] - going
            if lack <= 0.0:
                continue
            for k in range(node.shape[1]):
                for c in range(3):
                    dx[node[m, k], c] += lack * push[m, k, c]
