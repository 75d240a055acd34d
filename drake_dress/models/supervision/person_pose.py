"""Plausibility of six points as the shoulders, elbows and hands of the described person.

Each point may be off by `point_error`. A length may then be off by twice that, and the direction of
a limb of length L by asin(2 point_error / L).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2, cos, degrees, pi, radians, sin

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import JOINT_NAMES
from drake_dress.models.human.arm_angles import arm_angles
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.remedies import COORDINATES, mistake

POINT_NAMES = tuple(f"{side} {name}" for side in SIDES for name in ("shoulder", "elbow", "hand"))
_LIMBS = ("upper arm", "forearm")
_OTHER_SIDE = [3, 4, 5, 0, 1, 2]
_SWAPPED = "left and right are swapped, or the person faces backward"
_REMEDIES = {_SWAPPED: lambda points: points[_OTHER_SIDE]} | COORDINATES


@dataclass(frozen=True)
class PoseBounds:
    """Limits of the described person's points.

    Attributes:
        shoulders: (2,3) described shoulders, left then right, m, world.
        limbs: lengths of upper arm and forearm of the left, then of the right, m.
        limits: (2,2,4) least and greatest angles of each arm's hinges, as of `Arms`, rad.
        point_error: greatest error of a point, m.
        length_share: share by which real lengths may differ from those described.
        shoulder_distance: greatest distance of the shoulders' midpoint from the described one, m.
        turn: greatest turn of the shoulders about the vertical from those described, rad.
        joint_room: angle by which a real person's joints may exceed the limits, rad.
    """

    shoulders: FloatArray
    limbs: tuple[tuple[float, float], ...]
    limits: FloatArray
    point_error: float = 0.03
    length_share: float = 0.15
    shoulder_distance: float = 0.25
    turn: float = radians(100.0)
    joint_room: float = radians(10.0)


def impossible_pose(points: FloatArray, bounds: PoseBounds) -> str | None:
    """Returns why six points are impossible, with value and bound; None if they are plausible.

    Args:
        points: (6,3) finite: shoulder, elbow, hand of the left, then of the right arm, m, world.
        bounds: limits of the person's points.
    """
    lost = np.flatnonzero(~points.any(axis=1))
    if len(lost):
        names = ", ".join(POINT_NAMES[i] for i in lost)
        return f"{names} at (0, 0, 0), as a lost point written as zero"
    broken = _broken(points, bounds)
    if broken is None:
        return None
    why = mistake(points, lambda p: _broken(p, bounds) is None, _REMEDIES)
    if why is None:
        return broken
    return f"{why}: {broken}" if why == _SWAPPED else f"coordinates are {why}: {broken}"


def _broken(points: FloatArray, b: PoseBounds) -> str | None:
    left, right = points[0], points[3]
    wanted = float(np.linalg.norm(b.shoulders[0] - b.shoulders[1]))
    told = _length_told("shoulder width", float(np.linalg.norm(left - right)), wanted, b)
    if told is not None:
        return told
    off = float(np.linalg.norm(0.5 * (left + right) - b.shoulders.mean(axis=0)))
    if off > b.shoulder_distance:
        return (
            f"shoulders {off:.2f} m from where the scenario's person has them, expected "
            f"{b.shoulder_distance:g} m at most"
        )
    for i, side in enumerate(SIDES):
        for j, name in enumerate(_LIMBS):
            length = float(np.linalg.norm(points[3 * i + j + 1] - points[3 * i + j]))
            told = _length_told(f"{side} {name}", length, b.limbs[i][j], b)
            if told is not None:
                return told
    heading = _heading(left - right)
    turn = (heading - _heading(b.shoulders[0] - b.shoulders[1]) + pi) % (2.0 * pi) - pi
    if abs(turn) > b.turn:
        return (
            f"shoulders turned by {degrees(turn):.0f}° about the vertical, expected "
            f"{degrees(b.turn):.0f}° at most"
        )
    for i, side in enumerate(SIDES):
        told = _joints_told(side, points[3 * i : 3 * i + 3], heading, wanted, b.limits[i], b)
        if told is not None:
            return told
    return None


def _length_told(name: str, length: float, wanted: float, b: PoseBounds) -> str | None:
    low = (1.0 - b.length_share) * wanted - 2.0 * b.point_error
    high = (1.0 + b.length_share) * wanted + 2.0 * b.point_error
    if low <= length <= high:
        return None
    return f"{name} {length:.3g} m, expected {max(low, 0.0):.2f} to {high:.2f} m"


def _heading(to_the_left: FloatArray) -> float:
    """Returns the yaw, rad, of a vector (3,) from right to left shoulder; 0 faces +x."""
    return atan2(-to_the_left[0], to_the_left[1])


def _joints_told(  # type: ignore[no-untyped-def]
    side, arm: FloatArray, heading: float, width: float, limits: FloatArray, b: PoseBounds
) -> str | None:
    """Returns which of an arm's angles is impossible; None if its points allow a possible set."""
    c, s = cos(heading), sin(heading)
    into_torso = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    chords = np.diff(arm, axis=0)
    lengths = np.maximum(np.linalg.norm(chords, axis=1), 1e-9)
    upper, fore = (chords / lengths[:, None]) @ into_torso.T
    errors = [_cone(2.0 * b.point_error, float(length)) for length in lengths]
    about_vertical = _cone(2.0 * b.point_error, max(width, 1e-9))
    least, told = np.inf, None
    for angles in arm_angles(side, upper, fore):
        room = b.joint_room + _uncertainty(angles, errors[0] + about_vertical, sum(errors))
        middle, half = 0.5 * (limits[0] + limits[1]), 0.5 * (limits[1] - limits[0])
        from_middle = (angles - middle + pi) % (2.0 * pi) - pi
        beyond = np.abs(from_middle) - half - room
        k = int(np.argmax(beyond))
        if beyond[k] < least:
            least = float(beyond[k])
            low, high = np.degrees([limits[0, k] - room[k], limits[1, k] + room[k]])
            told = (
                f"{side} arm's {JOINT_NAMES[k]} {degrees(angles[k]):.0f}°, expected "
                f"{low:.0f} to {high:.0f}°"
            )
    return told if least > 0.0 else None


def _cone(error: float, length: float) -> float:
    """Returns the angle by which a lateral error turns a segment of a length, rad."""
    return asin(min(1.0, error / length))


def _uncertainty(angles: FloatArray, of_upper: float, of_elbow: float) -> FloatArray:
    """Returns the uncertainty (4,) of the angles, rad.

    Consider a direction that is known to within δ, at an angle φ from a pole. Its azimuth about the
    pole is known to within asin(sin δ / sin φ), and unknown if the pole may be within δ.

    Args:
        angles: abduction, extension, rotation, elbow flexion, rad.
        of_upper: error of the upper arm's direction in the torso's frame, rad.
        of_elbow: error of the angle between both limbs, rad.
    """
    _, extension, _, flexion = angles
    abduction = _azimuth(of_upper, abs(cos(extension)))
    # an abduction error also turns the frame of the rotation about the upper arm
    twist = min(1.0, abs(sin(extension)) + of_upper) * abduction
    rotation = _azimuth(of_elbow, sin(flexion)) + twist
    return np.array([abduction, of_upper, rotation, of_elbow])


def _azimuth(error: float, sine: float) -> float:
    if error >= 0.5 * pi or sin(error) >= sine:
        return pi
    return asin(sin(error) / sine)
