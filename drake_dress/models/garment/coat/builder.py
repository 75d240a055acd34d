"""Collects the grids of half a coat, and mirrors them to a whole one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.mesh import GarmentMesh

_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass
class Builder:
    """Collects nodes and faces; grids are joined where they use the same nodes."""

    points: list[FloatArray] = field(default_factory=list)
    faces: list[IntArray] = field(default_factory=list)
    count: int = 0

    def add(self, points: FloatArray) -> IntArray:
        """Returns the indices of new nodes, shaped as the points are."""
        new = np.arange(self.count, self.count + points.size // 3, dtype=np.int32)
        self.points.append(points.reshape(-1, 3))
        self.count += len(new)
        return new.reshape(points.shape[:-1])

    @property
    def position(self) -> FloatArray:
        """(n,3) nodes that were added, m."""
        return np.concatenate(self.points)

    def grid(self, nodes: IntArray) -> None:
        """Adds the triangles of a grid, oriented outward if rows go up and columns go left."""
        a, b = nodes[:-1, :-1].ravel(), nodes[:-1, 1:].ravel()
        d, c = nodes[1:, :-1].ravel(), nodes[1:, 1:].ravel()
        x = self.position
        first = np.linalg.norm(x[a] - x[c], axis=1)
        second = np.linalg.norm(x[b] - x[d], axis=1)
        odd = (np.indices((nodes.shape[0] - 1, nodes.shape[1] - 1)).sum(axis=0) % 2).ravel() == 1
        # the shorter diagonal; alternating if both are alike, so that the cloth prefers no bias
        along = np.where(np.abs(first - second) < 0.05 * (first + second), odd, first < second)
        # a face in the mirror's plane would be its own image
        middle = x[:, 1] == 0.0
        along = np.where(middle[b] & middle[c] & middle[d], True, along)
        self.faces.append(
            np.concatenate(
                [
                    np.stack([a, b, np.where(along, c, d)], axis=1),
                    np.stack([np.where(along, a, b), c, d], axis=1),
                ]
            )
        )


def mirrored(
    half: Builder,
    armhole: IntArray,
    cuff: IntArray,
    grasp: IntArray,
    region: npt.NDArray[np.int8],
    source: str,
) -> GarmentMesh:
    """Returns the coat of a left half, whose right half shares the nodes in the middle.

    Args:
        half: nodes and faces of the left half.
        armhole: loop of nodes in the left half.
        cuff: likewise.
        grasp: nodes that the left gripper holds.
        region: (n,) region of each node of the left half.
        source: file or name at the beginning of messages.

    Raises:
        UserError: both grippers would hold the same node.
    """
    left = half.position
    aside = left[:, 1] > 0.0
    image = np.arange(len(left), dtype=np.int32)
    image[aside] = len(left) + np.arange(np.count_nonzero(aside), dtype=np.int32)
    faces = np.concatenate(half.faces)
    if np.isin(image[grasp], grasp).any():
        raise UserError(
            source,
            "grasp_radius",
            f"holds {len(grasp)} nodes: both grippers would hold the same",
        )
    right_region = region[aside]
    right_region[right_region == 1] = 2
    return GarmentMesh(
        rest_position=np.concatenate([left, left[aside] * _MIRROR]),
        faces=np.concatenate([faces, image[faces][:, ::-1]]).astype(np.int32),
        loops={
            "left_armhole": armhole,
            "left_cuff": cuff,
            "right_armhole": image[armhole],
            "right_cuff": image[cuff],
        },
        grasp={"left": grasp, "right": image[grasp]},
        region=np.concatenate([region, right_region]),
    )
