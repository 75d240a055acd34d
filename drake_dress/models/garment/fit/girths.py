"""Girths and lengths of a person, as a tailor takes them, from the body's capsules."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.human.body import BodyMeasures


@dataclass(frozen=True)
class PersonGirths:
    """Measures of a person, m.

    Attributes:
        hand: girth of the hand, which is a sphere: the largest that a cuff must let through.
        upper_arm: girth of the upper arm.
        chest: girth of the trunk below the arms.
        hips: girth of the pelvis.
        neck: girth of the neck.
        head: girth of the head.
        shoulder_width: distance between the outer sides of the shoulders.
        arm_length: from the shoulder joint to the middle of the hand.
        reach: from the shoulder joint to the tip of the hand.
    """

    hand: float
    upper_arm: float
    chest: float
    hips: float
    neck: float
    head: float
    shoulder_width: float
    arm_length: float
    reach: float


def person_girths(measures: BodyMeasures) -> PersonGirths:
    """Returns the girths and lengths of the body that `body_capsules` makes of these measures."""
    m = measures
    arm_length = m.upper_arm_length + m.forearm_length
    return PersonGirths(
        hand=_round(m.hand_radius),
        upper_arm=_round(m.upper_arm_radius),
        # the trunk's three capsules side by side, as deep as the chest
        chest=_oval(0.5 * m.chest_depth, m.chest_width - m.chest_depth),
        # a capsule across the pelvis
        hips=_oval(1.15 * m.thigh_radius, m.hip_width - 2.0 * m.thigh_radius),
        neck=_round(m.neck_radius),
        head=_round(m.head_radius),
        shoulder_width=m.shoulder_width + 2.0 * m.upper_arm_radius,
        arm_length=arm_length,
        reach=arm_length + m.hand_radius,
    )


def _round(radius: float) -> float:
    return float(2.0 * np.pi * radius)


def _oval(radius: float, between: float) -> float:
    """Returns the girth around two circles whose centres lie `between` apart, m."""
    return float(2.0 * np.pi * radius + 2.0 * max(between, 0.0))
