"""Linear-quadratic optimal control with norm bounds, for any linear dynamics and weights.

    minimise    Σ_{j=0}^{N} (x_j−x̄_j)ᵀ Q_j (x_j−x̄_j) + Σ_{j=0}^{N−1} (v_j−v̄_j)ᵀ R_j (v_j−v̄_j)
    subject to  x_{j+1} = A_j x_j + B_j v_j + c_j,   ‖C x_j + d‖ ≤ φ,   ‖E v_j + e‖ ≤ ψ.

It is a convex second-order cone programme, like the local problem (Eq. loc_mpc).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.norm_bounds import NormBound, NormBounds, stacked_bounds, violation
from drake_dress.models.control.reduced_problem import ReducedProblem


@dataclass(frozen=True)
class LinearQuadraticProblem:
    """A problem with n states, m inputs, N steps. `linear_quadratic` builds it from fewer arrays.

    Attributes:
        start: (n,) x_0.
        a: (N,n,n) A. b: (N,n,m) B. c: (N,n).
        state_weight: (N+1,n,n) Q, symmetric, positive semidefinite; state_target: (N+1,n) x̄.
        input_weight: (N,m,m) R, symmetric, positive definite; input_target: (N,m) v̄.
        state_bounds: on x_0 … x_N; those on x_0 are ignored, because no input changes it.
        input_bounds: on v_0 … v_{N−1}.
        price: penalty on the sum of all excesses, cost per unit of a bound. Infeasible bounds are
            violated by the smallest total amount.
    """

    start: FloatArray
    a: FloatArray
    b: FloatArray
    c: FloatArray
    state_weight: FloatArray
    state_target: FloatArray
    input_weight: FloatArray
    input_target: FloatArray
    state_bounds: NormBounds
    input_bounds: NormBounds
    price: float

    @property
    def horizon(self) -> int:
        """N."""
        return len(self.b)

    def states(self, v: FloatArray) -> FloatArray:
        """Returns the states (N+1,n) that result from inputs `v` (N,m)."""
        x = np.empty((self.horizon + 1, len(self.start)))
        x[0] = self.start
        for j in range(self.horizon):
            x[j + 1] = self.a[j] @ x[j] + self.b[j] @ v[j] + self.c[j]
        return x

    def cost(self, v: FloatArray) -> float:
        """Returns the cost of inputs `v` (N,m)."""
        of_x, of_v = self.states(v) - self.state_target, v - self.input_target
        return float(
            np.einsum("ta,tab,tb->", of_x, self.state_weight, of_x)
            + np.einsum("ta,tab,tb->", of_v, self.input_weight, of_v)
        )

    def violation(self, v: FloatArray) -> float:
        """Returns the largest bound violation of inputs `v` (N,m); 0 if none."""
        return violation(self.state_bounds, self.states(v), self.input_bounds, v)

    def reduced(self) -> ReducedProblem:
        """Returns the problem in deviations from the unforced states, with diagonal input weights.

        With R = U D Uᵀ, U unit lower triangular, the inputs Uᵀ v have the diagonal weight D.
        """
        free = self.states(np.zeros_like(self.input_target))
        factor = np.linalg.cholesky(self.input_weight)
        root = np.diagonal(factor, axis1=1, axis2=2)
        unit = factor / root[:, None, :]
        to_inputs = np.asarray(np.linalg.inv(np.swapaxes(unit, 1, 2)), np.float64)
        r = 2.0 * root**2
        target = np.einsum("tba,tb->ta", unit, self.input_target)
        of_x, of_v = self.state_bounds, self.input_bounds
        return ReducedProblem(
            self.a,
            self.b @ to_inputs,
            2.0 * self.state_weight,
            2.0 * np.einsum("tab,tb->ta", self.state_weight, free - self.state_target),
            r,
            -r * target,
            NormBounds(
                of_x.matrix,
                of_x.offset + np.einsum("tkab,tb->tka", of_x.matrix, free),
                of_x.radius,
            ),
            NormBounds(of_v.matrix @ to_inputs[:, None], of_v.offset, of_v.radius),
            to_inputs,
        )

    def about_start(self) -> ReducedProblem:
        """Returns the problem in all n states; `reduced` keeps them all."""
        return self.reduced()


def linear_quadratic(
    start: npt.ArrayLike,
    dynamics: tuple[npt.ArrayLike, ...],
    weights: tuple[npt.ArrayLike, npt.ArrayLike],
    steps: int,
    *,
    targets: tuple[npt.ArrayLike, npt.ArrayLike] = (0.0, 0.0),
    state_bounds: Sequence[NormBound] = (),
    input_bounds: Sequence[NormBound] = (),
    price: float = 1e3,
) -> LinearQuadraticProblem:
    """Returns a problem; an array that is the same at all steps may be given once.

    Args:
        start: (n,) x_0.
        dynamics: A (n,n) or (N,n,n), B (n,m) or (N,n,m) and, if given, c (n,) or (N,n).
        weights: Q (n,n) or (N+1,n,n) and R (m,m) or (N,m,m).
        steps: N.
        targets: x̄ and v̄, a number, (n,) or (N+1,n), and a number, (m,) or (N,m).
        state_bounds: on x_1 … x_N; none if the sequence is empty.
        input_bounds: on v_0 … v_{N−1}.
        price: see `LinearQuadraticProblem`.

    Raises:
        ValueError: `steps` is less than 1, or an array has the wrong shape, is not finite, or is
            not a valid weight.
    """
    if steps < 1:
        raise ValueError(f"steps is {steps}, expected 1 or more")
    x = _array("start", start, 1)
    n = len(x)
    a = _over_time("A", dynamics[0], (steps, n, n))
    m = np.shape(dynamics[1])[-1] if np.ndim(dynamics[1]) else 1
    b = _over_time("B", dynamics[1], (steps, n, m))
    return LinearQuadraticProblem(
        x,
        a,
        b,
        _over_time("c", dynamics[2] if len(dynamics) > 2 else 0.0, (steps, n)),
        _weight("Q", weights[0], (steps + 1, n, n), least=0.0),
        _over_time("the target of states", targets[0], (steps + 1, n)),
        _weight("R", weights[1], (steps, m, m), least=1e-12),
        _over_time("the target of inputs", targets[1], (steps, m)),
        stacked_bounds(state_bounds, steps + 1, n, 1),
        stacked_bounds(input_bounds, steps, m, 0),
        price,
    )


def _array(name: str, given: npt.ArrayLike, dimensions: int) -> FloatArray:
    array = np.asarray(given, dtype=np.float64)
    if array.ndim != dimensions:
        raise ValueError(f"{name} has the shape {array.shape}, expected {dimensions} dimension(s)")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} is not finite")
    return array


def _over_time(name: str, given: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Returns an array for each time step, broadcast if it has no time dimension."""
    array = np.asarray(given, dtype=np.float64)
    if array.shape not in ((), shape[1:], shape) or (array.ndim == 0 and len(shape) > 2):
        raise ValueError(f"{name} has the shape {array.shape}, expected {shape[1:]} or {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} is not finite")
    return np.array(np.broadcast_to(array, shape))


def _weight(
    name: str, given: npt.ArrayLike, shape: tuple[int, int, int], least: float
) -> FloatArray:
    """Returns symmetric weights whose eigenvalues are at least `least` times the largest."""
    weight = _over_time(name, given, shape)
    if not np.allclose(weight, np.swapaxes(weight, 1, 2)):
        raise ValueError(f"{name} is not symmetric")
    values = np.linalg.eigvalsh(weight)
    largest = np.abs(values).max()
    if values.min() < least * largest - 1e-12 * largest or (least > 0.0 and values.min() <= 0.0):
        kind = "positive definite" if least > 0.0 else "positive semidefinite"
        raise ValueError(f"{name} has the eigenvalue {values.min():.3g}, expected {kind}")
    return weight
