"""The linear predictor: a ridge regression from the history of an arm to its motion.

One map serves all three coordinates of a joint, and it takes the history relative to now. So it
knows neither place nor direction, a person at rest is predicted to rest, and a turned person's
prediction is turned. Each window counts by the inverse of its motion: otherwise the fastest
movements alone would set the map, and every small wobble would be continued.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.immutable import Immutable

# Motion that is added to a window's own before it is weighted, m, and the ridge as a share of the
# mean diagonal.
LEAST_MOTION, RIDGE = 0.03, 1e-3


@dataclass(frozen=True)
class LinearMotion(Immutable):
    """Displacement of a joint as a linear function of its displacements before.

    Attributes:
        map: (3,T−1,F) of shoulder, elbow, hand: from the displacements at the first T − 1 samples
            relative to the last, to those at F samples after it.
    """

    map: FloatArray

    def displacement(self, joints: FloatArray) -> FloatArray:
        """Returns (N,F+1,3,3) displacements of shoulder, elbow and hand, m; row 0 is zero.

        Args:
            joints: (N,T,3,3) of shoulder, elbow, hand, without gaps, m.
        """
        before = joints[:, :-1] - joints[:, -1:]
        after = np.einsum("ntkc,ktf->nfkc", before, self.map)
        return np.concatenate([np.zeros_like(after[:, :1]), after], axis=1)


class LinearFit:
    """Fits a `LinearMotion` to windows that are added batch by batch.

    Args:
        history: T.
        future: F.
    """

    def __init__(self, history: int, future: int) -> None:
        self._square = np.zeros((3, history - 1, history - 1))
        self._product = np.zeros((3, history - 1, future))

    def add(self, joints: FloatArray, displacement: FloatArray) -> None:
        """Adds N windows.

        Args:
            joints: (N,T,3,3) m.
            displacement: (N,F+1,3,3) true displacements from the last sample on, m.
        """
        motion = np.linalg.norm(displacement[:, 1:], axis=3).mean(axis=(1, 2))
        weight = 1.0 / (LEAST_MOTION + motion)
        before = (joints[:, :-1] - joints[:, -1:]) * weight[:, None, None, None]
        after = displacement[:, 1:] * weight[:, None, None, None]
        for k in range(3):
            rows = np.moveaxis(before[:, :, k], 2, 1).reshape(-1, before.shape[1])
            wanted = np.moveaxis(after[:, :, k], 2, 1).reshape(-1, after.shape[1])
            self._square[k] += rows.T @ rows
            self._product[k] += rows.T @ wanted

    def solved(self) -> LinearMotion:
        """Returns the best map."""
        size = self._square.shape[1]
        ridge = RIDGE * np.trace(self._square, axis1=1, axis2=2) / size
        return LinearMotion(
            np.linalg.solve(self._square + ridge[:, None, None] * np.eye(size), self._product)
        )
