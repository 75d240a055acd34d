"""Heading of a person, from the line of the shoulders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray

# A sine up to this is rounding: a person who does not turn then faces +x to the last bit.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Heading:
    """Directions of a person who may have turned about the vertical.

    Attributes:
        rotation: R (3,3) about z from a person who faces +x; (N,3,3) for N times, and then each
            direction is (N,3).
    """

    rotation: FloatArray

    @property
    def front(self) -> FloatArray:
        """Returns the unit vector (3,) the person faces along (v_f)."""
        return self.rotation[..., 0]

    @property
    def reversed(self) -> Heading:
        """The same with the front behind and the sides in place, for dressing from the front.

        A garment that is put on from the front moves as the mirror image of one from behind, so
        directions are then relative to this mirrored person. Its `rotation` is a reflection.
        """
        return Heading(self.rotation * np.array([-1.0, 1.0, 1.0]))

    @property
    def leftward(self) -> FloatArray:
        """Returns the unit vector (3,) from right to left."""
        return self.rotation[..., 1]

    def inward(self, side: int) -> FloatArray:
        """Returns the unit vector (3,) from a side (0: left) to the other."""
        return self.leftward * (-1.0 if side == 0 else 1.0)


def heading(joints: FloatArray) -> Heading:
    """Returns the heading of joints (6,3), m: shoulder, elbow, hand of left, then right arm.

    If one shoulder is straight above the other, the person is assumed to face +x.
    """
    line = joints[0] - joints[3]
    length = float(np.hypot(line[0], line[1]))
    if length == 0.0 or (abs(line[0]) <= _ROUNDING * length and line[1] > 0.0):
        return Heading(np.eye(3))
    c, s = line[1] / length, -line[0] / length
    return Heading(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def headings(joints: FloatArray) -> Heading:
    """Returns the headings of joints (N,6,3), m, at N times, as one object with N rows."""
    return Heading(np.stack([heading(q).rotation for q in joints]))
