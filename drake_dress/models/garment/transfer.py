"""Transfers positions between two meshes of a garment: fine to coarse and back."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.mesh import GarmentMesh, SurfaceAtRest


def barycentric_transfer(source: SurfaceAtRest, target: SurfaceAtRest) -> csr_array:
    """Returns W (n_target, n_source) such that `W @ x_source` are positions of the target's nodes.

    Each row holds the barycentric weights, non-negative with sum 1, of the closest point of the
    source's rest surface. A node on a loop of the target takes the closest point on the edges of
    the source's loop of the same name, so that openings map to openings.

    Args:
        source: the mesh whose positions are known.
        target: a mesh of the same garment in the same rest pose, usually coarser.
    """
    triangles = source.rest_position[source.faces]
    face, closest = _closest_on_triangles(triangles, target.rest_position)
    weight = trimesh.triangles.points_to_barycentric(triangles[face], closest)
    weight = np.clip(weight, 0.0, 1.0)
    weight[weight < 1e-12] = 0.0
    node = source.faces[face].astype(np.int64)
    for name in sorted(set(source.loops) & set(target.loops)):
        ours = target.loops[name]
        edge = np.stack([source.loops[name], np.roll(source.loops[name], -1)], axis=1)
        at, along = _closest_on_edges(source.rest_position[edge], target.rest_position[ours])
        node[ours, :2] = edge[at]
        node[ours, 2] = edge[at, 0]
        weight[ours] = np.stack([1.0 - along, along, np.zeros(len(along))], axis=1)
    weight /= weight.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(node)), 3)
    shape = (len(target.rest_position), len(source.rest_position))
    matrix = csr_array(coo_array((weight.ravel(), (rows, node.ravel())), shape=shape))
    matrix.eliminate_zeros()
    return matrix


def attach(mesh: GarmentMesh, points: FloatArray) -> csr_array:
    """Returns W (m, n) such that `W @ x` moves `points` (m,3) of the rest surface with the cloth.

    Each row holds the barycentric weights of the closest point of the rest surface.
    """
    triangles = mesh.rest_position[mesh.faces]
    face, closest = _closest_on_triangles(triangles, points)
    weight = np.clip(trimesh.triangles.points_to_barycentric(triangles[face], closest), 0.0, 1.0)
    weight /= weight.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(points)), 3)
    shape = (len(points), len(mesh.rest_position))
    return csr_array(
        coo_array((weight.ravel(), (rows, mesh.faces[face].astype(np.int64).ravel())), shape=shape)
    )


def _closest_on_triangles(
    triangles: FloatArray, points: FloatArray
) -> tuple[IndexArray, FloatArray]:
    """Returns the closest face and the closest point on it, exactly.

    The nearest centroids are the candidates. More are added until no other face can be closer.
    """
    centroid = triangles.mean(axis=1)
    reach = float(np.linalg.norm(triangles - centroid[:, None], axis=2).max())
    tree = cKDTree(centroid)
    face = np.zeros(len(points), dtype=np.int64)
    closest = np.zeros_like(points)
    open_points = np.arange(len(points))
    count = 12
    while len(open_points):
        count = min(count, len(triangles))
        far, candidate = tree.query(points[open_points], k=count)
        far, candidate = far.reshape(-1, count), candidate.reshape(-1, count)
        repeated = np.repeat(points[open_points], count, axis=0)
        on = trimesh.triangles.closest_point(triangles[candidate.ravel()], repeated)
        distance = np.linalg.norm(on - repeated, axis=1).reshape(-1, count)
        best = np.argmin(distance, axis=1)
        row = np.arange(len(best))
        face[open_points] = candidate[row, best]
        closest[open_points] = on.reshape(-1, count, 3)[row, best]
        sure = (far[:, -1] - reach > distance[row, best]) | (count == len(triangles))
        open_points = open_points[~sure]
        count *= 3
    return face, closest


def _closest_on_edges(edges: FloatArray, points: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Returns the closest of (k,2,3) segments to (m,3) points, and the fraction along it."""
    start, chord = edges[:, 0], edges[:, 1] - edges[:, 0]
    offset = points[:, None] - start[None]
    along = np.clip((offset * chord).sum(axis=2) / (chord**2).sum(axis=1), 0.0, 1.0)
    distance = np.linalg.norm(offset - along[:, :, None] * chord, axis=2)
    best = np.argmin(distance, axis=1)
    return best, along[np.arange(len(best)), best]
