"""How like the training data whole dressings are, in what the networks see of a person."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure
from drake_dress.learning.evaluation.held_out import held_out_batches
from drake_dress.learning.motion.windows import Batch, Sequences
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.tokens import TOKEN_COLUMNS, TOKEN_SIZE

_TAILS = 0.01  # share of known windows below, and above, what counts as their range


def likeness(
    known: Sequences, others: Sequence[Sequences], noise: float
) -> tuple[Table, list[Figure]]:
    """Returns the shares of values of other sequences that are outside the range of known ones.

    Args:
        known: sequences like those of the training.
        others: to be compared with them, of any lengths.
        noise: of each observed coordinate, m.
    """
    base = _values(held_out_batches(known, noise))
    low, high = np.quantile(base, [_TAILS, 1.0 - _TAILS], axis=0)
    seen = _values([b for data in others for b in held_out_batches(data, noise)])
    outside = 100.0 * np.mean((seen < low) | (seen > high), axis=0)
    rows: list[list[object]] = []
    for name, columns in TOKEN_COLUMNS.items():
        worst = columns.start + int(np.argmax(outside[columns]))
        middle = [float(np.median(values[:, worst])) for values in (seen, base)]
        rows.append([name, float(outside[columns].mean()), float(outside[worst]), *middle])
    header = [
        "% outside the middle 98 % of held-out sequences",
        "mean of columns",
        "worst column",
        "its median in dressings",
        "and in held-out sequences",
    ]
    figures = [Figure(f"dressings outside, {row[0]}", float(str(row[2])), "%") for row in rows]
    return Table("How like held-out sequences whole dressings are", header, rows), figures


def _values(batches: Sequence[Batch]) -> FloatArray:
    """Returns the newest tokens (N,c) of all arms."""
    rows = [b.arms.tokens[:, -1].astype(np.float64) for b in batches]
    return np.concatenate(rows) if rows else np.empty((0, TOKEN_SIZE))
