"""What is done with a factor in blocks of columns: eliminating, substituting, factorising.

A block is one, two or four columns of L that follow each other in the elimination tree. Below its
own triangle it has one list of rows for all its columns, and their values row by row:

    first[b], width[b]             its columns
    row[row_start[b]:row_end[b]]   rows below the block, ascending
    value[value_start[b] ...]      the triangle by columns, then `width` values for each row

Where one column of a block lacks a row it has a zero. Right-hand sides are four wide, so that a row
is a vector of the processor: three coordinates and nothing, or, in the factorisation, four rows of
P.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.vectorised import vectorised

_INDICES, _VALUES, _LANES = nb.int32[::1], nb.float64[::1], nb.float64[:, ::1]
# first, width, row_start, row_end, row, value_start, value, inverse_diagonal
BLOCKS = nb.types.Tuple((_INDICES,) * 6 + (_VALUES,) * 2)
_NOTHING = (0.0, 0.0, 0.0, 0.0)


@nb.njit(nogil=True, cache=True)
def _load(work, i):  # type: ignore[no-untyped-def]
    return work[i, 0], work[i, 1], work[i, 2], work[i, 3]


@nb.njit(nogil=True, cache=True)
def _store(work, i, a):  # type: ignore[no-untyped-def]
    work[i, 0], work[i, 1], work[i, 2], work[i, 3] = a


@nb.njit(inline="always", fastmath={"contract"})
def _times(s, a):  # type: ignore[no-untyped-def]
    return s * a[0], s * a[1], s * a[2], s * a[3]


@nb.njit(inline="always", fastmath={"contract"})
def _less(a, s, b):  # type: ignore[no-untyped-def]
    """Returns a − s b."""
    return a[0] - s * b[0], a[1] - s * b[1], a[2] - s * b[2], a[3] - s * b[3]


@nb.njit(inline="always", fastmath={"contract"})
def _eliminate_block(blocks, b, end, work):  # type: ignore[no-untyped-def]
    """Eliminates the columns of block `b` from `work` (n,4), in its rows before `end`."""
    first, width, row_start, _, row, value_start, value, _ = blocks
    i = first[b]
    p = value_start[b]
    w = _load(work, i)
    if width[b] == 1:
        for q in range(row_start[b], end):
            r = row[q]
            _store(work, r, _less(_load(work, r), value[p], w))
            p += 1
        return
    x = _less(_load(work, i + 1), value[p], w)
    _store(work, i + 1, x)
    if width[b] == 2:
        p += 1
        for q in range(row_start[b], end):
            r = row[q]
            a = _less(_load(work, r), value[p], w)
            _store(work, r, _less(a, value[p + 1], x))
            p += 2
        return
    y = _less(_less(_load(work, i + 2), value[p + 1], w), value[p + 3], x)
    z = _less(_less(_load(work, i + 3), value[p + 2], w), value[p + 4], x)
    z = _less(z, value[p + 5], y)
    _store(work, i + 2, y)
    _store(work, i + 3, z)
    p += 6
    for q in range(row_start[b], end):
        r = row[q]
        a = _less(_less(_load(work, r), value[p], w), value[p + 1], x)
        _store(work, r, _less(_less(a, value[p + 2], y), value[p + 3], z))
        p += 4


@vectorised(nb.void(BLOCKS, _LANES))
def eliminate(blocks, work):  # type: ignore[no-untyped-def]
    """Overwrites `work` (n,4) by L⁻¹ `work`."""
    row_end = blocks[3]
    for b in range(row_end.shape[0]):
        _eliminate_block(blocks, b, row_end[b], work)


@vectorised(nb.void(BLOCKS, _LANES))
def substitute(blocks, work):  # type: ignore[no-untyped-def]
    """Overwrites `work` (n,4) by L⁻ᵀ D⁻¹ `work`."""
    first, width, row_start, row_end, row, value_start, value, inverse = blocks
    for b in range(first.shape[0] - 1, -1, -1):
        i = first[b]
        begin = value_start[b]
        w = _times(inverse[i], _load(work, i))
        if width[b] == 1:
            p = begin
            for q in range(row_start[b], row_end[b]):
                w = _less(w, value[p], _load(work, row[q]))
                p += 1
            _store(work, i, w)
            continue
        x = _times(inverse[i + 1], _load(work, i + 1))
        if width[b] == 2:
            p = begin + 1
            for q in range(row_start[b], row_end[b]):
                a = _load(work, row[q])
                w = _less(w, value[p], a)
                x = _less(x, value[p + 1], a)
                p += 2
        else:
            y = _times(inverse[i + 2], _load(work, i + 2))
            z = _times(inverse[i + 3], _load(work, i + 3))
            p = begin + 6
            for q in range(row_start[b], row_end[b]):
                a = _load(work, row[q])
                w = _less(w, value[p], a)
                x = _less(x, value[p + 1], a)
                y = _less(y, value[p + 2], a)
                z = _less(z, value[p + 3], a)
                p += 4
            y = _less(y, value[begin + 5], z)
            x = _less(_less(x, value[begin + 3], y), value[begin + 4], z)
            w = _less(_less(w, value[begin + 1], y), value[begin + 2], z)
            _store(work, i + 2, y)
            _store(work, i + 3, z)
        _store(work, i, _less(w, value[begin], x))
        _store(work, i + 1, x)


@vectorised(nb.int32(BLOCKS, _INDICES, _INDICES, _INDICES, _INDICES, _VALUES, nb.boolean[::1]))
def factorize(  # type: ignore[no-untyped-def]
    blocks, reach_start, reach, p_start, p_row, p_value, masked
):
    """Writes a factor: rows with their ends, values, inverse diagonal.

    Looks up (Davis, "Direct Methods for Sparse Linear Systems", ch. 4), up to four rows of L at
    once: they are what elimination leaves of four rows of P.

    Args:
        blocks: with room for the rows that each block has with no node left out.
        reach_start: of each block in `reach`.
        reach: the earlier blocks that have rows in a block, ascending.
        p_start: of the columns of P's upper triangle.
        p_row: its rows.
        p_value: its values.
        masked: (n,) which nodes are left out: their rows are zero, their inverse diagonal too.

    Returns:
        The node whose pivot is not positive, or -1.
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
            _store(own, c, _NOTHING)
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
                empty = empty and _load(y, j) == _NOTHING
            if empty:
                continue
            _eliminate_block(blocks, a, row_end[a], y)
            for j in range(width[a]):
                w = _load(y, i + j)
                _store(y, i + j, _NOTHING)
                ell = _times(inverse[i + j], w)
                _store(scaled, j, ell)
                for c in range(4):
                    _store(own, c, _less(_load(own, c), w[c], ell))
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
