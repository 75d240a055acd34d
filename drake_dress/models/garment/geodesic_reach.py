"""Bounds on the distances between points of a garment: path lengths along the cloth."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh


def reach_between(mesh: GarmentMesh, places: FloatArray) -> FloatArray:
    """Returns (m,m) path lengths along the mesh's edges between points, m.

    A path along edges is at least as long as the geodesic, so points of inextensible cloth are
    never farther apart.

    Args:
        mesh: the garment.
        places: (m,3) points of its rest shape, m; a path includes the straight lines from both
            points to their nearest nodes.
    """
    x, faces = mesh.rest_position, mesh.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    graph = coo_array((length, edges.T), shape=(len(x), len(x))).tocsr()
    off, node = cKDTree(x).query(places)
    way = dijkstra(graph, directed=False, indices=node)[:, node]
    found: FloatArray = np.where(np.eye(len(places), dtype=bool), 0.0, way + off[:, None] + off)
    return found
