"""A coat that hangs from two grippers, far from a person, and a camera that sees its back."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.human.body import Capsule
from drake_dress.models.perception.delayed_tracking import DelayedTracker, Motion
from drake_dress.models.perception.depth_buffer import depth_buffer
from drake_dress.models.perception.garment_filter import GarmentFilter, View
from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.models.sides import SIDES

COAT = make_coat(COATS["jacket"], 0.06)
FABRIC = Material(surface_density=0.3, stretch_stiffness=800.0, damping=0.02)
GRASPS = [COAT.rest_position[COAT.grasp[side]] for side in SIDES]
GRIPPERS = np.stack([x.mean(axis=0) for x in GRASPS])
OFFSETS = np.concatenate([x - x.mean(axis=0) for x in GRASPS])
# far from the coat, with the shoulders apart so that the person has a heading
JOINTS = np.array([[9.0, y, z] for y in (0.2, -0.2) for z in (1.4, 1.1, 0.8)])
SHOULDERS = np.array([[0.0, 0.2, 1.4], [0.0, -0.2, 1.4]])
TRUNK = Capsule("torso", np.array([0.0, 0.0, 0.8]), np.array([0.0, 0.0, 1.3]), 0.12)
STEP = 1.0 / 30.0
CAMERA = Pinhole(
    120,
    90,
    110.0,
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    COAT.rest_position.mean(axis=0) - [1.7, 0.0, 0.0],
)


def motion(tick: int, are_open: bool = False) -> Motion:
    """Returns a sample of grippers that go sideways at 0.1 m/s."""
    time = tick * STEP
    return Motion(time, GRIPPERS + [0.0, 0.1 * time, 0.0], JOINTS, are_open)


def view_of(x: FloatArray) -> View:
    """Returns what the camera sees of the coat at nodes `x` (n,3), m: label 1."""
    depth = depth_buffer(CAMERA, x, COAT.faces)
    labels = np.isfinite(depth).astype(np.int32)
    return View(CAMERA, np.where(labels == 1, depth, 0.0), labels, 1)


def tracker_of_coat(memory: float = 0.5) -> DelayedTracker:
    """Returns a tracker of the coat."""
    holding, free = (GarmentFilter(COAT, FABRIC, holds=holds) for holds in (True, False))
    person = PersonModel((TRUNK,), SHOULDERS, (0.05, 0.04, 0.04))
    return DelayedTracker(holding, free, COAT.held_offsets, person, memory)
