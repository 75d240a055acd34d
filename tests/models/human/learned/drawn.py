"""Persons who move in sleeves, and networks whose weights are drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points
from drake_dress.models.human.learned import diffusion, network
from drake_dress.models.human.learned.familiarity import FAMILIAR_SHAPES
from drake_dress.models.human.learned.forecast import PersonHistory
from drake_dress.models.human.learned.intent import intent_weights
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.predictor import Networks
from drake_dress.models.sides import SIDES

SWAPPED = [3, 4, 5, 0, 1, 2]
LIMBS = ((0, 3), (0, 1), (1, 2), (3, 4), (4, 5))
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Scene:
    """A person and both sleeves over time.

    Attributes:
        joints: (T,6,3) m.
        sleeves: (T,2,6) centre, m, and unit direction from cuff to armhole.
    """

    joints: np.ndarray
    sleeves: np.ndarray

    def moved(self, yaw: float, shift: np.ndarray) -> Scene:
        """Returns the scene turned about the vertical and shifted."""
        turn = about_vertical(yaw)
        parts = self.sleeves.reshape(-1, 2, 2, 3) @ turn.T
        parts[:, :, 0] += shift
        return Scene(self.joints @ turn.T + shift, parts.reshape(-1, 2, 6))

    def mirrored(self) -> Scene:
        """Returns the scene in a mirror: what was left is right."""
        parts = self.sleeves.reshape(-1, 2, 2, 3) * _MIRROR
        return Scene(mirrored(self.joints), parts[:, ::-1].reshape(-1, 2, 6))

    def history(self, time: float = 0.0) -> PersonHistory:
        """Returns the last `HISTORY` samples."""
        return PersonHistory(time, self.joints[-HISTORY:], self.sleeves[-HISTORY:])


def about_vertical(yaw: float) -> np.ndarray:
    """Returns the rotation (3,3) by an angle, rad."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def mirrored(joints: np.ndarray) -> np.ndarray:
    """Returns joints (…,6,3), m, in a mirror."""
    image: np.ndarray = joints[..., SWAPPED, :] * _MIRROR
    return image


def lengths(joints: np.ndarray) -> np.ndarray:
    """Returns the lengths (…,5) of shoulder line and limbs of joints (…,6,3), m."""
    found = [np.linalg.norm(joints[..., a, :] - joints[..., b, :], axis=-1) for a, b in LIMBS]
    return np.stack(found, axis=-1)


def pose(
    angles: np.ndarray, yaw: float = 0.0, place: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """Returns joints (6,3), m, with the angles (2,4) of left and right arm, rad."""
    torso = (about_vertical(yaw), np.array([*place, 0.0]))
    arms = zip(SIDES, angles, strict=True)
    return np.vstack(
        [arm_points(BodyMeasures(), "standing", s, ArmPose(*a), torso) for s, a in arms]
    )


def drawn_scene(seed: int, steps: int = HISTORY) -> Scene:
    """Returns a person who walks, turns and moves both arms, all smoothly, `PERIOD` apart."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform([0.3, -1.0, -0.6, 0.4], [1.2, 0.4, 0.6, 1.6], (2, 4))
    swing, rate = rng.uniform(0.0, 0.25, (2, 4)), rng.uniform(0.5, 4.0, (2, 4))
    phase = rng.uniform(0.0, 6.0, (2, 4))
    yaw, turning = rng.uniform(-3.0, 3.0), rng.uniform(-0.3, 0.3)
    place, velocity = rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.1, 0.1, 2)
    joints = np.stack(
        [
            pose(
                middle + swing * np.sin(rate * t + phase),
                yaw + turning * np.sin(t),
                tuple(place + t * velocity),
            )
            for t in PERIOD * np.arange(steps)
        ]
    )
    arms = joints.reshape(steps, 2, 3, 3)
    way = arms[:, :, 1] - arms[:, :, 2]
    into = way / np.linalg.norm(way, axis=2, keepdims=True)
    center = arms[:, :, 2] + rng.uniform(-0.1, 0.2) * into + 0.02 * rng.normal(size=(2, 3))
    return Scene(joints, np.concatenate([center, into], axis=2))


def drawn_networks(seed: int = 0, limit: float = 1e3) -> Networks:
    """Returns networks of drawn weights, to which everything up to `limit` is familiar."""
    rng = np.random.default_rng(seed)
    motion = network.motion_weights(rng) | diffusion.denoiser_weights(rng)
    motion |= diffusion.initialiser_weights(rng)
    motion |= {name: 0.1 * rng.normal(size=shape) for name, shape in FAMILIAR_SHAPES.items()}
    motion["familiar.limit"] = np.full(FAMILIAR_SHAPES["familiar.limit"], limit)
    motion["linear.map"] = 0.03 * rng.normal(size=(3, HISTORY - 1, FUTURE))
    motion["latent.latent"] = np.eye(diffusion.VALUES, diffusion.LATENT)
    motion["latent.motion"] = np.eye(diffusion.LATENT, diffusion.VALUES)
    motion["region.factor"] = np.ones((FUTURE + 1, 3), dtype=np.float32)
    motion["region.linear"] = np.linspace(0.01, 0.5, 3 * (FUTURE + 1)).reshape(FUTURE + 1, 3)
    return Networks(intent_weights(rng), {k: v.astype(np.float32) for k, v in motion.items()})
