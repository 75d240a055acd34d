"""Least squares on whitened residuals of several voices whose simulation is a little off.

A voice is one kind of signal in one recording. Two things are known of the simulation's own error
beside its size. What is left of its time step is, to first order, a multiple of what halving the
step has changed: that direction is free in each voice (Richardson's extrapolation with the factor
left open). And it misleads one voice more than another: voices that disagree by more than noise
are weighted alike, not by how much data they hold (the random-effects model of meta-analysis,
DerSimonian and Laird 1986).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, lsq_linear

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

# Standard deviation of the factor of what halving the step has changed; exact time would be 1.
_FACTOR = 1.0
_RIDGE = 1e-6
# What a voice alone is taken to know of a parameter, in sizes that matter.
_VAGUE = 30.0
# Largest scatter between voices, in sizes that matter.
_MOST_SCATTER = 3.0


@dataclass(frozen=True)
class Extrapolation:
    """The part of a simulation's error that lies along a known direction.

    Attributes:
        direction: (N,) whitened, what the last halving of the time step has changed.
        voice: (N,) number of the voice that an entry is of.
    """

    direction: FloatArray
    voice: IndexArray

    def without(self, values: FloatArray, rows: BoolArray) -> FloatArray:
        """Returns values (N,) or (N,k) less what the direction explains of them.

        Args:
            values: residuals or columns.
            rows: (N,) entries by which the factor is found, in each voice.
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
        x: (k,).
        std: (k,) of it.
        scatter: standard deviation between voices beyond what noise explains.
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
    """Returns x (k,) between bounds that explains a residual (N,) best.

    Args:
        columns: (N,k).
        reduced: (N,k) columns without what is free to explain itself.
        residual: (N,) without that too.
        low: bounds (k,).
        high: bounds (k,).
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
    """Returns what voices agree on, in columns' units of sizes that matter; see above.

    Args:
        columns: (N,k).
        reduced: (N,k) columns without what is free to explain itself.
        residual: (N,) without that too.
        voice: (N,) number of the voice that an entry is of.
        low: bounds (k,).
        high: bounds (k,).
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
    """Returns (k,) how far a residual moves the coefficients in one voice, in the mean square.

    What a mesh does is much the same in all voices, so their mean would not be smaller.

    Args:
        columns: (N,k).
        reduced: (N,k) columns without what is free to explain itself.
        residual: (N,) without that too.
        voice: (N,) number of the voice that an entry is of.
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
    """Returns the variance between voices, by Paule and Mandel's equation Q(τ²) = dof."""
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
    """Returns x (k,) between bounds with least ½ xᵀ normal x − rightᵀ x.

    Where nothing is known of a coefficient, it is the value between its bounds nearest to zero.
    """
    low, high = np.broadcast_to(low, right.shape), np.broadcast_to(high, right.shape)
    x: FloatArray = np.array(low, dtype=np.float64)
    # the solver wants room between bounds
    free = low < high
    if not free.any():
        return x
    right = (right - normal[:, ~free] @ x[~free])[free]
    normal, low, high = normal[np.ix_(free, free)], low[free], high[free]
    information = np.diag(normal)
    scale = np.sqrt(np.where(information > 0.0, information, 1.0))
    factor = np.linalg.cholesky(normal / np.outer(scale, scale) + _RIDGE * np.eye(len(scale)))
    # an active set method ends on bounds, not near them
    found = lsq_linear(
        factor.T, np.linalg.solve(factor, right / scale), (low * scale, high * scale), "bvls"
    )
    x[free] = np.clip(found.x / scale, low, high)
    return x
