"""A person's girths are those of the body's capsules."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.fit.girths import person_girths
from drake_dress.models.human.body import BodyMeasures, body_capsules, shoulder_joint

BODY = BodyMeasures()


def girth_around(height: float) -> float:
    """Returns the girth of the convex hull of the torso's capsules in a horizontal plane, m."""
    points = []
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for c in body_capsules(BODY, "standing"):
        low, high = sorted((c.a_B[2], c.b_B[2]))
        if c.body == "torso" and low <= height <= high:
            for end in (c.a_B, c.b_B):
                points.append(end[:2] + c.radius * circle)
    return hull_length(np.concatenate(points))


def hull_length(points: FloatArray) -> float:
    from scipy.spatial import ConvexHull

    return float(ConvexHull(points).area)


def test_girths_are_those_of_sections_through_the_capsules() -> None:
    girths = person_girths(BODY)
    top = BODY.shoulder_height
    assert girths.chest == pytest.approx(girth_around(top - 0.3), rel=1e-3)
    assert girths.neck == pytest.approx(girth_around(top + 0.1), rel=1e-3)
    assert girths.hips == pytest.approx(
        girth_around(top - BODY.torso_length + BODY.thigh_radius), rel=1e-3
    )


def test_the_arm_is_as_long_as_from_shoulder_to_hand() -> None:
    girths = person_girths(BODY)
    capsules = {(c.body, c.radius): c for c in body_capsules(BODY, "standing")}
    hand = capsules["left_forearm", BODY.hand_radius]
    upper = capsules["left_upper_arm", BODY.upper_arm_radius]
    assert girths.hand == pytest.approx(2.0 * np.pi * hand.radius)
    assert girths.upper_arm == pytest.approx(2.0 * np.pi * upper.radius)
    assert girths.arm_length == pytest.approx(-upper.b_B[2] - hand.b_B[2])
    assert girths.reach - girths.arm_length == pytest.approx(hand.radius)
    joints = [shoulder_joint(BODY, "standing", side)[1] for side in ("left", "right")]
    assert girths.shoulder_width == pytest.approx(joints[0] - joints[1] + 2.0 * upper.radius)


def test_a_person_of_twice_the_size_has_twice_the_girths() -> None:
    lengths = [f.name for f in fields(BODY) if isinstance(getattr(BODY, f.name), float)]
    twice = replace(BODY, **{name: 2.0 * getattr(BODY, name) for name in lengths})
    for entry in fields(person_girths(BODY)):
        small, large = (getattr(person_girths(b), entry.name) for b in (BODY, twice))
        assert large == pytest.approx(2.0 * small), entry.name
