"""Types of arrays, as annotations name them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
# Nodes and modes, as compiled kernels take them.
IntArray = npt.NDArray[np.int32]
# Rows of other arrays, as NumPy returns them.
IndexArray = npt.NDArray[np.int64]
