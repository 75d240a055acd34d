"""The person as the controller knows it, as obstacles that move as predicted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import FloatArray
from drake_dress.models.human.body import Capsule
from drake_dress.models.human.heading import heading


@dataclass(frozen=True)
class PersonModel:
    """What the controller knows of the person's shape.

    Attributes:
        capsules: in body frames; those of the torso go with the shoulders.
        shoulders: (2,3) of the shoulder joints in the torso's frame, left and right, m.
        radius: upper arm, forearm, hand, m.
    """

    capsules: tuple[Capsule, ...]
    shoulders: FloatArray
    radius: tuple[float, float, float]


def person_obstacles(person: PersonModel, joints: FloatArray, time_step: float) -> list[Obstacles]:
    """Returns the person at the start of each of N steps.

    Args:
        person: its shape.
        joints: (N+1,6,3) predicted shoulder, elbow, hand of left, then right arm, m.
        time_step: between them, s.
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


def person_capsules(
    person: PersonModel, joints: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (K,3), (K,3) and radii (K,), m, of the person's capsules, torso first.

    Args:
        person: its shape.
        joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
    """
    torso = [c for c in person.capsules if c.body == "torso"]
    upper, fore, hand = person.radius
    radius = np.array([c.radius for c in torso] + [upper, fore, hand] * 2)
    turned = heading(joints).rotation
    shift = 0.5 * (joints[0] + joints[3]) - turned @ person.shoulders.mean(axis=0)
    a = [turned @ c.a_B + shift for c in torso]
    b = [turned @ c.b_B + shift for c in torso]
    for i in (0, 3):
        a += [joints[i], joints[i + 1], joints[i + 2]]
        b += [joints[i + 1], joints[i + 2], joints[i + 2]]
    return np.array(a), np.array(b), radius
