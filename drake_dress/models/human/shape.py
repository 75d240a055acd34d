"""The shape of a person: round cones, each fixed in one of the bodies.

Trunk: a section of given width and depth is the hull of circles side by side, as thick as the
smaller of both. A trunk without a waist has the chest's section throughout. Otherwise it has four
heights: just below the shoulders and at the breast that of the chest, then waist and hips.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.measures import BodyMeasures, Posture, shoulder_height
from drake_dress.models.sides import SIDES, Side

# Distance of the trunk's upper end from the shoulders, m.
_BELOW_SHOULDERS = 0.02
# Heights of breast, waist and hips below the shoulders as shares of the trunk's length: 1.22, 1.08
# and 0.92 m above the floor for the default person, an adult of about 1.7 m.
_BREAST, _WAIST, _HIPS = 0.35, 0.62, 0.92
# Distance from the shoulders' line to the head, m, where it is not given.
_NECK_LENGTH = 0.12
# Depth, m, to which the middle of a taut triangle may cut into a part of a chair.
_MESH_DEPTH = 3e-3
# What a capsule is part of.
PERSON, CHAIR = "person", "chair"


@dataclass(frozen=True)
class Capsule:
    """A round cone fixed in `body`: a capsule if its radii are equal, a sphere if a_B equals b_B.

    Attributes:
        body: name of the body.
        a_B, b_B: (3,) ends of its axis, m.
        radius: radius at end a, m.
        end_radius: radius at end b, m; None: the same.
        part: what it is part of, `PERSON` or `CHAIR`: a chair is fixed in the torso.
    """

    body: str
    a_B: FloatArray
    b_B: FloatArray
    radius: float
    end_radius: float | None = None
    part: str = PERSON

    @property
    def radii(self) -> tuple[float, float]:
        """Radii at both ends, m."""
        return self.radius, self.radius if self.end_radius is None else self.end_radius


def capsule_arrays(capsules: Sequence[Capsule]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (k,3), (k,3), in the frames of their bodies, and radii (k,2), m."""
    a, b = (np.array([getattr(c, end) for c in capsules]).reshape(-1, 3) for end in ("a_B", "b_B"))
    return a, b, np.array([c.radii for c in capsules]).reshape(-1, 2)


def met_by_mesh(capsules: Sequence[Capsule], spacing: float) -> tuple[Capsule, ...]:
    """Returns capsules whose thin chair parts are thick enough for the contact of a mesh's nodes.

    Only nodes touch obstacles. Around a tube of the radius r a taut triangle of a mesh cuts in
    with its middle, as deep as r − √(r² − c²), c = spacing / √3, even through the whole tube. A
    chair's parts become as thick as it takes for this depth to stay within 3 mm; limbs are thick
    enough.

    Args:
        capsules: of a person and a chair.
        spacing: mean length of the mesh's edges, m.
    """
    return tuple(
        c if c.part != CHAIR else replace(c, radius=_met(c.radii[0], spacing), end_radius=None)
        for c in capsules
    )


def _met(radius: float, spacing: float) -> float:
    inner = max(radius - _MESH_DEPTH, 0.0)
    return max(radius, float(np.hypot(inner, spacing / np.sqrt(3.0))))


def body_capsules(measures: BodyMeasures, posture: Posture) -> tuple[Capsule, ...]:
    """Returns the capsules of all bodies, each in its body's frame.

    The torso's come first, then upper arm, forearm and hand of the left and of the right.
    """
    top = shoulder_height(measures, posture)
    arms = (capsule for side in SIDES for capsule in _arm(measures.of(side), side))
    return (
        *_trunk(measures, top),
        *_shoulders_and_head(measures, top),
        *_legs(measures, posture, top),
        *arms,
    )


def _of_torso(
    a: Sequence[float], b: Sequence[float], radius: float, end_radius: float | None = None
) -> Capsule:
    return Capsule("torso", np.array(a), np.array(b), radius, end_radius)


@dataclass(frozen=True)
class _Section:
    """A section of the trunk: circles of a radius whose centres are up to `x` and `y` off, m."""

    z: float
    radius: float
    x: float
    y: float


def _trunk(m: BodyMeasures, top: float) -> Iterator[Capsule]:
    sections = _sections(m, top)
    wide, deep = any(s.y > 0.0 for s in sections), any(s.x > 0.0 for s in sections)
    places = [(0.0, -1.0), (0.0, 0.0), (0.0, 1.0)] if wide or not deep else [(0.0, 0.0)]
    if deep:
        places += [(-1.0, 0.0), (1.0, 0.0)]
    for low, high in pairwise(sections):
        for x, y in places:
            yield _of_torso(
                [x * low.x, y * low.y, low.z],
                [x * high.x, y * high.y, high.z],
                low.radius,
                high.radius,
            )


def _sections(m: BodyMeasures, top: float) -> list[_Section]:
    """Returns the trunk's sections, upward."""

    def section(z: float, width: float, depth: float) -> _Section:
        radius = 0.5 * min(width, depth)
        return _Section(z, radius, 0.5 * depth - radius, 0.5 * width - radius)

    chest = section(0.0, m.chest_width, m.chest_depth)
    upper = top - chest.radius - _BELOW_SHOULDERS
    if not m.has_waist:
        bottom = top - m.torso_length + chest.radius
        return [section(z, m.chest_width, m.chest_depth) for z in (bottom, upper)]
    waist_z, hips_z = (top - share * m.torso_length for share in (_WAIST, _HIPS))
    breast_z = min(top - _BREAST * m.torso_length, upper)
    found = [
        section(hips_z, m.hip_width, m.hip_depth or m.chest_depth),
        section(waist_z, m.waist_width or m.chest_width, m.waist_depth or m.chest_depth),
        section(breast_z, m.chest_width, m.chest_depth),
    ]
    return found if breast_z == upper else [*found, section(upper, m.chest_width, m.chest_depth)]


def _shoulders_and_head(m: BodyMeasures, top: float) -> Iterator[Capsule]:
    # shoulder girdle, from joint to joint
    half = 0.5 * m.shoulder_width
    left, right = (m.of(side).upper_arm_radius for side in SIDES)
    yield _of_torso([0, -half, top], [0, half, top], right, left)
    neck_top = top + (m.neck_length or _NECK_LENGTH)
    base = m.neck_base_radius or m.neck_radius
    yield _of_torso([0, 0, top], [0, 0, neck_top], base, m.neck_radius)
    yield _of_torso(
        [0.015, 0, neck_top + 0.9 * m.head_radius],
        [0.015, 0, neck_top + 1.2 * m.head_radius],
        m.head_radius,
    )


def _legs(m: BodyMeasures, posture: Posture, top: float) -> Iterator[Capsule]:
    hip = 0.5 * m.hip_width - m.thigh_radius
    pelvis = top - m.torso_length + m.thigh_radius
    if not m.has_waist:
        yield _of_torso([0, -hip, pelvis], [0, hip, pelvis], 1.15 * m.thigh_radius)
    foot = m.thigh_radius if m.ankle_radius is None else m.ankle_radius
    for y in (-hip, hip):
        if posture == "sitting":
            knee = 0.5 * m.leg_length
            below = m.knee_radius or 0.7 * m.thigh_radius
            yield _of_torso([0, y, pelvis], [knee, y, pelvis], m.thigh_radius, m.knee_radius)
            yield _of_torso([knee, y, pelvis], [knee, y, foot], below, m.ankle_radius)
        elif m.knee_radius is None and m.ankle_radius is None:
            yield _of_torso([0, y, pelvis], [0, y, foot], m.thigh_radius)
        else:
            knee, radius = 0.5 * m.leg_length, m.knee_radius or m.thigh_radius
            yield _of_torso([0, y, pelvis], [0, y, knee], m.thigh_radius, radius)
            yield _of_torso([0, y, knee], [0, y, foot], radius, m.ankle_radius)


def _arm(m: BodyMeasures, side: Side) -> Iterator[Capsule]:
    shoulder = elbow = np.zeros(3)
    end, hand = np.array([0.0, 0.0, -m.upper_arm_length]), np.array([0.0, 0.0, -m.forearm_length])
    yield Capsule(f"{side}_upper_arm", shoulder, end, *m.upper_arm_radii)
    yield Capsule(f"{side}_forearm", elbow, hand, *m.forearm_radii)
    yield Capsule(f"{side}_forearm", hand, hand, m.hand_radius)
