"""How far parts of a garment can get from each other: φ_c and φ_f of the paper, on the mesh.

Cloth that does not stretch keeps no two points further apart than the shortest way between them on
its surface. The centre of an armhole is a weighted mean of its nodes, and so is what a gripper
holds. For any pairing of their weights, the distance of two means is at most the mean of the paired
distances; the tightest of these bounds is an optimal transport with geodesic distances as its cost.
It holds however the garment is folded, and is reached where it is drawn taut.
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
    """Largest distances within a garment that does not stretch, m.

    Attributes:
        between_sleeves: of the centres of both armholes (φ_c).
        to_far_gripper: of the centre of the left armhole from what the right gripper holds, and of
            the right one from what the left gripper holds (φ_f; one number in the paper).
        to_near_gripper: likewise from the gripper of its own side.
        between_grippers: of what both grippers hold.
    """

    between_sleeves: float
    to_far_gripper: tuple[float, float]
    to_near_gripper: tuple[float, float]
    between_grippers: float


def reach(mesh: GarmentMesh) -> Reach:
    """Returns how far armholes and grippers of a garment can be apart."""
    armhole = [np.asarray(mesh.loops[f"{side}_armhole"]) for side in SIDES]
    grasp = [np.asarray(mesh.grasp[side]) for side in SIDES]
    weights = [_curve_weights(mesh.rest_position[loop]) for loop in armhole]
    held = [np.full(len(nodes), 1.0 / len(nodes)) for nodes in grasp]
    exact = PyGeodesicAlgorithmExact(
        np.asarray(mesh.rest_position, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32)
    )

    far = _distances(exact, armhole[0], armhole[1])
    gripped = [_distances(exact, loop, np.concatenate(grasp)) for loop in armhole]
    split = len(grasp[0])
    parts = [(d[:, :split], d[:, split:]) for d in gripped]
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
    """Returns (s,t) the lengths of the shortest ways on a mesh between nodes, m.

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
    """Returns the least mean of distances (s,t) over all pairings of weights (s,) and (t,).

    Both sets of weights are positive and sum to one.
    """
    s, t = distance.shape
    rows = kron(np.eye(s), np.ones((1, t)))
    columns = kron(np.ones((1, s)), np.eye(t))
    # the last row follows from the others
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
    """Returns (k,) the weights of a closed polygon's corners in its centre as a curve."""
    edge = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    weight: FloatArray = 0.5 * (edge + np.roll(edge, 1)) / edge.sum()
    return weight
