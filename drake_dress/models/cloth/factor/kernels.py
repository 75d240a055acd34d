"""Kernels of a factor in blocks of columns: elimination, substitution, factorisation.

A block is one, two or four columns of L that follow each other in the elimination tree. Below its
triangle, all its columns share one list of rows, with their values row by row:

    first[b], width[b]             its columns
    row[row_start[b]:row_end[b]]   rows below the block, ascending
    value[value_start[b] ...]      the triangle by columns, then `width` values for each row

A column of a block has zeros in the rows that it lacks. Right-hand sides are four or eight wide, so
that a row fills a vector register: three coordinates and padding, twice that, or, in the
factorisation, four rows of P.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.cloth.factor.vector_rows import FOUR, less, load, more, store, times
from drake_dress.models.vectorised import vectorised

_INDICES, _VALUES, _LANES = nb.int32[::1], nb.float64[::1], nb.float64[:, ::1]
# first, width, row_start, row_end, row, value_start, value, inverse_diagonal
BLOCKS = nb.types.Tuple((_INDICES,) * 6 + (_VALUES,) * 2)
_WIDTHS = [nb.void(BLOCKS, _LANES, nb.types.UniTuple(nb.float64, w)) for w in (4, 8)]


@nb.njit(inline="always", fastmath={"contract"})
def _eliminate_block(blocks, b, end, work, like):  # type: ignore[no-untyped-def]
    """Eliminates the columns of block `b` from `work` (n,w), in its rows before `end`."""
    first, width, row_start, _, row, value_start, value, _ = blocks
    i = first[b]
    p = value_start[b]
    w = load(work, i, like)
    if width[b] == 1:
        for q in range(row_start[b], end):
            r = row[q]
            store(work, r, less(load(work, r, like), value[p], w))
            p += 1
        return
    x = less(load(work, i + 1, like), value[p], w)
    store(work, i + 1, x)
    if width[b] == 2:
        p += 1
        for q in range(row_start[b], end):
            r = row[q]
            a = less(load(work, r, like), value[p], w)
            store(work, r, less(a, value[p + 1], x))
            p += 2
        return
    y = less(less(load(work, i + 2, like), value[p + 1], w), value[p + 3], x)
    z = less(less(load(work, i + 3, like), value[p + 2], w), value[p + 4], x)
    z = less(z, value[p + 5], y)
    store(work, i + 2, y)
    store(work, i + 3, z)
    p += 6
    for q in range(row_start[b], end):
        r = row[q]
        a = less(less(load(work, r, like), value[p], w), value[p + 1], x)
        store(work, r, less(less(a, value[p + 2], y), value[p + 3], z))
        p += 4


@vectorised(_WIDTHS)
def eliminate(blocks, work, like):  # type: ignore[no-untyped-def]
    """Overwrites `work` (n,w) with L⁻¹ `work`, `like` a tuple of w."""
    row_end = blocks[3]
    for b in range(row_end.shape[0]):
        _eliminate_block(blocks, b, row_end[b], work, like)


@vectorised(_WIDTHS)
def substitute(blocks, work, like):  # type: ignore[no-untyped-def]
    """Overwrites `work` (n,w) with L⁻ᵀ D⁻¹ `work`, `like` a tuple of w."""
    first, width, row_start, row_end, row, value_start, value, inverse = blocks
    for b in range(first.shape[0] - 1, -1, -1):
        i = first[b]
        begin = value_start[b]
        w = times(inverse[i], load(work, i, like))
        if width[b] == 1:
            p = begin
            for q in range(row_start[b], row_end[b]):
                w = less(w, value[p], load(work, row[q], like))
                p += 1
            store(work, i, w)
            continue
        x = times(inverse[i + 1], load(work, i + 1, like))
        if width[b] == 2:
            p = begin + 1
            for q in range(row_start[b], row_end[b]):
                a = load(work, row[q], like)
                w = less(w, value[p], a)
                x = less(x, value[p + 1], a)
                p += 2
        else:
            y = times(inverse[i + 2], load(work, i + 2, like))
            z = times(inverse[i + 3], load(work, i + 3, like))
            p = begin + 6
            for q in range(row_start[b], row_end[b]):
                a = load(work, row[q], like)
                w = less(w, value[p], a)
                x = less(x, value[p + 1], a)
                y = less(y, value[p + 2], a)
                z = less(z, value[p + 3], a)
                p += 4
            y = less(y, value[begin + 5], z)
            x = less(less(x, value[begin + 3], y), value[begin + 4], z)
            w = less(less(w, value[begin + 1], y), value[begin + 2], z)
            store(work, i + 2, y)
            store(work, i + 3, z)
        store(work, i, less(w, value[begin], x))
        store(work, i + 1, x)


@vectorised(nb.void(_INDICES, _LANES, _LANES))
def take_rows(places, rows, out):  # type: ignore[no-untyped-def]
    """Writes rows of four at `places` (n,) to `out` (n,4)."""
    for i in range(places.shape[0]):
        store(out, i, load(rows, places[i], FOUR))


@vectorised(nb.void(_INDICES, _LANES, _LANES))
def put_rows(places, rows, out):  # type: ignore[no-untyped-def]
    """Writes rows of four, (n,4), to the rows of `out` at `places` (n,)."""
    for i in range(places.shape[0]):
        store(out, places[i], load(rows, i, FOUR))


@vectorised(nb.void(_INDICES, _INDICES, _VALUES, _LANES, _LANES))
def row_product(indptr, indices, data, z, out):  # type: ignore[no-untyped-def]
    """Writes (matrix ⊗ I₄) z for a CSR matrix and rows of four, (n,4), to `out`."""
    for i in range(z.shape[0]):
        q, end = indptr[i], indptr[i + 1]
        # two sums, since a single one would wait for its last result
        a, b = FOUR, FOUR
        while q + 1 < end:
            a = more(a, data[q], load(z, indices[q], FOUR))
            b = more(b, data[q + 1], load(z, indices[q + 1], FOUR))
            q += 2
        if q < end:
            a = more(a, data[q], load(z, indices[q], FOUR))
        store(out, i, more(a, 1.0, b))


@vectorised(nb.int32(BLOCKS, _INDICES, _INDICES, _INDICES, _INDICES, _VALUES, nb.boolean[::1]))
def factorize(  # type: ignore[no-untyped-def]
    blocks, reach_start, reach, p_start, p_row, p_value, masked
):
    """Writes a factor: rows with their ends, values, inverse diagonal.

    The algorithm is up-looking (Davis, "Direct Methods for Sparse Linear Systems", ch. 4). It
    computes up to four rows of L at once, by elimination from four rows of P.

    Args:
        blocks: blocks with room for all rows that they have if no node is left out.
        reach_start: start of each block in `reach`.
        reach: the earlier blocks that have rows in a block, ascending.
        p_start: starts of the columns of P's upper triangle.
        p_row: its rows.
        p_value: its values.
        masked: (n,) which nodes are left out: their rows and inverse diagonal are zero.

    Returns:
        The column whose pivot is not positive, or -1.
    """
    first, width, row_start, row_end, row, value_start, value, inverse = blocks
    count = first.shape[0]
    y = np.zeros((inverse.shape[0], 4))
    row_end[:] = row_start[:count]
    own = np.zeros((4, 4))
    scaled = np.zeros((4, 4))
    for b in range(count):
        k = first[b]
        for c in range(4):
            store(own, c, FOUR)
        for c in range(width[b]):
            if masked[k + c]:
                continue
            for q in range(p_start[k + c], p_start[k + c + 1]):
                i = p_row[q]
                if masked[i]:
                    continue
                if i >= k:
                    own[c, i - k] = p_value[q]
                else:
                    y[i, c] = p_value[q]
        for t in range(reach_start[b], reach_start[b + 1]):
            a = reach[t]
            i = first[a]
            empty = True
            for j in range(i, i + width[a]):
                empty = empty and load(y, j, FOUR) == FOUR
            if empty:
                continue
            _eliminate_block(blocks, a, row_end[a], y, FOUR)
            for j in range(width[a]):
                w = load(y, i + j, FOUR)
                store(y, i + j, FOUR)
                ell = times(inverse[i + j], w)
                store(scaled, j, ell)
                for c in range(4):
                    store(own, c, less(load(own, c, FOUR), w[c], ell))
            p = value_start[a] + (width[a] * (width[a] - 1)) // 2
            p += width[a] * (row_end[a] - row_start[a])
            for c in range(width[b]):
                some = False
                for j in range(width[a]):
                    some = some or scaled[j, c] != 0.0
                if some:
                    row[row_end[a]] = k + c
                    row_end[a] += 1
                    for j in range(width[a]):
                        value[p] = scaled[j, c]
                        p += 1
        p = value_start[b]
        for c in range(width[b]):
            if masked[k + c]:
                inverse[k + c] = 0.0
                for _ in range(c + 1, width[b]):
                    value[p] = 0.0
                    p += 1
                continue
            pivot = own[c, c]
            if pivot <= 0.0:
                return nb.int32(k + c)
            inverse[k + c] = 1.0 / pivot
            for e in range(c + 1, width[b]):
                factor = own[e, c] / pivot
                value[p] = factor
                p += 1
                for g in range(c + 1, e + 1):
                    own[e, g] -= factor * own[g, c]
    return nb.int32(-1)
