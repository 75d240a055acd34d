"""Whether a hand has a free way to an opening of the garment.

An armhole whose centre is near the hand may still be closed to it: the front panel of a coat hangs
between them like a curtain. Straight lines from the hand into the opening tell: those that meet a
triangle of the garment on their way are barred.
"""

from __future__ import annotations

import numba as nb
import numpy as np
import numpy.typing as npt

from drake_dress.models.cloth.elements import FloatArray, IntArray

# Points of the opening that are looked at: its centre and this many, half-way to its rim.
_RIM_POINTS = 8


def free_sight(
    x: FloatArray, faces: IntArray, loop: npt.NDArray[np.integer], eye: FloatArray
) -> float:
    """Returns the share, 0 to 1, of an opening that can be seen from a point.

    Args:
        x: (n,3) garment, m.
        faces: (F,3) its triangles.
        loop: (k,) nodes around the opening, in order.
        eye: (3,) where one looks from, m.
    """
    rim = x[loop]
    center = rim.mean(axis=0)
    chosen = rim[np.linspace(0, len(rim), _RIM_POINTS, endpoint=False).astype(np.intp)]
    targets = np.concatenate([center[None], 0.5 * (center + chosen)])
    barred = np.zeros(len(targets), dtype=np.bool_)
    _find_barred(
        np.ascontiguousarray(x),
        np.ascontiguousarray(faces),
        np.ascontiguousarray(eye, dtype=np.float64),
        targets,
        barred,
    )
    return 1.0 - float(barred.mean())


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
