"""A sparse LDLᵀ factor of P that can leave nodes out.

P's pattern never changes, the set of nodes with a prescribed motion does at every step. So the
ordering and the elimination tree are found once; a numeric factor then treats masked nodes as
identity rows, which is the factor of P_ff with the order of all nodes kept. The algorithm is the
up-looking factorisation of Davis, "Direct Methods for Sparse Linear Systems", ch. 4.

What contact asks of P⁻¹ is little: how the nodes in contact move under forces on those same nodes.
The columns of L that this takes are the paths from these nodes to the root of the elimination tree
(`part`): a fifth to a third of the factor for an arm in a sleeve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray


@dataclass
class Factor:
    """Numeric LDLᵀ of P with some nodes left out; made by `SymbolicFactor.factorize`."""

    column_start: IntArray
    column_end: IntArray
    row: IntArray
    value: FloatArray
    inverse_diagonal: FloatArray
    permutation: IntArray
    inverse_permutation: IntArray
    parent: IntArray
    masked: BoolArray

    @property
    def arrays(self) -> tuple[IntArray, IntArray, IntArray, FloatArray, FloatArray, IntArray]:
        """The factor as kernels take it."""
        return (
            self.column_start,
            self.column_end,
            self.row,
            self.value,
            self.inverse_diagonal,
            self.permutation,
        )

    def part(self, nodes: IntArray) -> tuple[Any, ...]:
        """Returns what P_ff⁻¹ between `nodes` (k,) needs of L, for `restricted_solve`.

        The columns that the nodes reach in the elimination tree, numbered anew: they fit in the
        first cache. The last array is scratch.
        """
        columns = _reach(self.parent, self.inverse_permutation, nodes)
        found: tuple[Any, ...] = _part(
            self.column_start,
            self.column_end,
            self.row,
            self.value,
            self.inverse_diagonal,
            self.inverse_permutation,
            columns,
            nodes,
        )
        return found

    def solve_pair(self, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns P_ff⁻¹ of two (n,3) right-hand sides in one pass over the factor."""
        out = np.empty_like(first), np.empty_like(second)
        _solve_pair(*self.arrays, self.masked, first, second, *out)
        return out

    def solve(self, rhs: FloatArray) -> FloatArray:
        """Returns P_ff⁻¹ rhs_f for (n,3) `rhs`, with zeros in masked rows."""
        out = np.empty_like(rhs)
        solve_into(
            self.column_start,
            self.column_end,
            self.row,
            self.value,
            self.inverse_diagonal,
            self.permutation,
            self.masked,
            rhs,
            out,
            np.empty_like(rhs),
        )
        return out


class SymbolicFactor:
    """Ordering and elimination tree of a symmetric sparse matrix.

    Args:
        matrix: (n,n) symmetric positive definite, CSR or CSC.
    """

    def __init__(self, matrix: sp.csc_array) -> None:
        n = matrix.shape[0]
        lu = spla.splu(
            sp.csc_matrix(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        # perm_c maps old to new; its argsort is the order of elimination.
        self.permutation = np.argsort(lu.perm_c).astype(np.int32)
        self._inverse_permutation = np.argsort(self.permutation).astype(np.int32)
        permuted = sp.csc_matrix(matrix)[self.permutation][:, self.permutation]
        upper = sp.csc_matrix(sp.triu(permuted))
        upper.sort_indices()
        self._upper_start = upper.indptr.astype(np.int32)
        self._upper_row = upper.indices.astype(np.int32)
        self._upper_value = upper.data.astype(np.float64)
        self._parent = np.empty(n, dtype=np.int32)
        counts = np.empty(n, dtype=np.int32)
        _elimination_tree(n, self._upper_start, self._upper_row, self._parent, counts)
        self._column_start = np.zeros(n + 1, dtype=np.int32)
        self._column_start[1:] = np.cumsum(counts)
        self.fill = int(self._column_start[-1])
        self.node_count = n

    def factorize(self, masked: BoolArray) -> Factor:
        """Returns the factor with the nodes where `masked` (n,) is True left out.

        Raises:
            ValueError: a pivot is not positive: the matrix is not positive definite.
        """
        n = self.node_count
        permuted_mask = masked[self.permutation]
        column_end = np.empty(n, dtype=np.int32)
        row = np.empty(self.fill, dtype=np.int32)
        value = np.empty(self.fill)
        inverse_diagonal = np.empty(n)
        failed = _factorize(
            n,
            self._upper_start,
            self._upper_row,
            self._upper_value,
            self._parent,
            self._column_start,
            permuted_mask,
            column_end,
            row,
            value,
            inverse_diagonal,
        )
        if failed >= 0:
            raise ValueError(f"pivot of node {int(self.permutation[failed])} is not positive")
        return Factor(
            self._column_start,
            column_end,
            row,
            value,
            inverse_diagonal,
            self.permutation,
            self._inverse_permutation,
            self._parent,
            masked.copy(),
        )


@nb.njit(cache=True, nogil=True)
def solve_into(
    column_start: IntArray,
    column_end: IntArray,
    row: IntArray,
    value: FloatArray,
    inverse_diagonal: FloatArray,
    permutation: IntArray,
    masked: BoolArray,
    rhs: FloatArray,
    out: FloatArray,
    work: FloatArray,
) -> None:
    """Writes P_ff⁻¹ rhs_f (n,3) into `out`; `work` (n,3) is scratch."""
    n = rhs.shape[0]
    for i in range(n):
        p = permutation[i]
        if masked[p]:
            work[i, 0] = 0.0
            work[i, 1] = 0.0
            work[i, 2] = 0.0
        else:
            work[i, 0] = rhs[p, 0]
            work[i, 1] = rhs[p, 1]
            work[i, 2] = rhs[p, 2]
    for i in range(n):
        w0, w1, w2 = work[i, 0], work[i, 1], work[i, 2]
        for q in range(column_start[i], column_end[i]):
            r = row[q]
            v = value[q]
            work[r, 0] -= v * w0
            work[r, 1] -= v * w1
            work[r, 2] -= v * w2
    for i in range(n - 1, -1, -1):
        d = inverse_diagonal[i]
        w0, w1, w2 = work[i, 0] * d, work[i, 1] * d, work[i, 2] * d
        for q in range(column_start[i], column_end[i]):
            r = row[q]
            v = value[q]
            w0 -= v * work[r, 0]
            w1 -= v * work[r, 1]
            w2 -= v * work[r, 2]
        work[i, 0] = w0
        work[i, 1] = w1
        work[i, 2] = w2
        p = permutation[i]
        out[p, 0] = w0
        out[p, 1] = w1
        out[p, 2] = w2


@nb.njit(cache=True, nogil=True)
def _solve_pair(  # type: ignore[no-untyped-def]
    start, end, row, value, inverse_diagonal, permutation, masked, first, second, x, y
):
    n = first.shape[0]
    work = np.zeros((n, 6))
    for i in range(n):
        p = permutation[i]
        if not masked[p]:
            for c in range(3):
                work[i, c] = first[p, c]
                work[i, c + 3] = second[p, c]
    for i in range(n):
        w0, w1, w2 = work[i, 0], work[i, 1], work[i, 2]
        w3, w4, w5 = work[i, 3], work[i, 4], work[i, 5]
        for q in range(start[i], end[i]):
            r = row[q]
            v = value[q]
            work[r, 0] -= v * w0
            work[r, 1] -= v * w1
            work[r, 2] -= v * w2
            work[r, 3] -= v * w3
            work[r, 4] -= v * w4
            work[r, 5] -= v * w5
    for i in range(n - 1, -1, -1):
        d = inverse_diagonal[i]
        w0, w1, w2 = work[i, 0] * d, work[i, 1] * d, work[i, 2] * d
        w3, w4, w5 = work[i, 3] * d, work[i, 4] * d, work[i, 5] * d
        for q in range(start[i], end[i]):
            r = row[q]
            v = value[q]
            w0 -= v * work[r, 0]
            w1 -= v * work[r, 1]
            w2 -= v * work[r, 2]
            w3 -= v * work[r, 3]
            w4 -= v * work[r, 4]
            w5 -= v * work[r, 5]
        work[i, 0] = w0
        work[i, 1] = w1
        work[i, 2] = w2
        work[i, 3] = w3
        work[i, 4] = w4
        work[i, 5] = w5
        p = permutation[i]
        x[p, 0] = w0
        x[p, 1] = w1
        x[p, 2] = w2
        y[p, 0] = w3
        y[p, 1] = w4
        y[p, 2] = w5


@nb.njit(cache=True, nogil=True)
def _reach(parent, inverse_permutation, nodes):  # type: ignore[no-untyped-def]
    n = parent.shape[0]
    marked = np.zeros(n, dtype=np.bool_)
    count = 0
    for k in range(nodes.shape[0]):
        i = inverse_permutation[nodes[k]]
        while i >= 0 and not marked[i]:
            marked[i] = True
            count += 1
            i = parent[i]
    columns = np.empty(count, dtype=np.int32)
    count = 0
    for i in range(n):
        if marked[i]:
            columns[count] = i
            count += 1
    return columns


@nb.njit(cache=True, nogil=True)
def _part(  # type: ignore[no-untyped-def]
    start, end, row, value, inverse_diagonal, inverse_permutation, columns, nodes
):
    count = columns.shape[0]
    local = np.empty(inverse_diagonal.shape[0], dtype=np.int32)
    size = 0
    for s in range(count):
        local[columns[s]] = s
        size += end[columns[s]] - start[columns[s]]
    part_start = np.empty(count + 1, dtype=np.int32)
    part_row = np.empty(size, dtype=np.int32)
    part_value = np.empty(size)
    part_inverse = np.empty(count)
    at = 0
    for s in range(count):
        i = columns[s]
        part_start[s] = at
        part_inverse[s] = inverse_diagonal[i]
        for q in range(start[i], end[i]):
            part_row[at] = local[row[q]]
            part_value[at] = value[q]
            at += 1
    part_start[count] = at
    places = np.empty(nodes.shape[0], dtype=np.int32)
    for k in range(nodes.shape[0]):
        places[k] = local[inverse_permutation[nodes[k]]]
    return part_start, part_row, part_value, part_inverse, places, np.empty((count, 3))


@nb.njit(cache=True, nogil=True)
def restricted_solve(part, force, motion):  # type: ignore[no-untyped-def]
    """Writes to `motion` (k,3) the rows of P_ff⁻¹ E `force` at the nodes where `force` (k,3) acts.

    Args:
        part: of `Factor.part`.
        force: (k,3).
        motion: (k,3), written.
    """
    start, row, value, inverse_diagonal, places, work = part
    count = inverse_diagonal.shape[0]
    work[:] = 0.0
    for k in range(places.shape[0]):
        i = places[k]
        work[i, 0] = force[k, 0]
        work[i, 1] = force[k, 1]
        work[i, 2] = force[k, 2]
    for i in range(count):
        w0, w1, w2 = work[i, 0], work[i, 1], work[i, 2]
        for q in range(start[i], start[i + 1]):
            r = row[q]
            v = value[q]
            work[r, 0] -= v * w0
            work[r, 1] -= v * w1
            work[r, 2] -= v * w2
    for i in range(count - 1, -1, -1):
        d = inverse_diagonal[i]
        w0, w1, w2 = work[i, 0] * d, work[i, 1] * d, work[i, 2] * d
        for q in range(start[i], start[i + 1]):
            r = row[q]
            v = value[q]
            w0 -= v * work[r, 0]
            w1 -= v * work[r, 1]
            w2 -= v * work[r, 2]
        work[i, 0] = w0
        work[i, 1] = w1
        work[i, 2] = w2
    for k in range(places.shape[0]):
        i = places[k]
        motion[k, 0] = work[i, 0]
        motion[k, 1] = work[i, 1]
        motion[k, 2] = work[i, 2]


@nb.njit(cache=True, nogil=True)
def _elimination_tree(n, start, row, parent, counts):  # type: ignore[no-untyped-def]
    flag = np.empty(n, dtype=np.int32)
    for k in range(n):
        parent[k] = -1
        flag[k] = k
        counts[k] = 0
        for q in range(start[k], start[k + 1]):
            i = row[q]
            while i < k and flag[i] != k:
                if parent[i] == -1:
                    parent[i] = k
                counts[i] += 1
                flag[i] = k
                i = parent[i]


@nb.njit(cache=True, nogil=True)
def _factorize(  # type: ignore[no-untyped-def]
    n, start, row, value, parent, l_start, masked, l_end, l_row, l_value, inverse_diagonal
):
    flag = np.empty(n, dtype=np.int32)
    stack = np.empty(n, dtype=np.int32)
    pattern = np.empty(n, dtype=np.int32)
    y = np.zeros(n)
    for k in range(n):
        l_end[k] = l_start[k]
        flag[k] = -1
    for k in range(n):
        if masked[k]:
            inverse_diagonal[k] = 0.0
            continue
        flag[k] = k
        top = n
        diagonal = 0.0
        for q in range(start[k], start[k + 1]):
            i = row[q]
            if i == k:
                diagonal = value[q]
                continue
            if masked[i]:
                continue
            y[i] = value[q]
            length = 0
            while flag[i] != k:
                pattern[length] = i
                length += 1
                flag[i] = k
                i = parent[i]
            while length > 0:
                length -= 1
                top -= 1
                stack[top] = pattern[length]
        for s in range(top, n):
            i = stack[s]
            yi = y[i]
            y[i] = 0.0
            if masked[i] or yi == 0.0:
                continue
            for q in range(l_start[i], l_end[i]):
                y[l_row[q]] -= l_value[q] * yi
            l_ki = yi * inverse_diagonal[i]
            diagonal -= l_ki * yi
            l_row[l_end[i]] = k
            l_value[l_end[i]] = l_ki
            l_end[i] += 1
        if diagonal <= 0.0:
            return k
        inverse_diagonal[k] = 1.0 / diagonal
    return -1
