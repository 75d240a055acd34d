"""Where a garment opens: at the front like a coat, at the back like a hospital gown, or not at all.

The rim of an open garment is one border that runs along the hem, up one edge, around the neck and
down the other edge. It follows the faces, so the cloth lies to its left, and the hem is walked from
above counter-clockwise. A coat's hem begins at the left front edge: it passes the left side, the
back, and then the right side. The hem of a gown passes the right side first. Sides are told by the
nearer armhole along the cloth, so the garment may lie flat, or its edges may overlap.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray, IntArray
from drake_dress.models.garment.edges import boundary_loops, unique_edges
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES

Opening = Literal["front", "back", "closed"]

# Heights, in shares of that of the shoulder tips above the hem, that a rim reaches: below the
# underarm, and up to the neck. A neckline ends above the first, and a vent in a hem below the
# second.
_LOW, _HIGH = 0.25, 0.75


def front_of(mesh: GarmentMesh) -> Opening:
    """Returns where the garment opens from neck to hem: at the `front`, at the `back`, or `closed`.

    A garment is `closed` if neck and hem are different openings, as of a pullover.

    Args:
        mesh: the garment in its canonical rest pose.
    """
    rim = rim_of(mesh)
    if rim is None:
        return "closed"
    is_left = left_half(mesh)[rim]
    changes = side_changes(is_left)
    if len(changes) == 0:
        return "closed"
    # the lowest change of sides is at the hem, opposite to the opening
    at = changes[np.argmin(mesh.rest_position[rim[changes], 2])]
    return "front" if is_left[at] else "back"


def left_half(mesh: GarmentMesh) -> BoolArray:
    """Returns (n,) which nodes are nearer to the left armhole than to the right, on the cloth."""
    left, right = (_way_to(mesh, mesh.loops[f"{side}_armhole"]) for side in SIDES)
    return np.asarray(left < right)


def side_changes(is_left: BoolArray) -> IndexArray:
    """Returns the places of a closed way after which it changes sides.

    Args:
        is_left: (k,) which nodes of the way are in the left half.
    """
    return np.flatnonzero(is_left != np.roll(is_left, -1))


def rim_of(mesh: GarmentMesh) -> IntArray | None:
    """Returns the nodes of the border that runs from the neck to the hem; None if there is none."""
    cuffs = np.concatenate([mesh.loops[f"{side}_cuff"] for side in SIDES])
    z = mesh.rest_position[:, 2]
    height = (z - z.min()) / max(float(-z.min()), 1e-9)  # the shoulder tips are at z = 0
    for loop in boundary_loops(mesh.faces):
        if np.isin(loop, cuffs).any():
            continue
        if height[loop].min() < _LOW and height[loop].max() > _HIGH:
            return loop
    return None


def _way_to(mesh: GarmentMesh, loop: IntArray) -> FloatArray:
    """Returns the distance (n,) of each node from a loop along the edges, m."""
    x, edges = mesh.rest_position, unique_edges(mesh.faces)
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    graph = csr_array((length, (edges[:, 0], edges[:, 1])), shape=(len(x), len(x)))
    way: FloatArray = dijkstra(graph, directed=False, indices=loop, min_only=True)
    return way
