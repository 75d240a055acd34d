"""Whether an arm is inside a sleeve: the linking number of the armhole with the arm.

Progress s = 2 proves nothing: an armhole whose centre has slid up beside the arm has it too. Only
topology distinguishes a sleeve that is on from one that lies alongside.

The arm's centre line runs from the hand over elbow and shoulder into the torso. A linking number is
defined for closed curves only, so the line has to be closed by a path from the torso back to the
hand. That path is chosen to go around the armhole, never through the disc that spans it (the fan of
triangles from the loop's centre to its edges). The linking number is the number of signed passages
of the closed curve through any surface that spans the loop. The closing path has none, so only the
passages of the arm count. A fixed closing path, such as a ray from the hand outward, would give ±1
for an armhole that hangs beyond the hand where the ray meets it. The result is ±1 for an armhole
around the forearm or the upper arm, and 0 for one beside the arm or beyond the hand, however near
its centre is to the arm's axis.

Limitation: the arm can pierce the fan of a crumpled loop without passing through the loop (a hand
poked into a fold). This counts as a passage as long as the hand stays in the fold.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray

# Shift of the fan's apex off the loop's centre, as a share of the loop's size.
_APEX_SHIFT = 1e-6
_SHIFTS = np.array([[0.0, 0.0, 0.0], [0.8, 0.5, 0.3], [-0.3, 0.8, -0.5], [0.5, -0.3, -0.8]])


def linking_number(loop: FloatArray, curve: FloatArray) -> float:
    """Returns the Gauss linking number of two closed polylines, an integer up to rounding.

    Each pair of segments subtends a spherical quadrangle, whose area is computed exactly from two
    triangles. The number changes sign with the direction of either curve.

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
    """Returns the number of signed passages of the arm through the loop; ±1 when it is inside.

    A passage is positive if the arm, followed from hand to torso, goes along the loop's area vector
    (an observer whom the arm approaches sees the loop counter-clockwise). The number equals the
    `linking_number` of the loop and any closed curve that continues the arm around the loop's fan
    (see the module's docstring).

    Args:
        loop: (k,3) nodes of the armhole (or cuff) in order, m, world or any frame.
        shoulder: (3,) joint of the arm, m, same frame.
        elbow: (3,) likewise.
        hand: (3,) likewise; the arm's centre line begins there.
        interior: (3,) a point in the torso where the arm's centre line ends, m, same frame.

    Raises:
        ValueError: the loop is not (≥ 3, 3) or not finite.
    """
    _check_closed("loop", loop)
    line = np.array([hand, elbow, shoulder, interior], dtype=np.float64)
    count: int = _passages(np.ascontiguousarray(loop, dtype=np.float64), line)
    return count


def torso_interior(left_shoulder: FloatArray, right_shoulder: FloatArray) -> FloatArray:
    """Returns a point (3,) in the torso where both arms' centre lines may end, m.

    It lies 10 cm below the middle of the shoulder joints (3,), m, of a person who stands or sits.
    """
    middle: FloatArray = 0.5 * (left_shoulder + right_shoulder) - np.array([0.0, 0.0, 0.1])
    return middle


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _passages(loop, line):  # type: ignore[no-untyped-def]
    """Returns signed crossings of the line (4,3) with the fan of the loop (k,3).

    Projected along a segment, the fan becomes plane triangles (apex, first, second); the line of
    the segment crosses those that contain the origin. Each spoke's side of the origin is decided
    once and used by both triangles that share it, so that a line through a spoke counts once. An
    end of a segment in a triangle's plane belongs to the following segment, which decides by the
    same expression, so that a joint of the arm counts once.
    """
    count = loop.shape[0]
    apex = _apex(loop, line)
    seen, side = np.empty((count, 2)), np.empty(count, dtype=np.bool_)
    along, across, up = np.empty(3), np.empty(3), np.empty(3)
    total = 0
    for segment in range(line.shape[0] - 1):
        p, q = line[segment], line[segment + 1]
        length = _distance(p, q)
        if length == 0.0:
            continue
        least = 0
        for a in range(3):
            along[a] = (q[a] - p[a]) / length
            if abs(along[a]) < abs(along[least]):
                least = a
        a, b, c = least, (least + 1) % 3, (least + 2) % 3
        # along × the coordinate axis of its smallest component
        size = np.sqrt(along[b] ** 2 + along[c] ** 2)
        across[a], across[b], across[c] = 0.0, along[c] / size, -along[b] / size
        up[a] = along[b] * across[c] - along[c] * across[b]
        up[b] = along[c] * across[a] - along[a] * across[c]
        up[c] = along[a] * across[b] - along[b] * across[a]
        apex_0, apex_1 = _from_along(p, apex, across), _from_along(p, apex, up)
        for k in range(count):
            seen[k, 0] = _from_along(p, loop[k], across)
            seen[k, 1] = _from_along(p, loop[k], up)
            side[k] = apex_0 * seen[k, 1] - apex_1 * seen[k, 0] >= 0.0
        for k in range(count):
            n = k + 1 if k + 1 < count else 0
            if side[k] == side[n]:
                continue
            beyond = seen[k, 0] * seen[n, 1] - seen[k, 1] * seen[n, 0] >= 0.0
            if side[k] != beyond:
                continue
            below_p = _height(loop[k], loop[n], apex, p) < 0.0
            below_q = _height(loop[k], loop[n], apex, q) < 0.0
            if beyond and below_p and not below_q:
                total += 1
            elif not beyond and not below_p and below_q:
                total -= 1
    return total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _apex(loop, line):  # type: ignore[no-untyped-def]
    """Returns the apex (3,) of the fan: the loop's centre, but not on the arm's line.

    A line through the apex meets all spokes at once and has no definite side of any. The apex can
    be chosen freely. It is the one of a few candidates at the centre that is farthest from the
    line; all segments have to use the same apex.
    """
    center, candidate, best = np.zeros(3), np.empty(3), np.empty(3)
    for k in range(loop.shape[0]):
        for a in range(3):
            center[a] += loop[k, a]
    center /= loop.shape[0]
    size = 0.0
    for k in range(loop.shape[0]):
        size = max(size, _distance(loop[k], center))
    largest = -1.0
    for s in range(_SHIFTS.shape[0]):
        for a in range(3):
            candidate[a] = center[a] + _APEX_SHIFT * size * _SHIFTS[s, a]
        clearance = np.inf
        for i in range(line.shape[0] - 1):
            length = _distance(line[i], line[i + 1])
            if length > 0.0:
                clearance = min(clearance, _aside(candidate, line[i], line[i + 1]) / length)
        if clearance > largest:
            largest = clearance
            best[:] = candidate
    return best


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _from_along(p, q, axis):  # type: ignore[no-untyped-def]
    return (q[0] - p[0]) * axis[0] + (q[1] - p[1]) * axis[1] + (q[2] - p[2]) * axis[2]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _distance(p, q):  # type: ignore[no-untyped-def]
    return np.sqrt((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2)


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _aside(point, p, q):  # type: ignore[no-untyped-def]
    """Returns ‖(point − p) × (q − p)‖."""
    x, y, z = point[0] - p[0], point[1] - p[1], point[2] - p[2]
    u, v, w = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    return np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _height(first, second, apex, point):  # type: ignore[no-untyped-def]
    """Returns six times the volume of the tetrahedron of a triangle of the fan and a point."""
    x, y, z = first[0] - apex[0], first[1] - apex[1], first[2] - apex[2]
    u, v, w = second[0] - apex[0], second[1] - apex[1], second[2] - apex[2]
    d, e, f = point[0] - apex[0], point[1] - apex[1], point[2] - apex[2]
    return (y * w - z * v) * d + (z * u - x * w) * e + (x * v - y * u) * f


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
