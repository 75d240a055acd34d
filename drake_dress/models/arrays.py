"""Array types for annotations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
# Nodes and modes, in the type that compiled kernels take.
IntArray = npt.NDArray[np.int32]
# Row indices, in the type that NumPy returns.
IndexArray = npt.NDArray[np.int64]
