"""A sparse LDLᵀ factor of P that can leave nodes out.

P's pattern never changes, but the set of nodes with a prescribed motion changes at every step. So
order and blocks are computed once (`symbolic`). A numeric factor then has zeros in the rows of
masked nodes, which gives the factor of P_ff in the order of all nodes.

Contact needs only a part of P⁻¹: how contact nodes move under forces on the same nodes. This takes
the columns of L on the paths from these nodes to the root of the elimination tree (`part`): a fifth
to a third of the factor for an arm in a sleeve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.factor.kernels import (
    eliminate,
    factorize,
    put_rows,
    substitute,
    take_rows,
)
from drake_dress.models.cloth.factor.symbolic import Pattern, find_pattern
from drake_dress.models.cloth.factor.vector_rows import EIGHT, FOUR

# A part is made for at most the number of all nodes divided by this.
_MANY = 3


@dataclass(frozen=True)
class Factor:
    """Numeric LDLᵀ of P with some nodes left out; made by `SymbolicFactor.factorize`."""

    pattern: Pattern
    blocks: tuple[Any, ...]
    masked: BoolArray

    def part(self, nodes: IntArray) -> tuple[Any, ...]:
        """Returns the part of L that P_ff⁻¹ between `nodes` (k,) needs, for `restricted_solve`.

        It has the blocks that the nodes reach in the elimination tree, renumbered so that they fit
        in the fastest caches. For more than a third of all nodes it is the factor itself. The last
        array is scratch.
        """
        p = self.pattern
        if _MANY * len(nodes) > len(self.masked):
            places = p.inverse_permutation[nodes]
            return self.blocks, places, np.empty((len(self.masked), 4))
        found: tuple[Any, ...] = _part(self.blocks, p.block_of, p.inverse_permutation, nodes)
        return found

    def solve_pair(self, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns P_ff⁻¹ of two (n,3) right-hand sides, in little more time than for one."""
        out = np.empty_like(first), np.empty_like(second)
        solve_pair_into(self.blocks, self.pattern.permutation, first, second, *out)
        return out

    def solve(self, rhs: FloatArray) -> FloatArray:
        """Returns P_ff⁻¹ rhs_f for (n,3) `rhs`, with zeros in masked rows."""
        out = np.empty_like(rhs)
        solve_into(self.blocks, self.pattern.permutation, rhs, out, np.empty((len(rhs), 4)))
        return out


class SymbolicFactor:
    """Order and blocks of a symmetric sparse matrix, and its numeric factors.

    Args:
        matrix: (n,n) symmetric positive definite, CSR or CSC.
    """

    def __init__(self, matrix: sp.csc_array) -> None:
        self.pattern, upper = find_pattern(matrix)
        self._upper = (
            upper.indptr.astype(np.int32),
            upper.indices.astype(np.int32),
            upper.data.astype(np.float64),
        )
        self.node_count = matrix.shape[0]

    @property
    def fill(self) -> int:
        """Number of values of a factor, including the zeros of blocks."""
        return int(self.pattern.value_start[-1])

    def factorize(self, masked: BoolArray) -> Factor:
        """Returns the factor with the nodes where `masked` (n,) is True left out.

        Raises:
            ValueError: a pivot is not positive: the matrix is not positive definite.
        """
        p = self.pattern
        blocks = (
            p.first,
            p.width,
            p.row_start,
            np.empty_like(p.first),
            np.empty_like(p.row),
            p.value_start,
            np.empty(self.fill),
            np.empty(self.node_count),
        )
        failed = factorize(blocks, p.reach_start, p.reach, *self._upper, masked[p.permutation])
        if failed >= 0:
            raise ValueError(f"pivot of node {int(p.permutation[failed])} is not positive")
        return Factor(p, blocks, masked.copy())


@nb.njit(cache=True, nogil=True, forceinline=True)
def solve_into(blocks, permutation, rhs, out, work):  # type: ignore[no-untyped-def]
    """Writes P_ff⁻¹ rhs_f (n,3) into `out`, zeros in masked rows; `work` (n,4) is scratch."""
    n = rhs.shape[0]
    for i in range(n):
        p = permutation[i]
        work[i, 0] = rhs[p, 0]
        work[i, 1] = rhs[p, 1]
        work[i, 2] = rhs[p, 2]
        work[i, 3] = 0.0
    eliminate(blocks, work, FOUR)
    substitute(blocks, work, FOUR)
    for i in range(n):
        p = permutation[i]
        out[p, 0] = work[i, 0]
        out[p, 1] = work[i, 1]
        out[p, 2] = work[i, 2]


@nb.njit(cache=True, nogil=True, forceinline=True)
def solve_rows(blocks, permutation, rhs, out, work):  # type: ignore[no-untyped-def]
    """Does the same as `solve_into` with rows of four, (n,4)."""
    take_rows(permutation, rhs, work)
    eliminate(blocks, work, FOUR)
    substitute(blocks, work, FOUR)
    put_rows(permutation, work, out)


@nb.njit(cache=True, nogil=True, forceinline=True)
def solve_pair_into(blocks, permutation, first, second, x, y):  # type: ignore[no-untyped-def]
    """Writes P_ff⁻¹ of two right-hand sides (n,3) into `x` and `y`."""
    n = first.shape[0]
    work = np.zeros((n, 8))
    for i in range(n):
        p = permutation[i]
        for c in range(3):
            work[i, c] = first[p, c]
            work[i, c + 4] = second[p, c]
    eliminate(blocks, work, EIGHT)
    substitute(blocks, work, EIGHT)
    for i in range(n):
        p = permutation[i]
        for c in range(3):
            x[p, c] = work[i, c]
            y[p, c] = work[i, c + 4]


@nb.njit(cache=True, nogil=True, forceinline=True)
def restricted_solve(part, force, motion):  # type: ignore[no-untyped-def]
    """Writes to `motion` (k,3) the rows of P_ff⁻¹ E `force` at the nodes where `force` (k,3) acts.

    Args:
        part: result of `Factor.part`.
        force: (k,3).
        motion: (k,3), written.
    """
    blocks, places, work = part
    work[:] = 0.0
    for k in range(places.shape[0]):
        i = places[k]
        work[i, 0] = force[k, 0]
        work[i, 1] = force[k, 1]
        work[i, 2] = force[k, 2]
    eliminate(blocks, work, FOUR)
    substitute(blocks, work, FOUR)
    for k in range(places.shape[0]):
        i = places[k]
        motion[k, 0] = work[i, 0]
        motion[k, 1] = work[i, 1]
        motion[k, 2] = work[i, 2]


@nb.njit(cache=True, nogil=True)
def _part(blocks, block_of, inverse_permutation, nodes):  # type: ignore[no-untyped-def]
    first, width, row_start, row_end, row, value_start, value, inverse = blocks
    marked = np.zeros(first.shape[0], dtype=np.bool_)
    for k in range(nodes.shape[0]):
        marked[block_of[inverse_permutation[nodes[k]]]] = True
    count, columns, rows, values = 0, 0, 0, 0
    for b in range(first.shape[0]):
        if not marked[b]:
            continue
        for q in range(row_start[b], row_end[b]):
            marked[block_of[row[q]]] = True
        count += 1
        columns += width[b]
        rows += row_end[b] - row_start[b]
        values += (width[b] * (width[b] - 1)) // 2 + width[b] * (row_end[b] - row_start[b])
    local = np.empty(inverse.shape[0], dtype=np.int32)
    part_first = np.empty(count, dtype=np.int32)
    part_width = np.empty(count, dtype=np.int32)
    part_row_start = np.zeros(count + 1, dtype=np.int32)
    part_value_start = np.zeros(count + 1, dtype=np.int32)
    part_row = np.empty(rows, dtype=np.int32)
    part_value = np.empty(values)
    part_inverse = np.empty(columns)
    count, columns = 0, 0
    for b in range(first.shape[0]):
        if not marked[b]:
            continue
        part_first[count] = columns
        part_width[count] = width[b]
        for i in range(first[b], first[b] + width[b]):
            local[i] = columns
            part_inverse[columns] = inverse[i]
            columns += 1
        count += 1
    rows, values, count = 0, 0, 0
    for b in range(first.shape[0]):
        if not marked[b]:
            continue
        for q in range(row_start[b], row_end[b]):
            part_row[rows] = local[row[q]]
            rows += 1
        size = (width[b] * (width[b] - 1)) // 2 + width[b] * (row_end[b] - row_start[b])
        for q in range(value_start[b], value_start[b] + size):
            part_value[values] = value[q]
            values += 1
        count += 1
        part_row_start[count] = rows
        part_value_start[count] = values
    places = np.empty(nodes.shape[0], dtype=np.int32)
    for k in range(nodes.shape[0]):
        places[k] = local[inverse_permutation[nodes[k]]]
    found = (
        part_first,
        part_width,
        part_row_start,
        part_row_start[1:],
        part_row,
        part_value_start,
        part_value,
        part_inverse,
    )
    return found, places, np.empty((columns, 4))
