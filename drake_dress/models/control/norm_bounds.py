"""Bounds on norms of affine functions of states or inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray

# Maximum number of rows of a norm: the solvers' kernels have loops of this length.
_ROWS = 3


@dataclass(frozen=True)
class NormBounds:
    """Bounds on the norms of affine functions, one row of bounds for each step.

    Attributes:
        matrix: (T,K,3,n). offset: (T,K,3).
        radius: (T,K), positive; infinite where there is no bound.
    """

    matrix: FloatArray
    offset: FloatArray
    radius: FloatArray

    def norms(self, z: FloatArray) -> FloatArray:
        """Returns the norms (T,K) at `z` (T,n)."""
        y = np.einsum("tkab,tb->tka", self.matrix, z) + self.offset
        length: FloatArray = np.linalg.norm(y, axis=2)
        return length

    def excess(self, z: FloatArray) -> FloatArray:
        """Returns the excess (T,K) of the norms over their bounds at `z` (T,n); negative inside."""
        return self.norms(z) - self.radius

    def spilled(self, z: FloatArray) -> FloatArray:
        """Returns the least t ≥ 0 (T,K) with ‖·‖² ≤ φ² + 2 φ t at `z` (T,n); 0 without a bound."""
        bounded = np.isfinite(self.radius)
        phi = np.where(bounded, self.radius, 1.0)
        t = np.maximum(0.0, 0.5 * (self.norms(z) ** 2 / phi - phi))
        return np.where(bounded, t, 0.0)


def violation(of_states: NormBounds, x: FloatArray, of_inputs: NormBounds, v: FloatArray) -> float:
    """Returns the largest bound violation of states `x` (N+1,n) and inputs `v` (N,m), or 0.

    Bounds on x_0 are ignored, because no input changes it.
    """
    over = of_states.excess(x)[1:].max(initial=0.0)
    return float(max(0.0, over, of_inputs.excess(v).max(initial=0.0)))


@dataclass(frozen=True)
class NormBound:
    """‖C z + d‖ ≤ φ at all steps.

    Attributes:
        matrix: (k,d) C with at most three rows.
        radius: φ, positive: a number, or (T,) with infinity at steps without a bound.
        offset: (k,) or (T,k) d.
    """

    matrix: npt.ArrayLike
    radius: npt.ArrayLike
    offset: npt.ArrayLike = 0.0

    @classmethod
    def interval(cls, row: npt.ArrayLike, low: float, high: float) -> NormBound:
        """Returns the bound low ≤ row · z ≤ high, with a `row` (d,)."""
        if not low < high:
            raise ValueError(f"the interval is {low:g} to {high:g}, expected low < high")
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        return cls(np.atleast_2d(np.asarray(row, dtype=np.float64)), half, [-middle])


def stacked_bounds(bounds: Sequence[NormBound], times: int, size: int, first: int) -> NormBounds:
    """Returns the bounds at each of T = `times` time steps.

    Args:
        bounds: any number of bounds.
        times: T; a `radius` or `offset` of length T − `first` begins at time step `first`.
        size: dimension of z.
        first: time step from which on they apply.

    Raises:
        ValueError: a bound has the wrong shape, or a radius is not positive.
    """
    matrix = np.zeros((times, len(bounds), _ROWS, size))
    offset = np.zeros((times, len(bounds), _ROWS))
    radius = np.full((times, len(bounds)), np.inf)
    for k, bound in enumerate(bounds):
        rows = np.asarray(bound.matrix, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != size or not 1 <= len(rows) <= _ROWS:
            raise ValueError(
                f"bound {k} has a matrix of the shape {rows.shape}, expected (1 to {_ROWS}, {size})"
            )
        of_time = times - first
        matrix[first:, k, : len(rows)] = rows
        given = np.asarray(bound.offset, dtype=np.float64)
        if given.shape not in ((), (len(rows),), (of_time, len(rows))):
            raise ValueError(
                f"bound {k} has an offset of the shape {given.shape}, "
                f"expected ({len(rows)},) or ({of_time}, {len(rows)})"
            )
        offset[first:, k, : len(rows)] = given
        length = np.asarray(bound.radius, dtype=np.float64)
        if length.shape not in ((), (of_time,)) or not np.all(length > 0.0):
            raise ValueError(
                f"bound {k} has the radius {length}, expected a positive number or {of_time}"
            )
        radius[first:, k] = length
    return NormBounds(matrix, offset, radius)
