"""Least squares on whitened residuals of several voices, for simulations with numerical error.

A voice is one kind of signal in one recording. Two properties of the numerical error are used, in
addition to its size. First, the remaining error of the time step is, to first order, a multiple of
the change by the last halving of the step. Its factor is free in each voice (Richardson
extrapolation with an unknown factor). Second, the error affects some voices more than others. The
more the voices disagree beyond noise, the more equal their weights become, whatever their amount of
data (the random-effects model of meta-analysis, DerSimonian and Laird 1986).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, lsq_linear

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

# Prior standard deviation of the factor of the change by halving the step. A factor of 1
# extrapolates to exact time integration.
_FACTOR = 1.0
_RIDGE = 1e-6
# Prior standard deviation of a parameter in a single voice, in typical sizes.
_VAGUE = 30.0
# Largest scatter between voices, in typical sizes.
_MOST_SCATTER = 3.0


@dataclass(frozen=True)
class Extrapolation:
    """The part of a simulation's error along a known direction.

    Attributes:
        direction: (N,) whitened change by the last halving of the time step.
        voice: (N,) index of each entry's voice.
    """

    direction: FloatArray
    voice: IndexArray

    def without(self, values: FloatArray, rows: BoolArray) -> FloatArray:
        """Returns values without the part that the direction explains.

        Args:
            values: (N,) residuals or (N,k) columns.
            rows: (N,) mask of the entries from which each voice's factor is found.
        """
        out = values.copy()
        for i in range(int(self.voice.max()) + 1):
            mine = self.voice == i
            known = self.direction[mine & rows]
            factor = known @ values[mine & rows] / (known @ known + _FACTOR**-2)
            out[mine] -= np.multiply.outer(self.direction[mine], factor)
        return out


@dataclass(frozen=True)
class Solution:
    """Coefficients of columns.

    Attributes:
        x: (k,) coefficients.
        std: (k,) their standard deviations.
        scatter: standard deviation between voices beyond noise.
    """

    x: FloatArray
    std: FloatArray
    scatter: float


def solve_bounded(
    columns: FloatArray,
    reduced: FloatArray,
    residual: FloatArray,
    low: FloatArray | float,
    high: FloatArray | float,
) -> FloatArray:
    """Returns the coefficients (k,) within bounds that best explain a residual (N,).

    Args:
        columns: (N,k) columns.
        reduced: (N,k) columns without the part that the extrapolation explains.
        residual: (N,) residual, likewise without that part.
        low: lower bounds (k,).
        high: upper bounds (k,).
    """
    return _bounded(columns.T @ reduced, columns.T @ residual, low, high)


def solve_pooled(
    columns: FloatArray,
    reduced: FloatArray,
    residual: FloatArray,
    voice: IndexArray,
    low: FloatArray | float,
    high: FloatArray | float,
) -> Solution:
    """Returns coefficients pooled over voices by the random-effects model, in typical sizes.

    Args:
        columns: (N,k) columns, each for a typical size.
        reduced: (N,k) columns without the part that the extrapolation explains.
        residual: (N,) residual, likewise without that part.
        voice: (N,) index of each entry's voice.
        low: lower bounds (k,).
        high: upper bounds (k,).
    """
    k = columns.shape[1]
    normals, rights = _equations(columns, reduced, residual, voice)
    scatter2 = _scatter2(normals, rights)
    shrunk = [np.linalg.inv(np.eye(k) + scatter2 * n) for n in normals]
    normal = sum((s @ n for s, n in zip(shrunk, normals, strict=True)), np.zeros((k, k)))
    right = sum((s @ r for s, r in zip(shrunk, rights, strict=True)), np.zeros(k))
    inverse = np.linalg.pinv(normal, hermitian=True)
    return Solution(
        _bounded(normal, right, low, high),
        np.sqrt(np.maximum(np.diag(inverse), 0.0)),
        float(np.sqrt(scatter2)),
    )


def misleading(
    columns: FloatArray,
    reduced: FloatArray,
    residual: FloatArray,
    voice: IndexArray,
) -> FloatArray:
    """Returns (k,) the weighted RMS over voices of the shift of their coefficients by a residual.

    Averaging over voices would not reduce it: a mesh has much the same error in all of them.

    Args:
        columns: (N,k) columns.
        reduced: (N,k) columns without the part that the extrapolation explains.
        residual: (N,) residual, likewise without that part.
        voice: (N,) index of each entry's voice.
    """
    k = columns.shape[1]
    total, weight = np.zeros(k), np.full(k, 1e-30)
    for n, r in zip(*_equations(columns, reduced, residual, voice), strict=True):
        x = np.linalg.solve(n + _VAGUE**-2 * np.eye(k), r)
        total += np.diag(n) * x**2
        weight += np.diag(n)
    moved: FloatArray = np.sqrt(total / weight)
    return moved


def _equations(
    columns: FloatArray,
    reduced: FloatArray,
    residual: FloatArray,
    voice: IndexArray,
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Returns normal matrices (k,k) and right-hand sides (k,) of the voices."""
    normals, rights = [], []
    for i in np.unique(voice):
        rows = voice == i
        normals.append(columns[rows].T @ reduced[rows])
        rights.append(columns[rows].T @ residual[rows])
    return normals, rights


def _scatter2(normals: list[FloatArray], rights: list[FloatArray]) -> float:
    """Returns the variance between voices from Paule and Mandel's equation Q(τ²) = dof."""
    k = len(rights[0])
    vague = _VAGUE**-2 * np.eye(k)
    each = [np.linalg.solve(n + vague, r) for n, r in zip(normals, rights, strict=True)]
    known = sum(float(np.trace(np.linalg.solve(n + vague, n))) for n in normals)
    freedom = known - k

    def excess(scatter2: float) -> float:
        weights = [np.linalg.solve(np.eye(k) + scatter2 * n, n) for n in normals]
        total = sum(weights, np.zeros((k, k)))
        right = sum((w @ x for w, x in zip(weights, each, strict=True)), np.zeros(k))
        mean = np.linalg.lstsq(total, right, rcond=None)[0]
        off = [x - mean for x in each]
        return sum(float(d @ w @ d) for d, w in zip(off, weights, strict=True)) - freedom

    if freedom <= 0.5 or excess(0.0) <= 0.0:
        return 0.0
    most = _MOST_SCATTER**2
    return most if excess(most) >= 0.0 else float(brentq(excess, 0.0, most, xtol=1e-8))


def _bounded(
    normal: FloatArray, right: FloatArray, low: FloatArray | float, high: FloatArray | float
) -> FloatArray:
    """Returns x (k,) within bounds that minimizes ½ xᵀ normal x − rightᵀ x.

    A coefficient without information is the value within its bounds nearest to zero.
    """
    low, high = np.broadcast_to(low, right.shape), np.broadcast_to(high, right.shape)
    x: FloatArray = np.array(low, dtype=np.float64)
    # the solver needs low < high
    free = low < high
    if not free.any():
        return x
    right = (right - normal[:, ~free] @ x[~free])[free]
    normal, low, high = normal[np.ix_(free, free)], low[free], high[free]
    information = np.diag(normal)
    scale = np.sqrt(np.where(information > 0.0, information, 1.0))
    factor = np.linalg.cholesky(normal / np.outer(scale, scale) + _RIDGE * np.eye(len(scale)))
    # an active-set method ends exactly on bounds, not near them
    found = lsq_linear(
        factor.T, np.linalg.solve(factor, right / scale), (low * scale, high * scale), "bvls"
    )
    x[free] = np.clip(found.x / scale, low, high)
    return x
