"""Remeshes to a spacing: halves edges that are too long, then merges nodes that are too close."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.coarsen import LONGEST, coarsen
from drake_dress.models.garment.refine import refine


def to_spacing(
    position: FloatArray,
    faces: IntArray,
    loops: Sequence[IntArray],
    spacing: float,
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[FloatArray, IntArray, list[IntArray], IntArray]:
    """Returns positions, faces, loops, and the new index of each old node, at about `spacing`.

    Args:
        position: (n,3), m.
        faces: (F,3) of an oriented manifold.
        loops: closed chains of edges to keep, as node indices.
        spacing: wanted mean edge length, m.
        progress: called from time to time with the fraction that is done.

    Raises:
        UserError: the mesh would become too large (see `refine`).
    """
    n = len(position)
    position, faces, kept = refine(position, faces, loops, LONGEST * spacing)
    position, faces, became = coarsen(position, faces, kept, spacing, progress)
    return position, faces, [_without_repeats(became[loop]) for loop in kept], became[:n]


def _without_repeats(loop: IntArray) -> IntArray:
    return np.asarray(loop[loop != np.roll(loop, 1)], dtype=np.int32)
