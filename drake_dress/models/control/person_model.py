"""The controller's model of the person: obstacles that move with the predicted joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.human.arm import Arms
from drake_dress.models.human.body import Capsule, capsule_arrays
from drake_dress.models.human.heading import heading
from drake_dress.models.human.neck import find_neck


@dataclass(frozen=True)
class PersonModel:
    """The person's shape as the controller models it.

    Attributes:
        capsules: in body frames; those of the torso move with the shoulders.
        shoulders: (2,3) shoulder joints in the torso's frame, left and right, m.
        radius: radii of upper arm, forearm and hand, m: (2,3,2) of left and right, at both ends, or
            (3,) for both sides and ends.
        arms: kinematics of the arms and what they can do; not needed for the shape.
    """

    capsules: tuple[Capsule, ...]
    shoulders: FloatArray
    radius: FloatArray | tuple[float, float, float]
    arms: Arms | None = None

    @cached_property
    def torso(self) -> FloatArray:
        """Ends (2,T,3), m, of the torso's capsules in its frame."""
        a, b, _ = capsule_arrays(self._of_torso)
        return np.stack([a, b])

    @cached_property
    def radii(self) -> FloatArray:
        """Radii (K,2), m, of all capsules at both ends, the torso's first."""
        of_arms = np.asarray(self.radius, dtype=np.float64)
        if of_arms.ndim == 1:
            of_arms = np.broadcast_to(of_arms[:, None], (2, 3, 2))
        return np.concatenate([capsule_arrays(self._of_torso)[2], of_arms.reshape(6, 2)])

    @cached_property
    def neck(self) -> FloatArray:
        """Middle of the shoulders (3,) in the torso's frame, m."""
        middle: FloatArray = self.shoulders.mean(axis=0)
        return middle

    @cached_property
    def neck_radius(self) -> float:
        """Radius of the neck at the shoulders, m; 0 if there is no neck."""
        k = find_neck(self.torso[0], self.torso[1], self.neck)
        return 0.0 if k is None else float(self.radii[k, 0])

    @cached_property
    def shoulder_radius(self) -> float:
        """Mean radius of both upper arms at the shoulder, m."""
        return 0.5 * float(self.radii[-6, 0] + self.radii[-3, 0])

    @property
    def _of_torso(self) -> list[Capsule]:
        return [c for c in self.capsules if c.body == "torso"]


def person_obstacles(person: PersonModel, joints: FloatArray, time_step: float) -> list[Obstacles]:
    """Returns the person at the start of each of N steps.

    Args:
        person: shape of the person.
        joints: (N+1,6,3) predicted shoulder, elbow, hand of left, then right arm, m.
        time_step: time between rows of `joints`, s.
    """
    h = time_step
    placed = [person_capsules(person, q) for q in joints]
    rows_a, rows_b = [a for a, _, _ in placed], [b for _, b, _ in placed]
    radius = placed[0][2]
    predicted = []
    for j in range(len(joints) - 1):
        va, vb = (rows_a[j + 1] - rows_a[j]) / h, (rows_b[j + 1] - rows_b[j]) / h
        axis = rows_b[j] - rows_a[j]
        length2 = np.maximum(np.einsum("ij,ij->i", axis, axis), 1e-12)[:, None]
        omega = np.cross(axis, vb - va) / length2
        predicted.append(Obstacles(rows_a[j], rows_b[j], radius, va, omega))
    return predicted


def kept_away(obstacles: Sequence[Obstacles], radius: FloatArray, share: float) -> list[Obstacles]:
    """Returns the predicted person as grippers keep away from it: wider where it is less certain.

    Args:
        obstacles: the person at the start of each of N steps, as from `person_obstacles`.
        radius: (N+1,6) of the balls that hold the joints with probability 0.9, m.
        share: of these radii that the capsules are widened by.
    """
    result = []
    for obstacle, r in zip(obstacles, radius, strict=False):
        left, right = r[:3], r[3:]
        torso = np.full(obstacle.count - 6, 0.5 * (left[0] + right[0]))
        arms = [np.array([max(a[0], a[1]), max(a[1], a[2]), a[2]]) for a in (left, right)]
        wider = obstacle.radius + share * np.concatenate([torso, *arms])[:, None]
        result.append(replace(obstacle, radius=wider))
    return result


def person_capsules(
    person: PersonModel, joints: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (K,3), (K,3) and radii (K,2), m, of the person's capsules, torso first.

    Args:
        person: shape of the person.
        joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
    """
    ends = np.empty((2, len(person.radii), 3))
    _find_ends(heading(joints).rotation, person.torso, person.neck, joints, ends)
    return ends[0], ends[1], person.radii


@nb.njit(cache=True, nogil=True)
def _find_ends(turned, torso, neck, joints, ends):  # type: ignore[no-untyped-def]
    count = torso.shape[1]
    for a in range(3):
        shift = 0.5 * (joints[0, a] + joints[3, a])
        for b in range(3):
            shift -= turned[a, b] * neck[b]
        for e in range(2):
            for k in range(count):
                ends[e, k, a] = shift
                for b in range(3):
                    ends[e, k, a] += turned[a, b] * torso[e, k, b]
            for k in range(6):
                # each arm has an upper arm, a forearm, and a hand, which is a sphere
                ends[e, count + k, a] = joints[k + e if k % 3 < 2 else k, a]
