"""Surfaces from functions of space: the zero level by marching tetrahedra, and parts of it.

The garments of this study are made in another way than the package's own coats, which lie on grids
of panels: nodes are everywhere, triangles have all shapes, and armpits are rounded.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray

Field = Callable[[FloatArray], FloatArray]
# Values nearer to zero than this share of the largest value on an edge move away, so that no
# triangle is a sliver.
_SNAP = 0.08
# The six tetrahedra of a cube: paths along its edges from corner (0,0,0) to (1,1,1).
_PATHS = np.array(
    [
        np.cumsum([[0, 0, 0], *(np.eye(3, dtype=int)[axis] for axis in order)], axis=0)
        for order in permutations(range(3))
    ]
)


def zero_level(
    field: Field, low: FloatArray, high: FloatArray, step: float
) -> tuple[FloatArray, IntArray]:
    """Returns nodes (n,3) and triangles (F,3) of the surface where a function is zero.

    Triangles are counter-clockwise seen from where it is positive.

    Args:
        field: function of points (k,3), m.
        low: corner of the box in which the surface is, m.
        high: opposite corner, m.
        step: of the grid, m.
    """
    size = np.ceil((high - low) / step).astype(int) + 1
    at = np.stack(np.meshgrid(*(np.arange(k) for k in size), indexing="ij"), axis=-1)
    points = low + step * at.reshape(-1, 3)
    value = field(points)
    value = np.where(np.abs(value) < _SNAP * step, np.where(value < 0, -1, 1) * _SNAP * step, value)
    stride = np.array([size[1] * size[2], size[2], 1])
    cube = at[:-1, :-1, :-1].reshape(-1, 3) @ stride
    tetrahedra = (cube[:, None, None] + (_PATHS @ stride)[None]).reshape(-1, 4)
    inside = value[tetrahedra] < 0.0
    count = inside.sum(axis=1)
    corners = []
    for k in (1, 2, 3):
        which = np.flatnonzero(count == k)
        # nodes inside come first
        order = np.argsort(~inside[which], axis=1, kind="stable")
        a, b, c, d = np.take_along_axis(tetrahedra[which], order, axis=1).T
        cuts = {
            1: [((a, b), (a, c), (a, d))],
            2: [((a, c), (a, d), (b, d)), ((a, c), (b, d), (b, c))],
            3: [((a, d), (b, d), (c, d))],
        }[k]
        corners += [np.stack([np.sort(np.stack(e), axis=0).T for e in cut], axis=1) for cut in cuts]
    edges = np.concatenate(corners)
    ends, which = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    first, second = value[ends].T
    share = (first / (first - second))[:, None]
    x = (1.0 - share) * points[ends[:, 0]] + share * points[ends[:, 1]]
    faces = which.reshape(-1, 3)
    normal = np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])
    middle = x[faces].mean(axis=1)
    off = 0.2 * step * normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    inward = field(middle + off) < field(middle - off)
    faces[inward] = faces[inward][:, ::-1]
    return x, faces.astype(np.int32)


def kept(x: FloatArray, faces: IntArray, value: FloatArray) -> tuple[FloatArray, IntArray]:
    """Returns the part of a surface where a function is positive, cut where it is zero.

    Args:
        x: (n,3), m.
        faces: (F,3).
        value: (n,) of the function, m.
    """
    near = _SNAP * float(np.median(np.linalg.norm(x[faces[:, 0]] - x[faces[:, 1]], axis=1)))
    value = np.where(np.abs(value) < near, np.where(value < 0, -near, near), value)
    is_in = value[faces] > 0.0
    count = is_in.sum(axis=1)
    result = [faces[count == 3][:, :, None].repeat(2, axis=2)]
    for k in (1, 2):
        some = faces[count == k]
        # the corner that is alone comes first, in the face's orientation
        lone = np.argmax(is_in[count == k] == (k == 1), axis=1)
        a, b, c = (some[np.arange(len(some)), (lone + j) % 3] for j in range(3))
        ab, ac = np.stack([a, b], axis=1), np.stack([a, c], axis=1)
        bb, cc, aa = (np.stack([q, q], axis=1) for q in (b, c, a))
        if k == 1:
            result.append(np.stack([aa, ab, ac], axis=1))
        else:
            result += [np.stack([ab, bb, cc], axis=1), np.stack([ab, cc, ac], axis=1)]
    corner = np.sort(np.concatenate(result), axis=2)
    ends, which = np.unique(corner.reshape(-1, 2), axis=0, return_inverse=True)
    first, second = value[ends].T
    with np.errstate(all="ignore"):
        share = np.where(ends[:, 0] == ends[:, 1], 0.0, first / (first - second))[:, None]
    place: FloatArray = (1.0 - share) * x[ends[:, 0]] + share * x[ends[:, 1]]
    return place, which.reshape(-1, 3).astype(np.int32)
