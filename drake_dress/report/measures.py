"""Measures at every sample of a log, on which the summary and the report are based."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray, IntArray
from drake_dress.models.cloth.contact.distance import nearest_obstacle
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.dressing.linking import arm_linking_number
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

# The arm's line is closed through a point in the trunk, this far below the shoulders' midpoint.
_INTERIOR_BELOW_SHOULDERS = 0.1  # m
EDGE_QUANTILE = 0.99  # quantile of the edge strains, reported as "99 % of the edges"


@dataclass(frozen=True)
class Measures:
    """Series over the T samples of a log; the second axis is left, right.

    Attributes:
        finite: (T,) whether every node and force is finite. If not, the other series are NaN or 0.
        linking: (T,2) linking number of the armhole loop and the arm's line.
        cuff_linking: (T,2) linking number of the cuff loop and the arm's line.
        edge_strain: (T,) 99th percentile over the edges of length / rest length - 1; signed,
            since a shortened edge represents wrinkles below mesh resolution.
        edge_strain_max: (T,) largest strain of an edge.
        penetration: (T,) greatest depth of nodes, edge midpoints and face centroids in the
            person's capsules, m; 0 if nothing penetrates.
        gripper_force: (T,2) magnitude, N.
        node_contact_force: (T,) largest magnitude at one node, N.
        total_contact_force: (T,) sum of the nodes' magnitudes, N.
    """

    finite: BoolArray
    linking: IndexArray
    cuff_linking: IndexArray
    edge_strain: FloatArray
    edge_strain_max: FloatArray
    penetration: FloatArray
    gripper_force: FloatArray
    node_contact_force: FloatArray
    total_contact_force: FloatArray

    def inserted_since(self, side: int) -> int | None:
        """Returns the first sample from which the arm stays in the armhole; None if never."""
        return first_lasting(np.abs(self.linking[:, side]) == 1)


def measure(log: RunLog) -> Measures:
    """Computes the measures of a log from its garment nodes and person capsules."""
    count = len(log)
    edges = unique_edges(log.faces)
    rest = np.linalg.norm(np.subtract(*log.rest_position[edges.T]), axis=1)
    a, b, radius = log.capsules

    finite = np.zeros(count, dtype=bool)
    linking = np.zeros((count, 2, 2), dtype=np.int64)
    strain, strain_max, penetration = np.full((3, count), np.nan)
    node_force, total_force = np.zeros((2, count))
    force = np.stack([np.linalg.norm(log.gripper_force[side], axis=1) for side in SIDES], axis=1)
    for i in range(count):
        x = log.garment_position(i)
        contact = log.contact_force(i)
        if contact is not None:
            size = np.linalg.norm(contact, axis=1)
            node_force[i], total_force[i] = size.max(initial=0.0), size.sum()
        # a station without truth reports no force while an arm sends no messages
        known = log.estimated or bool(np.isfinite(force[i]).all())
        finite[i] = bool(np.isfinite(x).all()) and known
        if not finite[i]:
            continue
        stretch = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1) / rest - 1.0
        strain[i], strain_max[i] = np.quantile(stretch, EDGE_QUANTILE), stretch.max()
        penetration[i] = penetration_depth(x, log.faces, edges, a[i], b[i], radius)
        joints = log.joint_position[i]
        interior = 0.5 * (joints[0] + joints[3]) - [0.0, 0.0, _INTERIOR_BELOW_SHOULDERS]
        for k, side in enumerate(SIDES):
            shoulder, elbow, hand = joints[3 * k : 3 * k + 3]
            for m, opening in enumerate(("armhole", "cuff")):
                loop = x[log.loops[f"{side}_{opening}"]]
                linking[i, m, k] = arm_linking_number(loop, shoulder, elbow, hand, interior)
    return Measures(
        finite=finite,
        linking=linking[:, 0],
        cuff_linking=linking[:, 1],
        edge_strain=strain,
        edge_strain_max=strain_max,
        penetration=penetration,
        gripper_force=force,
        node_contact_force=node_force,
        total_contact_force=total_force,
    )


def unique_edges(faces: IntArray) -> IndexArray:
    """Returns the unique edges (E,2) of triangles (F,3)."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(pairs.astype(np.int64), axis=1), axis=0)


def penetration_depth(
    position: FloatArray,
    faces: IntArray,
    edges: IndexArray,
    a: FloatArray,
    b: FloatArray,
    radius: FloatArray,
) -> float:
    """Returns the greatest depth of nodes, edge midpoints and centroids in capsules, m; or 0.

    Args:
        position: (n,3) nodes, m.
        faces: (F,3) node indices.
        edges: (E,2) node indices.
        a: (c,3) first ends of the capsules, m.
        b: (c,3) second ends of the capsules, m.
        radius: (c,2) radii of the capsules at both ends, m.
    """
    x = position.astype(np.float64)
    middles = 0.5 * (x[edges[:, 0]] + x[edges[:, 1]])
    centroids = (x[faces[:, 0]] + x[faces[:, 1]] + x[faces[:, 2]]) / 3.0
    points = np.concatenate([x, middles, centroids])
    distance = np.empty(len(points))
    owner = np.empty(len(points), dtype=np.int32)
    nearest_obstacle(points, Obstacles.resting(a, b, radius).packed, distance, owner)
    return float(max(0.0, -distance.min(initial=0.0)))


def first_lasting(holds: BoolArray) -> int | None:
    """Returns the first index from which `holds` (T,) is true to the end; None if it is not."""
    if not len(holds) or not holds[-1]:
        return None
    broken = np.flatnonzero(~holds)
    return int(broken[-1]) + 1 if len(broken) else 0
