"""Standard form for the solvers of linear-quadratic problems with norm bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.norm_bounds import NormBounds


@dataclass(frozen=True)
class ReducedProblem:
    """A problem in its own states x and inputs v; n states, m inputs, N steps.

    minimise   Σ_{j=0}^{N} ½ x_jᵀ w_j x_j + w_x,jᵀ x_j + Σ_{j=0}^{N−1} ½ v_jᵀ r_j v_j + r_v,jᵀ v_j
    subject to x_{j+1} = a_j x_j + b_j v_j from x_0 = 0, and norm bounds.

    Attributes:
        a: (N,n,n); None for integrators, x_{j+1} = x_j + b_j v_j.
        b: (N,n,m); None for the identity, with integrators only.
        w, w_x: (N+1,n,n) and (N+1,n). r, r_v: (N,m) diagonals, positive, and (N,m).
        state_bounds: on x_0 … x_N; input_bounds: on v_0 … v_{N−1}.
        input_map: (N,m,m) T; the original problem has the inputs T_j v_j. None for the identity.
    """

    a: FloatArray | None
    b: FloatArray | None
    w: FloatArray
    w_x: FloatArray
    r: FloatArray
    r_v: FloatArray
    state_bounds: NormBounds
    input_bounds: NormBounds
    input_map: FloatArray | None = None

    def contiguous(self) -> ReducedProblem:
        """Returns the problem with C-contiguous arrays, as compiled kernels take them."""
        return ReducedProblem(
            None if self.a is None else np.ascontiguousarray(self.a),
            None if self.b is None else np.ascontiguousarray(self.b),
            np.ascontiguousarray(self.w),
            np.ascontiguousarray(self.w_x),
            np.ascontiguousarray(self.r),
            np.ascontiguousarray(self.r_v),
            self.state_bounds,
            self.input_bounds,
            self.input_map,
        )

    def mapped(self, v: FloatArray) -> FloatArray:
        """Returns inputs `v` (N,m), or columns of them (N,m,k), mapped to the original problem."""
        if self.input_map is None:
            return v
        columns: FloatArray = self.input_map @ v.reshape(*v.shape[:2], -1)
        return columns.reshape(v.shape)

    def unmapped(self, v: FloatArray) -> FloatArray:
        """Returns inputs `v` (N,m) of the original problem mapped to this one."""
        if self.input_map is None:
            return v
        return np.asarray(np.linalg.solve(self.input_map, v[:, :, None])[:, :, 0], np.float64)
