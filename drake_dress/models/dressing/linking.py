"""Whether an arm is inside a sleeve: the linking number of the armhole with the arm.

Progress s = 2 proves nothing: an armhole whose centre has slid up beside the arm has it too. What
tells a sleeve that is on from one that lies alongside is topology.

The arm's centre line runs from the hand over elbow and shoulder into the torso. It is open at the
hand, and a linking number is defined for closed curves only, so a way back from the torso to the
hand has to be chosen. It is chosen to go round the armhole, never through the disc that spans it
(the fan of triangles from the loop's centre to its edges). The linking number with a closed curve
is the number of its signed passages through any surface that spans the loop; the way back has
none, so what is left are the passages of the arm itself. Any fixed way back, such as a ray from the
hand outward, would give ±1 for an armhole that hangs beyond the hand where the ray meets it.
Hence ±1 for an armhole round the forearm or the upper arm, 0 for one beside the arm or beyond the
hand, however near its centre is to the arm's axis.

Limitation: a loop so crumpled that its own fan is pierced where the loop is not (a hand poked into
a fold) counts a passage as long as the hand stays in the fold.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# How far the fan's apex may be moved off the loop's centre, as a share of the loop's size.
_APEX_SHIFT = 1e-6


def linking_number(loop: FloatArray, curve: FloatArray) -> float:
    """Returns the Gauss linking number of two closed polylines, an integer up to rounding.

    Each pair of segments subtends a spherical quadrangle, whose area is taken exactly as that of
    two triangles. The number changes sign with the direction of either curve.

    Args:
        loop: (k,3) vertices in order, the last joined to the first.
        curve: (c,3) likewise; the two must not touch.

    Raises:
        ValueError: an argument is not (≥ 3, 3) or not finite.

    Source: sum over pairs of segments after Arai (2013), triangles after Van Oosterom and
    Strackee (1983).
    """
    _check_closed("loop", loop)
    _check_closed("curve", curve)
    k, k_next = loop[:, None, :], np.roll(loop, -1, axis=0)[:, None, :]
    c, c_next = curve[None, :, :], np.roll(curve, -1, axis=0)[None, :, :]
    p, q, r, s = c - k, c - k_next, c_next - k_next, c_next - k
    return float(np.sum(_solid_angle(p, q, r) + _solid_angle(r, s, p)) / (4.0 * np.pi))


def arm_linking_number(
    loop: FloatArray,
    shoulder: FloatArray,
    elbow: FloatArray,
    hand: FloatArray,
    interior: FloatArray,
) -> int:
    """Returns how often the arm passes through the loop, with sign; ±1 when it is inside.

    Positive where the arm, followed from hand to torso, passes along the loop's area vector (the
    loop is seen counter-clockwise by whom the arm comes to). Equals `linking_number` of the loop
    and any closed curve that continues the arm round the loop's fan (see the module's text).

    Args:
        loop: (k,3) nodes of the armhole (or cuff) in order, m, world or any frame.
        shoulder: (3,) joint of the arm, m, same frame.
        elbow: (3,) likewise.
        hand: (3,) likewise; the arm's line ends there.
        interior: (3,) a point in the torso where the arm's centre line ends, m, same frame.

    Raises:
        ValueError: the loop is not (≥ 3, 3) or not finite.
    """
    _check_closed("loop", loop)
    line = np.stack([hand, elbow, shoulder, interior]).astype(np.float64)
    apex = _apex(loop, line)
    return sum(_passages(loop, apex, p, q) for p, q in zip(line[:-1], line[1:], strict=True))


def torso_interior(left_shoulder: FloatArray, right_shoulder: FloatArray) -> FloatArray:
    """Returns a point (3,) in the torso where both arms' centre lines may end, m.

    It lies 10 cm below the middle of the shoulder joints (3,), m, of a person who stands or sits.
    """
    middle: FloatArray = 0.5 * (left_shoulder + right_shoulder) - np.array([0.0, 0.0, 0.1])
    return middle


def _apex(loop: FloatArray, line: FloatArray) -> FloatArray:
    """Returns the apex (3,) of the fan: the loop's centre, but not on the arm's line.

    A line through the apex meets all spokes at once and has no definite side of any. Which point
    spans the disc is free, so of a few next to the centre the one farthest from the line serves;
    all segments have to see the same one.
    """
    center = loop.mean(axis=0)
    size = float(np.max(np.linalg.norm(loop - center, axis=1)))
    shifts = np.array([[0.0, 0.0, 0.0], [0.8, 0.5, 0.3], [-0.3, 0.8, -0.5], [0.5, -0.3, -0.8]])
    candidates = center + _APEX_SHIFT * size * shifts
    clearance = np.full(len(candidates), np.inf)
    for p, q in zip(line[:-1], line[1:], strict=True):
        length = float(np.linalg.norm(q - p))
        if length > 0.0:
            aside = np.linalg.norm(np.cross(candidates - p, q - p), axis=1) / length
            clearance = np.minimum(clearance, aside)
    apex: FloatArray = candidates[int(np.argmax(clearance))]
    return apex


def _passages(loop: FloatArray, apex: FloatArray, p: FloatArray, q: FloatArray) -> int:
    """Returns signed crossings of the segment pq with the fan of the loop about `apex`.

    Seen along the segment the fan is plane triangles (apex, first, second), and the question is
    which of them hold the origin. Each spoke's side of the origin is decided once and used by both
    triangles that share it, so that a line through a spoke counts once.
    """
    length = float(np.linalg.norm(q - p))
    if length == 0.0:
        return 0
    along = (q - p) / length
    across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    across /= np.linalg.norm(across)
    plane = np.stack([across, np.cross(along, across)], axis=1)

    apex_2, loop_2 = (apex - p) @ plane, (loop - p) @ plane
    side_first = apex_2[0] * loop_2[:, 1] - apex_2[1] * loop_2[:, 0] >= 0.0
    side_second = np.roll(side_first, -1)
    second_2 = np.roll(loop_2, -1, axis=0)
    side_edge = loop_2[:, 0] * second_2[:, 1] - loop_2[:, 1] * second_2[:, 0] >= 0.0
    upward = side_first & ~side_second & side_edge
    downward = ~side_first & side_second & ~side_edge

    # Ends of the segment against each triangle's plane; an end in the plane belongs to the segment
    # that follows, decided by the same expression there, so that a joint of the arm counts once.
    spoke = loop - apex
    normal = np.cross(spoke, np.roll(spoke, -1, axis=0))
    below_p, below_q = normal @ (p - apex) < 0.0, normal @ (q - apex) < 0.0
    upward &= below_p & ~below_q
    downward &= ~below_p & below_q
    return int(np.count_nonzero(upward) - np.count_nonzero(downward))


def _solid_angle(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    """Returns the signed solid angles of the triangles p, q, r (…,3) seen from the origin, sr."""
    norm_p, norm_q, norm_r = (np.linalg.norm(v, axis=-1) for v in (p, q, r))
    volume = np.sum(p * np.cross(q, r), axis=-1)
    rest = (
        norm_p * norm_q * norm_r
        + np.sum(p * q, axis=-1) * norm_r
        + np.sum(q * r, axis=-1) * norm_p
        + np.sum(r * p, axis=-1) * norm_q
    )
    angle: FloatArray = 2.0 * np.arctan2(volume, rest)
    return angle


def _check_closed(name: str, points: FloatArray) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 3:
        raise ValueError(f"{name} has shape {points.shape}, expected (k,3) with k at least 3")
    if not np.all(np.isfinite(points)):
        raise ValueError(f"{name} holds NaN or infinity")
