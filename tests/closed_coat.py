"""A coat whose front edges are joined, as a garment that is pulled over the head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import IntArray
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.mesh import GarmentMesh


def closed_coat(coat: GarmentMesh, part: float = 1.0) -> GarmentMesh:
    """Returns a coat with a strip of cloth between its front edges.

    Args:
        coat: symmetric about y = 0.
        part: share of the edges that is joined, from the collar down.
    """
    left = _front_edge(coat)
    left = left[len(left) - max(2, round(part * len(left))) :]
    x = coat.rest_position
    right = np.array([np.argmin(np.linalg.norm(x - x[node] * [1, -1, 1], axis=1)) for node in left])
    strip = np.concatenate(
        [
            np.stack([left[1:], left[:-1], right[:-1]], axis=1),
            np.stack([left[1:], right[:-1], right[1:]], axis=1),
        ]
    )
    mesh = replace(coat, faces=np.concatenate([coat.faces, strip]).astype(np.int32))
    mesh.validate()
    return mesh


def _front_edge(coat: GarmentMesh) -> IntArray:
    """Returns the nodes of the left front edge, from the hem up, as the border runs."""
    z, y = coat.rest_position[:, 2], coat.rest_position[:, 1]
    rim = boundary_loops(coat.faces)[0]
    # begin in the middle of the hem's back, from where the border runs along the hem
    at_hem = z[rim] < z.min() + 1e-6
    start = int(np.argmin(np.where(at_hem, np.abs(y[rim]) + coat.rest_position[rim, 0], np.inf)))
    rim, at_hem = np.roll(rim, -start), np.roll(at_hem, -start)
    corner = int(np.argmin(at_hem)) - 1
    top = int(np.argmax(z[rim] > -1e-6))
    edge = rim[corner:top]
    assert (y[edge] > 0.0).all() or (y[edge] < 0.0).all()
    return edge
