"""Compiled operations on small dense matrices for a step of constrained DDP."""

from __future__ import annotations

import numba as nb
import numpy as np

# A row is dependent if less than this share of its input part is left after orthogonalization.
_DEPENDENT = 1e-7


@nb.njit(cache=True, nogil=True, error_model="numpy")
def add_curvature(matrix, normal, factor, out):  # type: ignore[no-untyped-def]
    """Adds factor · Cᵀ(I − nnᵀ)C to `out` (n,n), with `matrix` C (3,n) and `normal` n (3,)."""
    n = matrix.shape[1]
    row = np.empty(n)
    for b in range(n):
        row[b] = matrix[0, b] * normal[0] + matrix[1, b] * normal[1] + matrix[2, b] * normal[2]
    for a in range(n):
        m0, m1, m2 = matrix[0, a], matrix[1, a], matrix[2, a]
        if m0 == 0.0 and m1 == 0.0 and m2 == 0.0:
            continue
        for b in range(n):
            out[a, b] += factor * (
                m0 * matrix[0, b] + m1 * matrix[1, b] + m2 * matrix[2, b] - row[a] * row[b]
            )


@nb.njit(cache=True, nogil=True, error_model="numpy")
def split_rows(rows, count, m, basis, residual, owner, coefficient):  # type: ignore[no-untyped-def]
    """Splits rows [G_v | G_x | s] into an orthonormal basis in v and a residual v cannot change.

    rows = coefficient · basis + residual, with the basis [Y | Z | t]. For a row that supplied a
    basis vector, `owner` is the index of that vector and the residual is zero. For any other row
    `owner` is −1 and the v part of the residual is zero. The pivot is the row with the largest
    remaining share. Returns the size of the basis.
    """
    width = rows.shape[1]
    rank = 0
    scale = np.empty(count)
    for i in range(count):
        owner[i] = -1
        s = 0.0
        for c in range(m):
            s += rows[i, c] ** 2
        scale[i] = s
        for c in range(width):
            residual[i, c] = rows[i, c]
        for k in range(m):
            coefficient[i, k] = 0.0
    while rank < m:
        best, largest = -1, _DEPENDENT**2
        for i in range(count):
            if owner[i] >= 0 or scale[i] == 0.0:
                continue
            s = 0.0
            for c in range(m):
                s += residual[i, c] ** 2
            if s > largest * scale[i]:
                best, largest = i, s / scale[i]
        if best < 0:
            break
        length = 0.0
        for c in range(m):
            length += residual[best, c] ** 2
        length = np.sqrt(length)
        for c in range(width):
            basis[rank, c] = residual[best, c] / length
        for i in range(count):
            if owner[i] >= 0:
                continue
            along = 0.0
            for c in range(m):
                along += residual[i, c] * basis[rank, c]
            coefficient[i, rank] = along
            for c in range(width):
                residual[i, c] -= along * basis[rank, c]
        owner[best] = rank
        rank += 1
    return rank


@nb.njit(cache=True, nogil=True, error_model="numpy")
def complete_basis(basis, rank, m, free):  # type: ignore[no-untyped-def]
    """Fills `free` (m−rank,m) with unit vectors orthogonal to the basis and to each other."""
    found = 0
    tried = np.zeros(m, dtype=np.bool_)
    work = np.empty(m)
    best_row = np.empty(m)
    while rank + found < m:
        best, largest = -1, -1.0
        for c in range(m):
            if tried[c]:
                continue
            for a in range(m):
                work[a] = 0.0
            work[c] = 1.0
            for _ in range(2):
                for k in range(rank):
                    s = 0.0
                    for a in range(m):
                        s += work[a] * basis[k, a]
                    for a in range(m):
                        work[a] -= s * basis[k, a]
                for k in range(found):
                    s = 0.0
                    for a in range(m):
                        s += work[a] * free[k, a]
                    for a in range(m):
                        work[a] -= s * free[k, a]
            s = 0.0
            for a in range(m):
                s += work[a] ** 2
            if s > largest:
                best, largest = c, s
                for a in range(m):
                    best_row[a] = work[a]
        tried[best] = True
        length = np.sqrt(largest)
        for a in range(m):
            free[found, a] = best_row[a] / length
        found += 1
    return found


@nb.njit(cache=True, nogil=True, error_model="numpy")
def solve_positive_definite(h, size, rhs, columns):  # type: ignore[no-untyped-def]
    """Solves h z = rhs in place by Cholesky; returns whether h is positive definite."""
    for i in range(size):
        for j in range(i + 1):
            s = h[i, j]
            for k in range(j):
                s -= h[i, k] * h[j, k]
            if i == j:
                if s <= 0.0:
                    return False
                h[i, i] = np.sqrt(s)
            else:
                h[i, j] = s / h[j, j]
    for c in range(columns):
        for i in range(size):
            s = rhs[i, c]
            for k in range(i):
                s -= h[i, k] * rhs[k, c]
            rhs[i, c] = s / h[i, i]
        for i in range(size - 1, -1, -1):
            s = rhs[i, c]
            for k in range(i + 1, size):
                s -= h[k, i] * rhs[k, c]
            rhs[i, c] = s / h[i, i]
    return True
