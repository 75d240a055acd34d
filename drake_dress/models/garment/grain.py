"""The grain of a garment: the warp direction of its cloth."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES


def grain(mesh: GarmentMesh) -> FloatArray:
    """Returns (F,3) unit warp directions of the faces in the rest pose.

    The warp runs down the body, and along each sleeve from armhole to cuff, as tailors cut.
    """
    face_region = np.median(mesh.region[mesh.faces], axis=1).astype(int)
    warp = np.tile([0.0, 0.0, -1.0], (len(mesh.faces), 1))
    for region, side in enumerate(SIDES, start=1):
        start, end = (
            mesh.rest_position[mesh.loops[f"{side}_{name}"]].mean(axis=0)
            for name in ("armhole", "cuff")
        )
        warp[face_region == region] = (end - start) / np.linalg.norm(end - start)
    return warp
