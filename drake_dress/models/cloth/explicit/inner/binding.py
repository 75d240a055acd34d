"""The forces that bind nodes in contact: S λ = lack on the rows that their modes bind.

S = E P⁻¹ Eᵀ gives the motion of the nodes under forces on them. A sticking node has three unknowns.
A slipping node has one, its normal force ν: its force is ν times `along`, its row the motion along
`across`. In the forward problem `along` is n + μ d and `across` is n; in the backward problem they
are exchanged. If they are the same, the system is symmetric.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np

from drake_dress.models.arrays import IntArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.factor.masked import Factor, restricted_solve, solve_into
from drake_dress.models.cloth.filtered_cg import matrix_product
from drake_dress.models.cloth.matrices import Csr
from drake_dress.models.cloth.vectors import add, dot, turn

# Basis vectors that GMRES keeps before it restarts.
_RESTART = 60
# Whether all of P is used, P or its block between the nodes, the nodes, a factor and scratch.
Conditioner = tuple[Any, ...]


def by_neighbours(matrix: Csr, factor: Factor, nodes: IntArray) -> Conditioner:
    """Returns the preconditioner P_cc: forces that move nodes (c,) while all others stay.

    Args:
        matrix: P.
        factor: any; its values are not used.
        nodes: (c,).
    """
    block = _block(matrix.indptr, matrix.indices, matrix.data, nodes)
    scratch = np.empty((0, 3))
    order = factor.pattern.permutation
    return False, block, nodes, factor.blocks, order, scratch, scratch, np.empty((0, 4))


def by_all(matrix: Csr, factor: Factor, nodes: IntArray) -> Conditioner:
    """Returns the preconditioner P_cc − P_cf P_ff⁻¹ P_fc: forces on nodes while others follow.

    It is the inverse of S if all directions of the nodes are bound. If all normals are equal, the
    solver needs one iteration.

    Args:
        matrix: P.
        factor: factor without `nodes` and all nodes that stay.
        nodes: (c,).
    """
    n = len(matrix.indptr) - 1
    whole = matrix.indptr, matrix.indices, matrix.data
    order = factor.pattern.permutation
    scratch = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 4))
    return True, whole, nodes, factor.blocks, order, *scratch


@nb.njit(cache=True, nogil=True)
def bind(  # type: ignore[no-untyped-def]
    part, conditioner, mode, normal, push, backward, lack, guess, tolerance, most
):
    """Returns force (c,3), motion S λ (c,3), ν (c,) of slipping nodes, and iterations done.

    Args:
        part: result of `Factor.part` for the nodes.
        conditioner: result of `by_neighbours` or `by_all`.
        mode: (c,) STICK takes all of `lack`, SLIP one row, others none.
        normal: (c,3) unit.
        push: (c,3) friction of slipping nodes per normal force, or (0,3) for none.
        backward: solve the transposed system.
        lack: (c,3) motion to reach.
        guess: (c,3) forces to start from, without friction, or (0,3).
        tolerance: relative to `lack`, in the preconditioner's norm.
        most: upper limit of iterations.
    """
    c = mode.shape[0]
    oblique = False
    for i in range(push.shape[0]):
        oblique = oblique or push[i, 0] != 0.0 or push[i, 1] != 0.0 or push[i, 2] != 0.0
    if not oblique:
        along, across = normal, normal
    elif backward:
        along, across = normal, normal + push
    else:
        along, across = normal + push, normal
    size = 0
    for i in range(c):
        size += 3 if mode[i] == STICK else 1 if mode[i] == SLIP else 0
    unknown = np.zeros(size)
    moved = np.zeros((c, 3))
    if guess.shape[0]:
        force = np.empty((c, 3))
        _reduce(guess, mode, normal, unknown)
        _expand(unknown, mode, along, force)
        restricted_solve(part, force, moved)
    system = part, conditioner, mode, normal, along, across
    started = guess.shape[0] > 0
    if oblique:
        iterations = _generalised_residuals(system, lack, unknown, moved, started, tolerance, most)
    else:
        iterations = _conjugate_gradients(system, lack, unknown, moved, started, tolerance, most)
    force = np.empty((c, 3))
    _expand(unknown, mode, along, force)
    multiplier = np.zeros(c)
    at = 0
    for i in range(c):
        if mode[i] == STICK:
            for k in range(3):
                multiplier[i] += force[i, k] * normal[i, k]
            at += 3
        elif mode[i] == SLIP:
            multiplier[i] = unknown[at]
            at += 1
    return force, moved, multiplier, iterations


@nb.njit(cache=True, nogil=True, forceinline=True)
def _conjugate_gradients(  # type: ignore[no-untyped-def]
    system, lack, unknown, moved, started, tolerance, most
):
    """Improves `unknown` and its motion in place; returns the number of iterations."""
    part, conditioner, mode, normal, along, across = system
    residual = np.empty_like(unknown)
    conditioned = np.empty_like(unknown)
    rows = np.empty_like(unknown)
    force = np.empty_like(moved)
    step = np.empty_like(moved)
    _reduce(lack, mode, across, residual)
    _condition(conditioner, mode, normal, residual, conditioned, force, step)
    rho = dot(residual, conditioned)
    goal = tolerance * tolerance * max(rho, 1e-300)
    if started:
        _reduce(moved, mode, across, rows)
        add(residual, -1.0, rows)
        _condition(conditioner, mode, normal, residual, conditioned, force, step)
        rho = dot(residual, conditioned)
    direction = conditioned.copy()
    iterations = 0
    while iterations < most and rho > goal:
        _expand(direction, mode, along, force)
        restricted_solve(part, force, step)
        _reduce(step, mode, across, rows)
        curvature = dot(direction, rows)
        if curvature <= 0.0:
            break
        alpha = rho / curvature
        add(unknown, alpha, direction)
        add(moved, alpha, step)
        add(residual, -alpha, rows)
        _condition(conditioner, mode, normal, residual, conditioned, force, step)
        new = dot(residual, conditioned)
        beta = new / rho
        rho = new
        turn(direction, beta, conditioned)
        iterations += 1
    return iterations


@nb.njit(cache=True, nogil=True, forceinline=True)
def _generalised_residuals(  # type: ignore[no-untyped-def]
    system, lack, unknown, moved, started, tolerance, most
):
    """The same for along ≠ across: GMRES (Saad and Schultz 1986).

    It is preconditioned from the right, in the inner product of the preconditioner, so that the
    residual is measured as in conjugate gradients. Vectors are only as long as the contact problem,
    so all of them are kept up to a restart.
    """
    part, conditioner, mode, normal, along, across = system
    size = unknown.shape[0]
    wanted = np.empty(size)
    residual = np.empty(size)
    conditioned = np.empty(size)
    force = np.empty_like(moved)
    scratch = np.empty_like(moved)
    _reduce(lack, mode, across, wanted)
    _condition(conditioner, mode, normal, wanted, conditioned, force, scratch)
    length = np.sqrt(max(dot(wanted, conditioned), 0.0))
    goal = tolerance * max(length, 1e-150)
    basis = np.empty((_RESTART + 1, size))
    ahead = np.empty((_RESTART + 1, size))
    motion = np.empty((_RESTART, moved.shape[0], 3))
    hessenberg = np.zeros((_RESTART + 1, _RESTART))
    cosine, sine = np.empty(_RESTART), np.empty(_RESTART)
    right = np.empty(_RESTART + 1)
    iterations = 0
    residual[:] = wanted
    while iterations < most:
        if started or iterations:
            _reduce(moved, mode, across, residual)
            for i in range(size):
                residual[i] = wanted[i] - residual[i]
            _condition(conditioner, mode, normal, residual, conditioned, force, scratch)
            length = np.sqrt(max(dot(residual, conditioned), 0.0))
        if length <= goal:
            break
        for i in range(size):
            basis[0, i] = residual[i] / length
            ahead[0, i] = conditioned[i] / length
        right[0] = length
        count = 0
        while count < _RESTART and iterations < most and abs(right[count]) > goal:
            j = count
            _expand(ahead[j], mode, along, force)
            restricted_solve(part, force, motion[j])
            _reduce(motion[j], mode, across, residual)
            for i in range(j + 1):
                h = dot(residual, ahead[i])
                hessenberg[i, j] = h
                add(residual, -h, basis[i])
            _condition(conditioner, mode, normal, residual, conditioned, force, scratch)
            h = np.sqrt(max(dot(residual, conditioned), 0.0))
            for i in range(j):
                u, w = hessenberg[i, j], hessenberg[i + 1, j]
                hessenberg[i, j] = cosine[i] * u + sine[i] * w
                hessenberg[i + 1, j] = cosine[i] * w - sine[i] * u
            u = hessenberg[j, j]
            length = np.sqrt(u * u + h * h)
            iterations += 1
            if length == 0.0:
                break
            cosine[j], sine[j] = u / length, h / length
            hessenberg[j, j] = length
            right[j + 1] = -sine[j] * right[j]
            right[j] = cosine[j] * right[j]
            count += 1
            if h <= 1e-14 * length:
                break
            for i in range(size):
                basis[j + 1, i] = residual[i] / h
                ahead[j + 1, i] = conditioned[i] / h
        if count == 0:
            break
        for i in range(count - 1, -1, -1):
            for j in range(i + 1, count):
                right[i] -= hessenberg[i, j] * right[j]
            right[i] /= hessenberg[i, i]
        for j in range(count):
            add(unknown, right[j], ahead[j])
            add(moved, right[j], motion[j])
        if abs(right[count]) <= goal:
            break
    return iterations


@nb.njit(cache=True, nogil=True, forceinline=True)
def _condition(conditioner, mode, normal, residual, out, z, force):  # type: ignore[no-untyped-def]
    """Writes approximate forces for the motions `residual`; `z`, `force` (c,3) are scratch."""
    around, (indptr, indices, data), nodes, blocks, permutation, moved, others, work = conditioner
    _expand(residual, mode, normal, z)
    if not around:
        matrix_product(indptr, indices, data, z, force)
    else:
        others[:] = 0.0
        subtract_columns(indptr, indices, data, nodes, z, others)
        solve_into(blocks, permutation, others, moved, work)
        for k in range(nodes.shape[0]):
            for c in range(3):
                moved[nodes[k], c] = z[k, c]
        product_rows(indptr, indices, data, nodes, moved, force)
    _reduce(force, mode, normal, out)


@nb.njit(cache=True, nogil=True)
def _expand(unknown, mode, direction, out):  # type: ignore[no-untyped-def]
    """Writes vectors (c,3): three values of sticking nodes, `direction` times others'."""
    at = 0
    for i in range(mode.shape[0]):
        if mode[i] == SLIP:
            size = unknown[at]
            out[i, 0] = size * direction[i, 0]
            out[i, 1] = size * direction[i, 1]
            out[i, 2] = size * direction[i, 2]
            at += 1
        elif mode[i] == STICK:
            out[i, 0] = unknown[at]
            out[i, 1] = unknown[at + 1]
            out[i, 2] = unknown[at + 2]
            at += 3
        else:
            out[i, 0] = 0.0
            out[i, 1] = 0.0
            out[i, 2] = 0.0


@nb.njit(cache=True, nogil=True)
def _reduce(z, mode, direction, out):  # type: ignore[no-untyped-def]
    """Writes the rows of (c,3): all three of sticking nodes, along `direction` of others."""
    at = 0
    for i in range(mode.shape[0]):
        if mode[i] == SLIP:
            out[at] = (
                z[i, 0] * direction[i, 0] + z[i, 1] * direction[i, 1] + z[i, 2] * direction[i, 2]
            )
            at += 1
        elif mode[i] == STICK:
            out[at] = z[i, 0]
            out[at + 1] = z[i, 1]
            out[at + 2] = z[i, 2]
            at += 3


@nb.njit(cache=True, nogil=True)
def subtract_columns(indptr, indices, data, nodes, z, out):  # type: ignore[no-untyped-def]
    """Subtracts P E `z`, z (k,3), from `out` (n,3) in place, for a symmetric CSR matrix P."""
    for k in range(nodes.shape[0]):
        i = nodes[k]
        for q in range(indptr[i], indptr[i + 1]):
            j = indices[q]
            for c in range(3):
                out[j, c] -= data[q] * z[k, c]


@nb.njit(cache=True, nogil=True)
def product_rows(indptr, indices, data, nodes, z, out):  # type: ignore[no-untyped-def]
    """Writes the rows of P z, (n,3), at `nodes` (k,) to `out` (k,3)."""
    for k in range(nodes.shape[0]):
        i = nodes[k]
        f0, f1, f2 = 0.0, 0.0, 0.0
        for q in range(indptr[i], indptr[i + 1]):
            j = indices[q]
            f0 += data[q] * z[j, 0]
            f1 += data[q] * z[j, 1]
            f2 += data[q] * z[j, 2]
        out[k, 0] = f0
        out[k, 1] = f1
        out[k, 2] = f2


@nb.njit(cache=True, nogil=True)
def _block(indptr, indices, data, nodes):  # type: ignore[no-untyped-def]
    """Returns the block of a CSR matrix between `nodes` (c,), as CSR."""
    k = nodes.shape[0]
    local = np.full(indptr.shape[0] - 1, -1, dtype=np.int32)
    for a in range(k):
        local[nodes[a]] = a
    start = np.zeros(k + 1, dtype=np.int32)
    for a in range(k):
        i = nodes[a]
        for q in range(indptr[i], indptr[i + 1]):
            if local[indices[q]] >= 0:
                start[a + 1] += 1
    for a in range(k):
        start[a + 1] += start[a]
    column = np.empty(start[k], dtype=np.int32)
    value = np.empty(start[k])
    at = 0
    for a in range(k):
        i = nodes[a]
        for q in range(indptr[i], indptr[i + 1]):
            b = local[indices[q]]
            if b >= 0:
                column[at] = b
                value[at] = data[q]
                at += 1
    return start, column, value
