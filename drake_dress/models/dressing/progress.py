"""Progress of both sleeves of a garment on their arms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.linking import arm_linking_number, torso_interior
from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.garment.mesh import AtRest
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class SleeveProgress:
    """Progress of both armholes on their arms; the first axis is left, right.

    Attributes:
        coordinates: (2,3) s, l (m), theta (rad) of the armholes' centres, even of sleeves not on.
        linking: (2,) linking number of armhole and arm: ±1 where the arm is inside.
        hand_distance: (2,) of the armhole's centre to the hand, m.
    """

    coordinates: FloatArray
    linking: IntArray
    hand_distance: FloatArray

    @property
    def s(self) -> FloatArray:
        """(2,) progress; 0 for a sleeve that does not cover its arm, wherever its centre is."""
        s: FloatArray = np.where(self.linking != 0, self.coordinates[:, 0], 0.0)
        return s

    def are_on(self, least_s: float) -> bool:
        """Returns whether both arms are inside and both sleeves have reached `least_s`."""
        return bool(np.all(np.abs(self.linking) == 1) and np.all(self.s >= least_s))


class SleeveGauge:
    """Measures the progress of a garment's sleeves.

    Args:
        garment: its openings, and its shape at rest.

    Raises:
        UserError: an armhole lies edge-on to the vector from its cuff.
    """

    def __init__(self, garment: AtRest) -> None:
        self._loops = [np.asarray(garment.loops[f"{side}_armhole"]) for side in SIDES]
        self._signs = [loop_orientation(garment, side) for side in SIDES]

    def measure(self, x: FloatArray, joints: FloatArray) -> SleeveProgress:
        """Returns the progress of both sleeves.

        Args:
            x: (n,3) nodes, m, world.
            joints: (6,3) shoulder, elbow, hand of left, then right arm, m, world.
        """
        interior = torso_interior(joints[0], joints[3])
        coordinates, distance = np.empty((2, 3)), np.empty(2)
        linking = np.empty(2, dtype=np.int32)
        for i, (loop, sign) in enumerate(zip(self._loops, self._signs, strict=True)):
            shoulder, elbow, hand = joints[3 * i : 3 * i + 3]
            center = sleeve_state(x, loop, sign).p_c
            coordinates[i] = ArmAxis(hand, elbow, shoulder).coordinates(center)
            linking[i] = arm_linking_number(x[loop], shoulder, elbow, hand, interior)
            distance[i] = np.linalg.norm(center - hand)
        return SleeveProgress(coordinates, linking, distance)
