"""Plausibility of a garment's shape: its size, its edges, and the held nodes.

With noise of standard deviation σ on each axis of each node, an edge of length L has the mean
square length L² + 6 σ², and hardly any edge is longer than L + 5 √2 σ √2. Cloth folds between
nodes, so an edge may be much shorter than its rest length, but it stretches only a little.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.remedies import COORDINATES, mistake

# Greatest lengthening due to noise among some thousand edges, in standard deviations.
_LONGEST = 10.0
# Share of too long edges above which the nodes are reported as out of order.
_OUT_OF_ORDER = 0.2


@dataclass(frozen=True)
class ShapeBounds:
    """Limits of a plausible garment shape.

    Attributes:
        edges: (E,2) nodes of each edge of the mesh.
        rest_length: (E,) m.
        grasp: nodes that the left and the right gripper hold.
        extent: diagonal of the box around the garment at rest, m.
        node_noise: standard deviation of a node on each axis, m.
        strain: greatest strain of an edge.
        least_edge: least root mean square length of the edges, as a share of that at rest.
        grasp_distance: greatest distance of the held nodes' centre from their gripper, m.
    """

    edges: IntArray
    rest_length: FloatArray
    grasp: tuple[IntArray, IntArray]
    extent: float
    node_noise: float = 0.01
    strain: float = 0.25
    least_edge: float = 0.6
    grasp_distance: float = 0.12

    @cached_property
    def longest(self) -> FloatArray:
        """(E,) greatest plausible length of each edge, m."""
        return (1.0 + self.strain) * self.rest_length + _LONGEST * self.node_noise

    @cached_property
    def mean_edge(self) -> tuple[float, float]:
        """Least and greatest root mean square length of the edges, m."""
        mean = float(np.sqrt(np.mean(self.rest_length**2)))
        noisy = np.sqrt(((1.0 + self.strain) * mean) ** 2 + 6.0 * self.node_noise**2)
        return self.least_edge * mean, float(noisy)


def impossible_shape(
    nodes: FloatArray, grippers: FloatArray | None, bounds: ShapeBounds
) -> str | None:
    """Returns why the nodes are impossible, with value and bound; None if they are plausible.

    Args:
        nodes: (n,3) finite, in the order of the mesh, m, world.
        grippers: (2,3) positions of left and right gripper, m; None if not known.
        bounds: limits of the garment's shape.
    """
    count, first = lost_nodes(nodes)
    if count:
        return (
            f"{count} of {len(nodes)} nodes at (0, 0, 0), as lost points written as zero, the "
            f"first is node {first}"
        )
    broken = _broken(nodes, grippers, bounds)
    if broken is None:
        return None
    why = mistake(nodes, lambda p: _broken(p, grippers, bounds) is None, COORDINATES)
    return broken if why is None else f"coordinates are {why}: {broken}"


def _broken(nodes: FloatArray, grippers: FloatArray | None, b: ShapeBounds) -> str | None:
    far = spread(nodes)
    allowed = (1.0 + b.strain) * b.extent + 5.0 * b.node_noise
    if far > allowed:
        return f"a node {far:.3g} m from the middle of all, expected {allowed:.2f} m at most"
    told = _edges_told(nodes, b)
    if told is not None or grippers is None:
        return told
    held = np.stack([nodes[grasp].mean(axis=0) for grasp in b.grasp])
    off = np.linalg.norm(held - grippers, axis=1)
    if (off <= b.grasp_distance).all():
        return None
    k = int(np.argmax(off))
    crossed = np.linalg.norm(held[::-1] - grippers, axis=1)
    why = "left and right are swapped: " if (crossed <= b.grasp_distance).all() else ""
    return (
        f"{why}nodes held by the {SIDES[k]} gripper {off[k]:.2f} m from it, expected "
        f"{b.grasp_distance:g} m at most"
    )


def _edges_told(nodes: FloatArray, b: ShapeBounds) -> str | None:
    """Returns which edges of nodes (n,3) are impossible; None if all are plausible."""
    mean_square, too_long, k = measure_edges(nodes, b.edges, b.longest)
    if too_long:
        length = np.linalg.norm(nodes[b.edges[k, 0]] - nodes[b.edges[k, 1]])
        share = too_long / len(b.edges)
        why = ""
        if share > _OUT_OF_ORDER:
            why = f", as are {100.0 * share:.0f} % of the edges: nodes in another order"
        return (
            f"edge between nodes {b.edges[k, 0]} and {b.edges[k, 1]} {length:.3g} m, expected "
            f"{b.longest[k]:.2f} m at most{why}"
        )
    mean, (low, high) = float(np.sqrt(mean_square)), b.mean_edge
    if low <= mean <= high:
        return None
    return f"edges {mean:.3g} m in the root mean square, expected {low:.3g} to {high:.3g} m"


# Compiled, because estimates come 50 times a second, to a process that has commands to send.


@nb.njit(cache=True, nogil=True)
def lost_nodes(nodes):  # type: ignore[no-untyped-def]
    """Returns how many of the nodes (n,3) are (0, 0, 0), and the first of them, −1 if none is."""
    count, first = 0, -1
    for i in range(len(nodes)):
        if nodes[i, 0] == 0.0 and nodes[i, 1] == 0.0 and nodes[i, 2] == 0.0:
            if count == 0:
                first = i
            count += 1
    return count, first


@nb.njit(cache=True, nogil=True)
def spread(nodes):  # type: ignore[no-untyped-def]
    """Returns the greatest distance of nodes (n,3) from their centre along any axis, m."""
    far = 0.0
    for a in range(3):
        total, low, high = 0.0, np.inf, -np.inf
        for i in range(len(nodes)):
            x = nodes[i, a]
            total += x
            low, high = min(low, x), max(high, x)
        mean = total / len(nodes)
        far = max(far, high - mean, mean - low)
    return far


@nb.njit(cache=True, nogil=True)
def measure_edges(nodes, edges, longest):  # type: ignore[no-untyped-def]
    """Returns the mean square length of edges, the number of too long ones, and the worst one.

    Args:
        nodes: (n,3) m.
        edges: (E,2) nodes of each edge.
        longest: (E,) greatest plausible length of each edge, m.
    """
    total, worst, at, count = 0.0, 0.0, -1, 0
    for k in range(len(edges)):
        i, j = edges[k, 0], edges[k, 1]
        square = 0.0
        for a in range(3):
            square += (nodes[i, a] - nodes[j, a]) ** 2
        total += square
        beyond = square - longest[k] ** 2
        if beyond > 0.0:
            count += 1
            if beyond > worst:
                worst, at = beyond, k
    return total / len(edges), count, at
