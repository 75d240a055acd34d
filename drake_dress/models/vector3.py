"""3-vectors in compiled code: NumPy's functions take longer than the arithmetic there."""

from __future__ import annotations

import numba as nb
import numpy as np


@nb.njit(cache=True, nogil=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """Returns a·b of vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@nb.njit(cache=True, nogil=True)
def length(a):  # type: ignore[no-untyped-def]
    """Returns |a| of a vector (3,)."""
    return np.sqrt(dot(a, a))
