"""The nape of a person, where a coat's collar belongs."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.heading import Heading, heading

# Part of the nape, from the top of the shoulders up, on which a collar may lie, m: the neck of an
# adult is 8 to 12 cm long, and a collar covers half of it.
NAPE_LENGTH = 0.05
# Least rise of the neck's capsule, m, by which it is told from others that begin at the shoulders.
_LEAST_RISE = 0.05


def find_neck(a: FloatArray, b: FloatArray, middle: FloatArray) -> int | None:
    """Returns the index of the capsule that stands up from the middle of the shoulders.

    Args:
        a: (c,3) first ends of a person's capsules, m.
        b: (c,3) second ends, m.
        middle: (3,) of the shoulders, m.

    Returns:
        None if there is no such capsule.
    """
    rows = np.flatnonzero(b[:, 2] > middle[2] + _LEAST_RISE)
    if not len(rows):
        return None
    return int(rows[np.argmin(np.linalg.norm(a[rows] - middle, axis=1))])


def nape(
    joints: FloatArray, shoulder_radius: float, neck_radius: float, to: Heading | None = None
) -> FloatArray:
    """Returns the ends (2,3), m, of the nape: at the top of the shoulders, and above.

    Args:
        joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
        shoulder_radius: of the limbs at the shoulder, m.
        neck_radius: m.
        to: heading whose back is the nape's side, if not the person's: reversed, it is the throat,
            on which a garment from the front is laid.
    """
    to = heading(joints) if to is None else to
    base = 0.5 * (joints[0] + joints[3]) - neck_radius * to.front
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([base + shoulder_radius * up, base + (shoulder_radius + NAPE_LENGTH) * up])


def distance_to_nape(point: FloatArray, ends: FloatArray) -> float:
    """Returns the distance of a point (3,) from the nape, m.

    Args:
        point: m.
        ends: (2,3) of the nape, m.
    """
    along = ends[1] - ends[0]
    share = float(np.clip((point - ends[0]) @ along / (along @ along), 0.0, 1.0))
    return float(np.linalg.norm(point - ends[0] - share * along))
