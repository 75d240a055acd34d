"""Largest distances between parts of a garment: φ_c and φ_f of the paper, on the mesh.

In inextensible cloth, the distance of two points is at most their geodesic distance on the surface.
The centre of an armhole is a weighted mean of its nodes, and so is the centre of a grasp patch. For
any pairing of their weights, the distance of two means is at most the mean of the paired distances.
The tightest of these bounds is an optimal transport problem with geodesic distances as its cost. It
holds however the garment is folded, and is attained where the cloth is taut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pygeodesic.geodesic import PyGeodesicAlgorithmExact
from scipy.optimize import linprog
from scipy.sparse import kron, vstack

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class Reach:
    """Largest distances within an inextensible garment, m.

    Attributes:
        between_sleeves: between the centres of both armholes (φ_c).
        to_far_gripper: from the centre of the left armhole to that of the right grasp patch, and
            from the right armhole to the left grasp patch (φ_f; one number in the paper).
        to_near_gripper: likewise, to the grasp patch on the armhole's own side.
        between_grippers: between the centres of both grasp patches.
    """

    between_sleeves: float
    to_far_gripper: tuple[float, float]
    to_near_gripper: tuple[float, float]
    between_grippers: float


def reach(mesh: GarmentMesh) -> Reach:
    """Returns the largest distances between armholes and grippers of a garment."""
    armhole = [np.asarray(mesh.loops[f"{side}_armhole"]) for side in SIDES]
    grasp = [np.asarray(mesh.grasp[side]) for side in SIDES]
    weights = [_curve_weights(mesh.rest_position[loop]) for loop in armhole]
    held = [np.full(len(nodes), 1.0 / len(nodes)) for nodes in grasp]
    exact = PyGeodesicAlgorithmExact(
        np.asarray(mesh.rest_position, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32)
    )

    # one way from a node serves all its targets
    ends = np.cumsum([len(grasp[0]), len(grasp[1])])
    from_left = _distances(exact, armhole[0], np.concatenate([*grasp, armhole[1]]))
    from_right = _distances(exact, armhole[1], np.concatenate(grasp))
    far = from_left[:, ends[1] :]
    parts = [(d[:, : ends[0]], d[:, ends[0] : ends[1]]) for d in (from_left, from_right)]
    to = [[mean_distance(parts[i][k], weights[i], held[k]) for k in (0, 1)] for i in (0, 1)]
    held_apart = mean_distance(_distances(exact, *grasp), *held)
    return Reach(
        between_sleeves=mean_distance(far, weights[0], weights[1]),
        to_far_gripper=(to[0][1], to[1][0]),
        to_near_gripper=(to[0][0], to[1][1]),
        between_grippers=held_apart,
    )


def geodesic_distances(
    position: FloatArray, faces: IntArray, sources: IntArray, targets: IntArray
) -> FloatArray:
    """Returns (s,t) geodesic distances between nodes of a mesh, m.

    Exact on the triangles (Mitchell, Mount and Papadimitriou, "The discrete geodesic problem",
    1987). A target that cannot be reached is infinitely far.

    Args:
        position: (n,3) m.
        faces: (F,3).
        sources: (s,) nodes.
        targets: (t,) nodes.
    """
    exact = PyGeodesicAlgorithmExact(
        np.asarray(position, dtype=np.float64), np.asarray(faces, dtype=np.int32)
    )
    return _distances(exact, sources, targets)


def mean_distance(distance: FloatArray, of_rows: FloatArray, of_columns: FloatArray) -> float:
    """Returns the optimal transport cost of distances (s,t) between weights (s,) and (t,).

    Both sets of weights are positive and sum to one.
    """
    s, t = distance.shape
    rows = kron(np.eye(s), np.ones((1, t)))
    columns = kron(np.ones((1, s)), np.eye(t))
    # the last constraint follows from the others
    found = linprog(
        distance.ravel(),
        A_eq=vstack([rows, columns]).tocsr()[:-1],
        b_eq=np.concatenate([of_rows, of_columns])[:-1],
        method="highs",
    )
    return float(found.fun)


def _distances(exact: PyGeodesicAlgorithmExact, sources: IntArray, targets: IntArray) -> FloatArray:
    wanted = np.asarray(targets, dtype=np.int32)
    found: FloatArray = np.stack(
        [exact.geodesicDistances(np.array([node], dtype=np.int32), wanted)[0] for node in sources]
    )
    return found


def _curve_weights(loop: FloatArray) -> FloatArray:
    """Returns (k,) weights of a closed polygon's corners in the centroid of its outline."""
    edge = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    weight: FloatArray = 0.5 * (edge + np.roll(edge, 1)) / edge.sum()
    return weight
