"""Each arm seen from its own shoulder, in the direction the person faces, as if it were the left.

A network then learns one arm for both, and neither the person's place nor heading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray

# Order of the joints as the right arm sees them: its own first.
_SWAPPED = [3, 4, 5, 0, 1, 2]
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class ArmFrames:
    """Frames of the arms of B persons: 2B rows, all left arms, then all right arms.

    Attributes:
        matrix: (2B,3,3) from world to frame, orthogonal; it mirrors for right arms.
        origin: (2B,3) shoulder of the arm now, m, world.
    """

    matrix: FloatArray
    origin: FloatArray

    @classmethod
    def of(cls, now: FloatArray, turned: FloatArray | None = None) -> ArmFrames:
        """Returns the frames of persons with joints `now` (B,6,3), m, without NaN.

        Args:
            now: shoulder, elbow, hand of left, then right arm.
            turned: (B,) angles by which the frames are turned about the vertical, rad.
        """
        front = facing(now)
        if turned is not None:
            c, s = np.cos(turned), np.sin(turned)
            front = np.stack(
                [c * front[:, 0] - s * front[:, 1], s * front[:, 0] + c * front[:, 1]], axis=1
            )
        zero = np.zeros(len(front))
        x, y = front[:, 0], front[:, 1]
        rows = np.stack(
            [
                np.stack([x, y, zero], axis=1),
                np.stack([-y, x, zero], axis=1),
                np.stack([zero, zero, zero + 1.0], axis=1),
            ],
            axis=1,
        )
        mirrored = _MIRROR[:, None] * rows
        return cls(np.concatenate([rows, mirrored]), np.concatenate([now[:, 0], now[:, 3]]))

    def points(self, points: FloatArray) -> FloatArray:
        """Returns points (B,…,3), m, world, in the frames of both arms (2B,…,3)."""
        both = np.concatenate([points, points])
        return self.directions(both - self._placed(both), stacked=True)

    def directions(self, vectors: FloatArray, stacked: bool = False) -> FloatArray:
        """Returns vectors (B,…,3), world, in the frames of both arms (2B,…,3)."""
        both = vectors if stacked else np.concatenate([vectors, vectors])
        flat = both.reshape(len(both), -1, 3)
        turned = flat @ np.swapaxes(self.matrix, 1, 2)
        return turned.reshape(both.shape)

    def joints(self, joints: FloatArray) -> FloatArray:
        """Returns joints (B,…,6,3), m, in both frames (2B,…,6,3): the arm's own joints first."""
        seen = self.points(joints)
        half = len(joints)
        return np.concatenate([seen[:half], seen[half:][..., _SWAPPED, :]])

    def world(self, points: FloatArray) -> FloatArray:
        """Returns points (2B,…,3), m, of the frames in the world."""
        flat = points.reshape(len(points), -1, 3)
        return (flat @ self.matrix).reshape(points.shape) + self._placed(points)

    def _placed(self, points: FloatArray) -> FloatArray:
        return self.origin.reshape(len(points), *[1] * (points.ndim - 2), 3)


def facing(joints: FloatArray) -> FloatArray:
    """Returns the horizontal unit vectors (B,2) that persons with joints (B,6,3), m, face along.

    They are across the shoulders. Shoulders straight above each other face along x.
    """
    line = joints[:, 0, :2] - joints[:, 3, :2]
    length = np.linalg.norm(line, axis=1)
    front = np.stack([line[:, 1], -line[:, 0]], axis=1) / np.maximum(length, 1e-9)[:, None]
    front[length < 1e-9] = (1.0, 0.0)
    return front


def swapped_sides(pairs: FloatArray) -> FloatArray:
    """Returns what is given for left and right, (B,T,2,…), as each arm's own and the other's.

    All left arms come first, (2B,T,2,…).
    """
    return np.concatenate([pairs, pairs[:, :, ::-1]])
