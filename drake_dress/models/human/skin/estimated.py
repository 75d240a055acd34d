"""Joints of a standing person that nobody named, from the others and the stature.

They stand where the parametric body has them: means of adults of both sexes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES

# Places over the stature: forward and up of joints in the middle, height of those of a leg, half
# the distance between the legs.
_MIDDLE = {"neck": (-0.005, 0.850), "head": (0.014, 0.909)}
_LEG = {"hip": 0.520, "knee": 0.301, "ankle": 0.045}
_HALF_HIPS = 0.065
_WRIST = 0.685  # its distance from the elbow over that of the middle of the hand


def all_joints(given: Mapping[str, FloatArray], stature: float) -> dict[str, FloatArray]:
    """Returns the joints that measures need, those of `given` and estimates of the others.

    Args:
        given: places (3,) in the torso's frame, m; `left_shoulder`, `left_elbow`, `left_hand` and
            those of the right side at least.
        stature: m.
    """
    joints = {name: place for name, place in given.items() if not name.endswith("_hand")}
    for name, (ahead, height) in _MIDDLE.items():
        joints.setdefault(name, stature * np.array([ahead, 0.0, height]))
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        elbow, hand = given[f"{side}_elbow"], given[f"{side}_hand"]
        joints[f"{side}_knuckle_middle"] = hand
        joints.setdefault(f"{side}_wrist", elbow + _WRIST * (hand - elbow))
        for name, height in _LEG.items():
            place = stature * np.array([0.0, sign * _HALF_HIPS, height])
            joints.setdefault(f"{side}_{name}", place)
    return joints
