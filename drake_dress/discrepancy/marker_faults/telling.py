"""Writes notes that say which markers have a fault, and at which samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drake_dress.models.arrays import BoolArray

# Most ranges of samples and most markers that a note lists.
_LISTED, _NAMED = 4, 8


def told(names: Sequence[str], bad: BoolArray, what: str, kind: str = "marker") -> list[str]:
    """Returns a note for each marker with a fault; markers with the same samples share one.

    Args:
        names: names of the markers (m,).
        bad: (T,m) where each has the fault.
        what: the fault, and what is done about it.
        kind: what the names stand for.
    """
    groups: dict[bytes, list[int]] = {}
    for k in np.flatnonzero(bad.any(axis=0)):
        groups.setdefault(bad[:, k].tobytes(), []).append(int(k))
    lines = []
    for members in groups.values():
        listed = ", ".join(names[k] for k in members[:_NAMED])
        if len(members) > _NAMED:
            listed += f" and {len(members) - _NAMED} more"
        plural = "s" if len(members) > 1 else ""
        lines.append(f"{kind}{plural} {listed} at {_samples(bad[:, members[0]])}: {what}")
    return lines


def _samples(bad: BoolArray) -> str:
    """Returns the ranges of samples where `bad` (T,) holds, such as "samples 3–7, 12"."""
    edge = np.diff(np.concatenate([[0], bad.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1
    parts = [
        f"{b}" if b == e else f"{b}–{e}"
        for b, e in zip(begins[:_LISTED], ends[:_LISTED], strict=True)
    ]
    more = f" and {len(begins) - _LISTED} more" if len(begins) > _LISTED else ""
    count = int(bad.sum())
    word = "sample" if count == 1 else "samples"
    return f"{word} {', '.join(parts)}{more}" + (f" ({count})" if len(begins) > 1 else "")
