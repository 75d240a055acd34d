"""Contact detection at nodes, edge midpoints and face centroids.

The depth of an edge or face that comes too close is passed on to its nodes: if all nodes of the
element move out by that depth, so does the point. So contact is handled at the nodes, and a thin
hand cannot slip between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.distance import (
    distance_to,
    first_touch,
    may_touch,
    nearest_obstacle,
    surface_frame,
)
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.vectors import largest_length

# Gap, m, up to which a node rests on a surface while others are judged (nodes that slide on a round
# body keep up to 0.2 mm), and number of other nodes up to which all are taken to be contacts.
CLOSE, FEW = 3e-4, 20
# Depth, m, beyond which a node that was not in contact is added and the step is solved again, and
# the maximum number of such solves.
ENTERED, ATTEMPTS = 1e-6, 3
# Length of a path, m, on which no body can be passed unnoticed.
SHORT_WAY = 0.005
# A garment cannot land if it is farther from all bodies than `_REACH`, m, plus `_HASTE` times its
# path in a step, including its fall at `_FALL`, m/s².
_REACH, _HASTE, _FALL = 0.15, 2.0, 9.81
# Gap of nodes that are far from all bodies, m.
_FAR_GAP = 1e6
# Largest distance of a node in contact from the origin of a body, m.
_LARGEST_ARM = 1.0


@dataclass(frozen=True)
class Proximity:
    """Nearest obstacle of each node.

    Attributes:
        gap: (n,) distance less the margin, m; negative where the margin is entered.
        owner: (n,) nearest obstacle, -1 without any.
        normal: (n,3) outward unit; slope: (n,) such that the gap's gradient is slope · normal.
        surface_velocity: (n,3) m/s.
    """

    gap: FloatArray
    owner: IntArray
    normal: FloatArray
    slope: FloatArray
    surface_velocity: FloatArray


def out_of_reach(x: FloatArray, obstacles: Obstacles, distance: float) -> bool:
    """Returns whether all of `x` (n,3) is farther than `distance`, m, from everything.

    The test uses bounding boxes: False may be too careful, True is certain.
    """
    if obstacles.solids:
        return False
    o, plane = obstacles, obstacles.half_spaces
    return bool(_out_of_reach(x, o.a, o.b, o.radius, plane.point, plane.normal, distance))


def cannot_land(
    x: FloatArray, v: FloatArray, held_velocity: FloatArray, obstacles: Obstacles, time_step: float
) -> bool:
    """Returns whether no body is so near that a garment may touch it within a time step.

    Args:
        x: (n,3) positions of the nodes, m.
        v: (n,3) their velocities, m/s.
        held_velocity: (k,3) velocities of the held nodes, m/s.
        obstacles: bodies, with velocities.
        time_step: duration of the step, s.
    """
    speed = (
        fastest(obstacles)
        + max(largest_length(v), largest_length(held_velocity))
        + _FALL * time_step
    )
    return out_of_reach(x, obstacles, _REACH + _HASTE * time_step * speed)


def nothing_near(count: int) -> Proximity:
    """Returns `count` nodes that are far from everything."""
    return Proximity(
        np.full(count, _FAR_GAP),
        np.full(count, -1, dtype=np.int32),
        np.zeros((count, 3)),
        np.ones(count),
        np.zeros((count, 3)),
    )


def find_proximity(
    x: FloatArray,
    obstacles: Obstacles,
    margin: float | FloatArray,
    edge: IntArray | None = None,
    triangle: IntArray | None = None,
) -> Proximity:
    """Returns the nearest obstacle of each node, with the gap of edges and faces if given.

    Args:
        x: (n,3) positions, m.
        obstacles: bodies.
        margin: distance to keep, for all nodes or for each (n,), m.
        edge: (E,2) nodes of the edges.
        triangle: (F,3) nodes of the faces.
    """
    n = len(x)
    shapes = obstacles.packed
    gap = np.empty(n)
    owner = np.empty(n, dtype=np.int32)
    nearest_obstacle(x, shapes, gap, owner)
    if obstacles.count and edge is not None and triangle is not None:
        gap = _with_elements(x, shapes, edge, triangle, gap)
    return Proximity(gap - margin, owner, *surfaces_of(x, obstacles, owner))


def depth_of_elements(
    x: FloatArray, obstacles: Obstacles, edge: IntArray, triangle: IntArray
) -> FloatArray:
    """Returns (n,) by how much edges (E,2) and faces (F,3) are nearer than their nodes, m."""
    gap = np.empty(len(x))
    if not obstacles.count:
        return np.zeros(len(x))
    nearest_obstacle(x, obstacles.packed, gap, np.empty(len(x), dtype=np.int32))
    return gap - _with_elements(x, obstacles.packed, edge, triangle, gap)


def _with_elements(
    x: FloatArray, shapes: Any, edge: IntArray, triangle: IntArray, distance: FloatArray
) -> FloatArray:
    """Returns (n,) the least distance of each node and of the centres of its elements."""
    lent = distance.copy()
    # Only elements within their own size of a surface can enter it.
    _lend_depth(x, edge, shapes, distance, lent)
    _lend_depth(x, triangle, shapes, distance, lent)
    return lent


@dataclass(frozen=True)
class Contacts:
    """The nodes in contact during a step.

    Attributes:
        nodes: (c,) indices, ascending.
        gap: (c,) distance at the start of the step less the margin, m.
        owner: (c,) obstacle that is touched.
        normal: (c,3) outward unit; slope: (c,) such that the gap's gradient is slope · normal.
        surface_velocity: (c,3) m/s.
    """

    nodes: IntArray
    gap: FloatArray
    owner: IntArray
    normal: FloatArray
    slope: FloatArray
    surface_velocity: FloatArray

    def ahead(self, relative: FloatArray) -> FloatArray:
        """Returns the gap (c,) that is left after a motion (c,3) relative to the surface, m."""
        ahead: FloatArray = self.gap + np.einsum("ij,ij->i", self.normal, relative)
        return ahead

    def chosen(self, some: BoolArray) -> Contacts:
        """Returns the contacts where `some` (c,) is True."""
        if some.all():
            return self
        return Contacts(
            self.nodes[some],
            self.gap[some],
            self.owner[some],
            self.normal[some],
            self.slope[some],
            self.surface_velocity[some],
        )


NO_CONTACTS = Contacts(
    np.zeros(0, dtype=np.int32),
    np.zeros(0),
    np.zeros(0, dtype=np.int32),
    np.zeros((0, 3)),
    np.zeros(0),
    np.zeros((0, 3)),
)


def find_contacts(
    x: FloatArray,
    motion: FloatArray,
    obstacles: Obstacles,
    margin: float,
    time_step: float,
    excluded: BoolArray,
) -> Contacts:
    """Returns the nodes that lie in a margin, or would enter one by their `motion` (n,3), m.

    The body that a node meets is searched for along its path, so that a large step leaps over
    nothing. The body is replaced by the plane at the point nearest to the node's start.

    Args:
        x: (n,3) positions at the start of the step, m.
        motion: (n,3) displacement of the step without contact, m.
        obstacles: bodies at the start of the step, with velocities.
        margin: distance to keep, m.
        time_step: duration of the step, s.
        excluded: (n,) nodes that do not touch anything.
    """
    if not obstacles.count:
        return NO_CONTACTS
    shapes = obstacles.packed
    nodes, distance, owner = may_touch(
        x, motion, shapes, margin, time_step * fastest(obstacles), excluded
    )
    at = x[nodes]
    near = _contacts(at, nodes, distance, owner, obstacles, margin)
    relative = motion[nodes] - time_step * near.surface_velocity
    met = owner.copy()
    touched = _met_on_the_way(at, relative, near, shapes, margin, met)
    if np.any(met != owner):
        distance_to(at, shapes, met, distance)
        near = _contacts(at, nodes, distance, met, obstacles, margin)
        relative = motion[nodes] - time_step * near.surface_velocity
    touching = (near.gap < 0.0) | (touched & (near.ahead(relative) < 0.0))
    return near.chosen(touching)


def _met_on_the_way(
    at: FloatArray,
    relative: FloatArray,
    near: Contacts,
    shapes: Any,
    margin: float,
    met: IntArray,
) -> BoolArray:
    """Returns which nodes (c,) meet a body on their path; writes the body to `met` (c,).

    A node that ends inside the body that was nearest has met it. A node that moves little, ends
    outside all bodies and does not pass the plane of the nearest has met none. Only the paths of
    the others are followed.
    """
    distance, who = np.empty(len(at)), np.empty(len(at), dtype=np.int32)
    nearest_obstacle(at + relative, shapes, distance, who)
    inside = distance < margin
    far = np.einsum("ij,ij->i", relative, relative) > SHORT_WAY**2
    unclear = np.where(inside, who != near.owner, (near.ahead(relative) < 0.0) | far) & (
        near.gap > 0.0
    )
    touched: BoolArray = inside | (near.gap <= 0.0)
    if unclear.any():
        rows = np.flatnonzero(unclear)
        owners = met[rows]
        touched[rows] = first_touch(at[rows], relative[rows], shapes, margin, owners)
        met[rows] = owners
    return touched


def known_contacts(
    x: FloatArray, nodes: IntArray, owner: IntArray, obstacles: Obstacles, margin: float
) -> Contacts:
    """Returns contact of `nodes` (c,) with the obstacles `owner` (c,), at any distance."""
    distance = np.empty(len(nodes))
    distance_to(x[nodes], obstacles.packed, owner, distance)
    return _contacts(x[nodes], nodes, distance, owner, obstacles, margin)


def _contacts(
    at: FloatArray,
    nodes: IntArray,
    distance: FloatArray,
    owner: IntArray,
    obstacles: Obstacles,
    margin: float,
) -> Contacts:
    return Contacts(nodes, distance - margin, owner, *surfaces_of(at, obstacles, owner))


def surfaces_of(
    x: FloatArray, obstacles: Obstacles, owner: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns normals (k,3), slopes (k,) and velocities (k,3) of the owners' surfaces at `x`."""
    normal, slope, velocity = np.empty_like(x), np.empty(len(x)), np.empty_like(x)
    twists = obstacles.twists()
    surface_frame(x, obstacles.packed, obstacles.origins(), *twists, owner, normal, slope, velocity)
    return normal, slope, velocity


def fastest(obstacles: Obstacles) -> float:
    """Returns a bound on the speed of surfaces near the garment, m/s."""
    return float(_fastest(*obstacles.twists()))


@nb.njit(cache=True, nogil=True)
def _out_of_reach(x, a, b, radius, point, normal, distance):  # type: ignore[no-untyped-def]
    low, high = x[0].copy(), x[0].copy()
    for i in range(x.shape[0]):
        for c in range(3):
            low[c] = min(low[c], x[i, c])
            high[c] = max(high[c], x[i, c])
    for k in range(radius.shape[0]):
        apart2 = 0.0
        for c in range(3):
            below = min(a[k, c], b[k, c]) - high[c]
            above = low[c] - max(a[k, c], b[k, c])
            apart2 += max(below, above, 0.0) ** 2
        if apart2 <= (max(radius[k, 0], radius[k, 1]) + distance) ** 2:
            return False
    for k in range(point.shape[0]):
        height = 0.0
        for c in range(3):
            nearest = low[c] if normal[k, c] > 0.0 else high[c]
            height += (nearest - point[k, c]) * normal[k, c]
        if height <= distance:
            return False
    return True


@nb.njit(cache=True, nogil=True)
def _fastest(velocity, angular_velocity):  # type: ignore[no-untyped-def]
    most = 0.0
    for i in range(velocity.shape[0]):
        v, w = 0.0, 0.0
        for c in range(3):
            v += velocity[i, c] ** 2
            w += angular_velocity[i, c] ** 2
        most = max(most, np.sqrt(v) + _LARGEST_ARM * np.sqrt(w))
    return most


@nb.njit(cache=True, nogil=True)
def _lend_depth(x, element, shapes, distance, lent):  # type: ignore[no-untyped-def]
    corners = element.shape[1]
    near = np.empty(element.shape[0], dtype=np.int32)
    middle = np.empty((element.shape[0], 3))
    count = 0
    for e in range(element.shape[0]):
        least = 1e9
        for c in range(corners):
            least = min(least, distance[element[e, c]])
        i, j = element[e, 0], element[e, 1]
        size2 = (x[i, 0] - x[j, 0]) ** 2 + (x[i, 1] - x[j, 1]) ** 2 + (x[i, 2] - x[j, 2]) ** 2
        if least > 0.0 and least * least > size2:
            continue
        for k in range(3):
            middle[count, k] = 0.0
        for c in range(corners):
            for k in range(3):
                middle[count, k] += x[element[e, c], k] / corners
        near[count] = e
        count += 1
    depth = np.empty(count)
    # all at once, because neighbours mostly have the same nearest body
    nearest_obstacle(middle[:count], shapes, depth, np.empty(count, dtype=np.int32))
    for q in range(count):
        for c in range(corners):
            node = element[near[q], c]
            lent[node] = min(lent[node], depth[q])
