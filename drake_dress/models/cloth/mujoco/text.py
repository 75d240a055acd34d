"""Numbers in MuJoCo's XML."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def numbers(array: npt.ArrayLike) -> str:
    """Returns the values of an array, row by row, with 12 digits."""
    return " ".join(f"{value:.12g}" for value in np.asarray(array).ravel())
