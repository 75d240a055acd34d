"""Lines of sight from a hand to an opening of the garment.

An armhole whose centre is near the hand may still be blocked, because the front panel of a coat
hangs between them like a curtain. A straight line from the hand into the opening is blocked if it
meets a triangle of the garment on its way.
"""

from __future__ import annotations

import numba as nb
import numpy as np
import numpy.typing as npt
from trimesh.triangles import closest_point

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray

# Candidate moves of an opening, m: none, and along the 26 vectors from the centre of a cube to its
# corners, edges and faces.
_CUBE = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
_AROUND = _CUBE[_CUBE.any(axis=1)]
_AROUND = _AROUND / np.linalg.norm(_AROUND, axis=1, keepdims=True)
_MOVES = np.vstack([np.zeros((1, 3)), *(size * _AROUND for size in (0.05, 0.10, 0.15, 0.20))])
# Costs of a move, m: of an opening that is not seen, of one that is seen aslant, and of a metre too
# near.
_UNSEEN, _ASLANT, _CLOSE = 0.4, 0.1, 2.0
# Least distance for viewing an opening, m: nearer, a panel lies on the hand and follows it.
_NEAREST = 0.13
# Visible share of an opening that suffices.
_ENOUGH = 0.85
# Sample points of an opening: its centre and this many, half-way to its rim.
_RIM_POINTS = 8


def free_sight(
    x: FloatArray, faces: IntArray, loop: npt.NDArray[np.integer], eye: FloatArray
) -> float:
    """Returns the share, 0 to 1, of an opening that can be seen from a point.

    Args:
        x: (n,3) nodes of the garment, m.
        faces: (F,3) its triangles.
        loop: (k,) nodes around the opening, in order.
        eye: (3,) viewpoint, m.
    """
    rim = x[loop]
    center = rim.mean(axis=0)
    chosen = rim[np.linspace(0, len(rim), _RIM_POINTS, endpoint=False).astype(np.intp)]
    targets = np.concatenate([center[None], 0.5 * (center + chosen)])
    return 1.0 - float(_barred(x, faces, eye, targets).mean())


def is_barred(x: FloatArray, faces: IntArray, eye: FloatArray, target: FloatArray) -> bool:
    """Returns whether the segment from `eye` (3,) to `target` (3,), m, meets the garment.

    Args:
        x: (n,3) nodes of the garment, m.
        faces: (F,3) its triangles.
        eye: (3,) m.
        target: (3,) m.
    """
    return bool(_barred(x, faces, eye, target[None])[0])


def _barred(x: FloatArray, faces: IntArray, eye: FloatArray, targets: FloatArray) -> BoolArray:
    """Returns which of the segments from `eye` (3,) to `targets` (t,3), m, meet the garment."""
    barred = np.zeros(len(targets), dtype=np.bool_)
    _find_barred(
        np.ascontiguousarray(x),
        np.ascontiguousarray(faces),
        np.ascontiguousarray(eye, dtype=np.float64),
        np.ascontiguousarray(targets, dtype=np.float64),
        barred,
    )
    return barred


def distance_to_opening(rim: FloatArray, point: FloatArray) -> float:
    """Returns how far a point is from the fan that spans an opening, m.

    A hand that a panel keeps out of an opening stays its own thickness away from it.

    Args:
        rim: (k,3) nodes around the opening, in order, m.
        point: (3,) m.
    """
    center = np.broadcast_to(rim.mean(axis=0), rim.shape)
    fan = np.stack([center, rim, np.roll(rim, -1, axis=0)], axis=1)
    nearest = closest_point(fan, np.broadcast_to(point, rim.shape))
    return float(np.linalg.norm(nearest - point, axis=1).min())


def move_into_sight(
    x: FloatArray,
    faces: IntArray,
    loop: npt.NDArray[np.integer],
    normal: FloatArray,
    eye: FloatArray,
    frame: FloatArray,
) -> FloatArray:
    """Returns a short move (3,), m, by which an opening comes into sight.

    The garment is assumed to move rigidly. A panel that blocks the way mostly does so by a few
    centimetres.

    Args:
        x: (n,3) nodes of the garment, m.
        faces: (F,3) its triangles.
        loop: (k,) nodes around the opening, in order.
        normal: (3,) unit normal of the opening, on the side from which it is entered.
        eye: (3,) viewpoint, m.
        frame: (3,3) rows are the unit vectors of the frame of the moves.
    """
    center = x[loop].mean(axis=0)
    best, least = np.zeros(3), np.inf
    for move in _MOVES @ frame:
        to_eye = eye - move - center
        distance = float(np.linalg.norm(to_eye))
        aslant = 1.0 - float(to_eye @ normal) / max(distance, 1e-9)
        close = max(0.0, _NEAREST - distance)
        price = float(np.linalg.norm(move)) + _ASLANT * aslant + _CLOSE * close
        if price < least:
            unseen = max(0.0, _ENOUGH - free_sight(x, faces, loop, eye - move))
            price += _UNSEEN * unseen
        if price < least:
            best, least = move, price
    return best


@nb.njit(cache=True, nogil=True)
def _find_barred(x, faces, eye, targets, barred):  # type: ignore[no-untyped-def]
    """Marks the targets whose segment from the eye meets a triangle (Möller and Trumbore 1997)."""
    u = np.empty(3)
    v = np.empty(3)
    s = np.empty(3)
    d = np.empty(3)
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        for c in range(3):
            u[c] = x[j, c] - x[i, c]
            v[c] = x[k, c] - x[i, c]
            s[c] = eye[c] - x[i, c]
        q0 = s[1] * u[2] - s[2] * u[1]
        q1 = s[2] * u[0] - s[0] * u[2]
        q2 = s[0] * u[1] - s[1] * u[0]
        for t in range(targets.shape[0]):
            if barred[t]:
                continue
            for c in range(3):
                d[c] = targets[t, c] - eye[c]
            p0 = d[1] * v[2] - d[2] * v[1]
            p1 = d[2] * v[0] - d[0] * v[2]
            p2 = d[0] * v[1] - d[1] * v[0]
            determinant = u[0] * p0 + u[1] * p1 + u[2] * p2
            if abs(determinant) < 1e-14:
                continue
            a = (s[0] * p0 + s[1] * p1 + s[2] * p2) / determinant
            if a < 0.0 or a > 1.0:
                continue
            b = (d[0] * q0 + d[1] * q1 + d[2] * q2) / determinant
            if b < 0.0 or a + b > 1.0:
                continue
            way = (v[0] * q0 + v[1] * q1 + v[2] * q2) / determinant
            if 0.0 <= way <= 1.0:
                barred[t] = True
