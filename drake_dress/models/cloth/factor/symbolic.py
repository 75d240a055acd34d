"""Elimination order and blocks of columns: computed once per sparsity pattern.

The order is minimum degree, then a postorder of the elimination tree, in which a column's parent is
often the next column. Such columns have nearly the same rows. Up to four of them form a block
(`kernels`), with zeros where a column lacks a row. Of all ways to cut the columns into blocks, the
one with the least time by `_COST` is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.arrays import IntArray

# Time per row of a block of one, two and four columns, per block and per column, in rows of one
# column.
_COST = np.array([0.0, 1.0, 1.15, 0.0, 1.4])
_PER_BLOCK, _PER_COLUMN = 5.0, 1.5


@dataclass(frozen=True)
class Pattern:
    """Order and blocks of a symmetric sparse matrix with n nodes.

    Attributes:
        permutation: (n,) the node that is eliminated k-th; inverse_permutation: its inverse.
        first: (B,) first column of each block; width: (B,) 1, 2 or 4 columns.
        row_start: (B+1,) start of each block's rows in `row`, ascending; value_start: (B+1,) start
            of its values.
        reach_start: (B+1,) start of each block in `reach`: the earlier blocks with rows in it,
            ascending.
        block_of: (n,) the block of a column.
    """

    permutation: IntArray
    inverse_permutation: IntArray
    first: IntArray
    width: IntArray
    row_start: IntArray
    row: IntArray
    value_start: IntArray
    reach_start: IntArray
    reach: IntArray
    block_of: IntArray


def find_pattern(matrix: sp.csc_matrix) -> tuple[Pattern, sp.csc_matrix]:
    """Returns the pattern of an (n,n) symmetric positive definite matrix.

    Also returns its upper triangle in elimination order, indices sorted.
    """
    lu = spla.splu(
        sp.csc_matrix(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    # perm_c maps old to new; its argsort is the order of elimination.
    permutation = np.argsort(lu.perm_c).astype(np.int32)
    parent, _ = _tree(_permuted_upper(matrix, permutation))
    permutation = permutation[_postorder(parent)]
    upper = _permuted_upper(matrix, permutation)
    parent, counts = _tree(upper)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    rows = np.empty(start[-1], dtype=np.int32)
    _column_rows(upper.indptr, upper.indices, parent, start, rows)
    first, width = _cut(parent, counts)
    block_of = np.repeat(np.arange(len(first), dtype=np.int32), width)
    # the rows of all columns of a block are among those of its last column
    last = first + width - 1
    row_start = np.concatenate([[0], np.cumsum(counts[last])]).astype(np.int32)
    row = np.concatenate([rows[start[j] : start[j + 1]] for j in last]).astype(np.int32)
    sizes = width * (width - 1) // 2 + width * counts[last]
    value_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    reach_start = np.zeros(len(first) + 1, dtype=np.int32)
    _count_reach(row_start, row, block_of, reach_start)
    reach_start = np.cumsum(reach_start, dtype=np.int32)
    reach = np.empty(reach_start[-1], dtype=np.int32)
    _find_reach(row_start, row, block_of, reach_start, reach)
    pattern = Pattern(
        permutation,
        np.argsort(permutation).astype(np.int32),
        first,
        width,
        row_start,
        row,
        value_start,
        reach_start,
        reach,
        block_of,
    )
    return pattern, upper


def _permuted_upper(matrix: sp.csc_matrix, permutation: IntArray) -> sp.csc_matrix:
    permuted = sp.csc_matrix(matrix)[permutation][:, permutation]
    upper = sp.csc_matrix(sp.triu(permuted))
    upper.sort_indices()
    return upper


def _tree(upper: sp.csc_matrix) -> tuple[IntArray, IntArray]:
    """Returns the elimination tree (n,), -1 for roots, and the number of rows per column (n,)."""
    n = upper.shape[0]
    parent, counts = np.empty(n, dtype=np.int32), np.empty(n, dtype=np.int32)
    _elimination_tree(n, upper.indptr, upper.indices, parent, counts)
    return parent, counts


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
def _postorder(parent):  # type: ignore[no-untyped-def]
    """Returns the columns (n,) in an order where each follows the trees of its children."""
    n = parent.shape[0]
    child = np.full(n, -1, dtype=np.int32)
    sibling = np.full(n, -1, dtype=np.int32)
    order = np.empty(n, dtype=np.int32)
    stack = np.empty(n, dtype=np.int32)
    for j in range(n - 1, -1, -1):
        if parent[j] >= 0:
            sibling[j] = child[parent[j]]
            child[parent[j]] = j
    count = 0
    for root in range(n):
        if parent[root] >= 0:
            continue
        stack[0] = root
        depth = 0
        while depth >= 0:
            j = stack[depth]
            i = child[j]
            if i >= 0:
                child[j] = sibling[i]
                depth += 1
                stack[depth] = i
            else:
                order[count] = j
                count += 1
                depth -= 1
    return order


@nb.njit(cache=True, nogil=True)
def _column_rows(p_start, p_row, parent, start, rows):  # type: ignore[no-untyped-def]
    """Writes the rows of each column of L, ascending."""
    n = parent.shape[0]
    flag = np.full(n, -1, dtype=np.int32)
    at = start[:n].copy()
    for k in range(n):
        flag[k] = k
        for q in range(p_start[k], p_start[k + 1]):
            i = p_row[q]
            while flag[i] != k:
                rows[at[i]] = k
                at[i] += 1
                flag[i] = k
                i = parent[i]


@nb.njit(cache=True, nogil=True)
def _cut(parent, counts):  # type: ignore[no-untyped-def]
    """Returns first column and width of the blocks with the least total cost."""
    n = parent.shape[0]
    least = np.zeros(n + 1)
    choice = np.ones(n, dtype=np.int32)
    for j in range(n - 1, -1, -1):
        least[j] = np.inf
        for k in (1, 2, 4):
            if j + k > n:
                break
            chain = True
            for i in range(j, j + k - 1):
                chain = chain and parent[i] == i + 1
            if not chain:
                break
            cost = _PER_BLOCK + _PER_COLUMN * k + _COST[k] * counts[j + k - 1] + least[j + k]
            if cost < least[j]:
                least[j] = cost
                choice[j] = k
    first = np.empty(n, dtype=np.int32)
    width = np.empty(n, dtype=np.int32)
    count = 0
    j = 0
    while j < n:
        first[count] = j
        width[count] = choice[j]
        j += choice[j]
        count += 1
    return first[:count].copy(), width[:count].copy()


@nb.njit(cache=True, nogil=True)
def _count_reach(row_start, row, block_of, count):  # type: ignore[no-untyped-def]
    """Adds to `count` (B+1,) at b + 1 how many blocks have rows in block b."""
    for b in range(row_start.shape[0] - 1):
        last = -1
        for q in range(row_start[b], row_start[b + 1]):
            if block_of[row[q]] != last:
                last = block_of[row[q]]
                count[last + 1] += 1


@nb.njit(cache=True, nogil=True)
def _find_reach(row_start, row, block_of, reach_start, reach):  # type: ignore[no-untyped-def]
    at = reach_start.copy()
    for b in range(row_start.shape[0] - 1):
        last = -1
        for q in range(row_start[b], row_start[b + 1]):
            if block_of[row[q]] != last:
                last = block_of[row[q]]
                reach[at[last]] = b
                at[last] += 1
