"""Cost of cloth in the path of a hand and in the place of its forearm, with its derivative.

If a hand meets a panel or a rim, the cloth folds up and drags the opening along. The cost measures
how deep nodes lie in a cylinder ahead of the hand, so it acts before they touch. The same cylinder
also stands for the forearm as it would lie with the hand in the armhole. It then shows whether the
arm can enter at all: the cloth between armhole and neck lies across a steep forearm, however well
the armhole faces the hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray

# Start of the cylinder behind the hand's centre, and length of the fade at both ends, m.
_BEHIND, _FADE = 0.02, 0.04


@dataclass(frozen=True)
class Corridor:
    """Cylinders ahead of a hand, at each of N steps.

    Attributes:
        hand: (N,3) hand positions, where the cylinders begin, m.
        into: (N,3) unit vectors from elbow to hand.
    """

    hand: FloatArray
    into: FloatArray


def corridor_cost(
    x: FloatArray, hand: FloatArray, into: FloatArray, radius: float, length: float
) -> tuple[float, FloatArray]:
    """Returns Σ τ (r − ρ)² over the nodes in a cylinder, m², and its derivative (n,3), m.

    ρ is the distance to the axis; τ fades from 1 to 0 over 4 cm at both ends.

    Args:
        x: (n,3) nodes, m.
        hand: (3,) start of the cylinder, m.
        into: (3,) unit vector along its axis.
        radius: radius r of the cylinder, m.
        length: length of the cylinder ahead of `hand`, m.
    """
    offset = x - hand
    along = offset @ into
    aside = offset - along[:, None] * into
    distance = np.linalg.norm(aside, axis=1)
    within = (distance < radius) & (along > -_BEHIND) & (along < length)
    slope = np.zeros_like(x)
    nodes = np.flatnonzero(within)
    if not len(nodes):
        return 0.0, slope
    begins = (along[nodes] + _BEHIND) / _FADE
    ends = (length - along[nodes]) / _FADE
    fade = np.minimum(begins, 1.0) * np.minimum(ends, 1.0)
    change = np.where(begins < 1.0, np.minimum(ends, 1.0), 0.0)
    change -= np.where(ends < 1.0, np.minimum(begins, 1.0), 0.0)
    short = radius - distance[nodes]
    outward = aside[nodes] / np.maximum(distance[nodes], 1e-12)[:, None]
    slope[nodes] = (-2.0 * fade * short)[:, None] * outward
    slope[nodes] += (change / _FADE * short**2)[:, None] * into
    return float(np.sum(fade * short**2)), slope
