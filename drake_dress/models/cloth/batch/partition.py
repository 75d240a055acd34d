"""A sparse inverse in a few factors: triangular solves as a handful of sparse products.

P = L D Lᵀ is solved by substitution, row after row: some 150 dependent rows for a garment of 1,800
nodes, which leaves a GPU idle and would cost a launch each. Rows are therefore gathered into a few
groups G_1 … G_K of the elimination tree, and the triangle of each group is inverted beforehand:

    y_g = T_g⁻¹ b_g − (T_g⁻¹ L_g,earlier) y_earlier,
    z_g = T_g⁻ᵀ D_g⁻¹ y_g − (T_g⁻ᵀ L_later,gᵀ) z_later,

so that a solve is 2K sparse products whose rows are independent. Inverses fill in: where the groups
are cut is a shortest path between few groups and few entries (Alvarado and Schreiber 1993, "Optimal
parallel solution of sparse triangular systems"). K = 5 has about twice the entries of L.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray

# Rows of L, in its own order, not numbers of nodes.
Rows = npt.NDArray[np.intp]

# Columns of the identity that are solved for at once; bounds the memory of an inverse.
_COLUMNS = 256
# A group spans at most so many levels of the tree: beyond that its inverse is never the cheapest.
_MOST_LEVELS = 16


@dataclass(frozen=True)
class Stage:
    """One sparse product: out[row] = Σ weight · source[column], in numbers of nodes.

    Attributes:
        row: (r,) nodes that this stage writes.
        start: (r+1,) where the entries of a row begin.
        split: (r,) where entries begin that read what earlier stages wrote; those before it read
            the stage's own input.
        column, weight: entries.
    """

    row: IntArray
    start: IntArray
    split: IntArray
    column: IntArray
    weight: FloatArray


@dataclass(frozen=True)
class Partition:
    """Stages that give P_ff⁻¹ b: the forward ones b → y, the backward ones y → z.

    Rows of masked nodes are written by no stage.
    """

    forward: tuple[Stage, ...]
    backward: tuple[Stage, ...]

    @property
    def entries(self) -> int:
        """Number of multiplications of one solve."""
        return sum(len(s.column) for s in self.forward + self.backward)


def make_partition(matrix: sp.csc_matrix, masked: BoolArray, stage_cost: float) -> Partition:
    """Returns the partitioned inverse of `matrix` without its masked nodes.

    Args:
        matrix: (n,n) symmetric positive definite.
        masked: (n,) nodes that are left out.
        stage_cost: what one more group costs, in entries.

    Raises:
        ValueError: the matrix is not positive definite.
    """
    free = np.flatnonzero(~masked)
    if not len(free):
        return Partition((), ())
    lower, pivot, order = _factorize(sp.csc_matrix(matrix)[free][:, free])
    node = free[order].astype(np.int32)
    level = _levels(lower)
    groups = [
        np.flatnonzero((level >= low) & (level < high))
        for low, high in _cuts(lower, level, stage_cost)
    ]
    by_row = sp.csr_matrix(lower)
    forward, backward = [], []
    earlier = np.zeros(0, dtype=np.intp)
    for group in groups:
        later = np.setdiff1d(np.arange(len(level)), np.concatenate([earlier, group]))
        inverse = _inverse(by_row[group][:, group])
        forward.append(_stage(node, group, inverse, earlier, -inverse @ by_row[group][:, earlier]))
        scaled = inverse.T @ sp.diags(1.0 / pivot[group])
        backward.append(_stage(node, group, scaled, later, -inverse.T @ lower[later][:, group].T))
        earlier = np.concatenate([earlier, group])
    return Partition(tuple(forward), tuple(reversed(backward)))


def _factorize(matrix: sp.csc_matrix) -> tuple[sp.csc_matrix, FloatArray, Rows]:
    """Returns unit lower L, the pivots D and which row each row of L is in `matrix`."""
    try:
        lu = spla.splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise ValueError(f"matrix is not positive definite: {error}") from error
    pivot = lu.U.diagonal()
    if np.any(pivot <= 0.0) or not np.array_equal(lu.perm_r, lu.perm_c):
        raise ValueError("matrix is not positive definite")
    lower = sp.csc_matrix(lu.L)
    lower.sort_indices()
    return lower, pivot, np.argsort(lu.perm_c)


def _levels(lower: sp.csc_matrix) -> IntArray:
    """Returns (n,) a level of each row, never below that of a row it depends on.

    A row that only continues its child's dense block (a supernode) stays on the child's level: the
    inverse of a dense triangle has no more entries than the triangle.
    """
    n = lower.shape[0]
    start, row = lower.indptr, lower.indices
    count = np.diff(start)
    level = np.zeros(n, dtype=np.int32)
    for j in range(n):
        above = row[start[j] + 1 : start[j + 1]]
        if not len(above):
            continue
        parent = above[0]
        np.maximum.at(level, above, level[j])
        if count[parent] != count[j] - 1:
            level[parent] = max(level[parent], level[j] + 1)
    return level


def _cuts(lower: sp.csc_matrix, level: IntArray, stage_cost: float) -> list[tuple[int, int]]:
    """Returns the levels (from, to) of each group, by dynamic programming over the cuts.

    Costs are counts of entries from the tree alone: in a group, the inverse joins each row to its
    descendants, so a column reaches all rows above it up to the cut.
    """
    n, height = len(level), int(level.max()) + 1
    start, row = lower.indptr, lower.indices
    count = np.diff(start)
    parent = np.full(n, -1)
    has_parent = count > 1
    parent[has_parent] = row[start[:-1][has_parent] + 1]

    def entries(low: int, high: int) -> float:
        inside = (level >= low) & (level < high)
        reach = np.zeros(n, dtype=np.int64)
        top = np.arange(n)
        for j in np.flatnonzero(inside)[::-1]:
            p = parent[j]
            reach[j] = 1
            if p >= 0 and inside[p]:
                reach[j] += reach[p]
                top[j] = top[p]
        total = 2 * int(reach[inside].sum()) + int((count[top[inside]] - 1).sum())
        for j in np.flatnonzero(level < low):
            above = row[start[j] + 1 : start[j + 1]]
            met = above[inside[above]]
            if len(met):
                total += int(reach[met[0]])
        return float(total)

    best = [0.0] + [np.inf] * height
    origin = [0] * (height + 1)
    for high in range(1, height + 1):
        for low in range(max(0, high - _MOST_LEVELS), high):
            cost = best[low] + entries(low, high) + stage_cost
            if cost < best[high]:
                best[high], origin[high] = cost, low
    cuts = []
    high = height
    while high > 0:
        cuts.append((origin[high], high))
        high = origin[high]
    return cuts[::-1]


def _inverse(triangle: sp.csr_matrix) -> sp.csr_matrix:
    """Returns the inverse of a sparse unit lower triangle."""
    n = triangle.shape[0]
    lu = spla.splu(sp.csc_matrix(triangle), permc_spec="NATURAL", diag_pivot_thresh=0.0)
    blocks = []
    for begin in range(0, n, _COLUMNS):
        width = min(_COLUMNS, n - begin)
        identity = np.zeros((n, width))
        identity[begin + np.arange(width), np.arange(width)] = 1.0
        blocks.append(sp.csc_matrix(lu.solve(identity)))
    return sp.csr_matrix(sp.hstack(blocks))


def _stage(
    node: IntArray, group: Rows, own: sp.csr_matrix, other: Rows, rest: sp.csr_matrix
) -> Stage:
    """Returns the product own · (columns of the group) + rest · (columns of other groups)."""
    both = []
    for part, columns in ((own, group), (rest, other)):
        matrix = sp.csr_matrix(part)
        matrix.eliminate_zeros()
        matrix.sort_indices()
        both.append((matrix, node[columns]))
    (own, own_node), (rest, rest_node) = both
    own_count, rest_count = np.diff(own.indptr), np.diff(rest.indptr)
    start = np.concatenate([[0], np.cumsum(own_count + rest_count)])
    split = start[:-1] + own_count
    column = np.empty(start[-1], dtype=np.int32)
    weight = np.empty(start[-1])
    for matrix, names, first in ((own, own_node, start[:-1]), (rest, rest_node, split)):
        size = np.diff(matrix.indptr)
        at = np.repeat(first - matrix.indptr[:-1], size) + np.arange(matrix.nnz)
        column[at] = names[matrix.indices]
        weight[at] = matrix.data
    return Stage(node[group], start.astype(np.int32), split.astype(np.int32), column, weight)
