"""Finds markers whose labels were swapped."""

from __future__ import annotations

import numpy as np

from drake_dress.discrepancy.marker_faults.tracks import Jump
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

# A marker has jumped to another's place if it is nearer to it than this share of the distance to
# its own.
_NEARER = 0.4
# Labels are swapped throughout if the distances to other markers are off by more than _OFF, m, and
# by less than this share of that after a swap. Only markers within _NEAR, m, are tried.
_FITS, _OFF, _NEAR = 0.4, 0.05, 0.6
_NEIGHBOURS, _INSTANTS = 8, 25


def exchanged(
    time: FloatArray, marker: FloatArray, places: FloatArray | None, jumps: list[Jump]
) -> list[tuple[tuple[int, ...], BoolArray]]:
    """Returns groups of markers whose labels are swapped, and the samples (T,) at which they are.

    Args:
        time: (T,) s.
        marker: (T,m,3) positions, m, NaN where not seen.
        places: (m,3) positions on the rest shape, m; None if unknown.
        jumps: jumps of the markers.
    """
    found: list[tuple[tuple[int, ...], BoolArray]] = []
    turns: dict[tuple[int, ...], list[int]] = {}
    for group, at in _cycles(marker, jumps):
        turns.setdefault(group, []).append(at)
    for group, samples in turns.items():
        state = np.zeros(len(time), dtype=np.int64)
        for t in samples:
            state[t:] += 1
        bad: BoolArray = np.asarray(state % 2 == 1)
        if places is not None and len(group) == 2 and _fits_exchanged(marker[~bad], places, *group):
            bad = ~bad
        found.append((group, bad))
    if places is None:
        return found
    known = {k for group, _ in found for k in group}
    every = np.ones(len(time), dtype=np.bool_)
    for i, j in _suspects(marker, places):
        if i not in known and j not in known and _fits_exchanged(marker, places, i, j):
            known |= {i, j}
            found.append(((i, j), every))
    return found


def _cycles(marker: FloatArray, jumps: list[Jump]) -> list[tuple[tuple[int, ...], int]]:
    """Returns groups of markers that jump to each other's places, and the samples of the jumps."""
    if not jumps:
        return []
    whose = np.array([j.marker for j in jumps])
    before, after = (np.array([getattr(j, n) for j in jumps]) for n in ("before", "after"))
    expected, allowed = np.stack([j.expected for j in jumps]), np.array([j.allowed for j in jumps])
    to: dict[int, int] = {}
    for n, jump in enumerate(jumps):
        off = np.linalg.norm(expected - marker[jump.after, jump.marker], axis=1)
        most = np.minimum(_NEARER * off[n], 2.0 * np.maximum(allowed, jump.allowed))
        fits = (whose != jump.marker) & (before < jump.after) & (jump.before < after) & (off < most)
        if fits.any():
            to[n] = int(np.argmin(np.where(fits, off, np.inf)))
    found: list[tuple[tuple[int, ...], int]] = []
    done = set[int]()
    for n in to:
        chain = [n]
        while chain[-1] in to and to[chain[-1]] not in chain:
            chain.append(to[chain[-1]])
        if to.get(chain[-1]) == n and len(chain) > 1 and not done & set(chain):
            done |= set(chain)
            group = tuple(sorted(jumps[c].marker for c in chain))
            found.append((group, min(jumps[c].before for c in chain) + 1))
    return found


def _fits_exchanged(marker: FloatArray, places: FloatArray, i: int, j: int) -> bool:
    """Returns whether distances to other markers show that i and j are swapped."""
    near = np.minimum(*(np.linalg.norm(places - places[k], axis=1) for k in (i, j)))
    near[[i, j]] = np.inf
    others = np.argsort(near)[: min(_NEIGHBOURS, len(places) - 2)]
    same, other = (
        0.5 * (_off(marker, places, i, a, others) + _off(marker, places, j, b, others))
        for a, b in ((i, j), (j, i))
    )
    return same > _OFF and other < _FITS * same


def _off(marker: FloatArray, places: FloatArray, k: int, place: int, others: IndexArray) -> float:
    """Returns the mean error of marker k's distances to others if its rest place is `place`, m."""
    seen = np.flatnonzero(np.isfinite(marker[:, k]).all(axis=1))
    if not len(seen):
        return 0.0
    x = marker[seen[np.linspace(0, len(seen) - 1, _INSTANTS).astype(int)]]
    now = np.linalg.norm(x[:, others] - x[:, k : k + 1], axis=2)
    off = np.abs(now - np.linalg.norm(places[others] - places[place], axis=1))
    return float(np.mean(off[np.isfinite(off)])) if np.isfinite(off).any() else 0.0


def _suspects(marker: FloatArray, places: FloatArray) -> list[tuple[int, int]]:
    """Returns pairs of nearby markers that are both away from their places."""
    distance = np.linalg.norm(places[:, None] - places[None], axis=2)
    count = min(_NEIGHBOURS, len(places) - 2) + 1
    off = [
        k
        for k in range(len(places))
        if _off(marker, places, k, k, np.argsort(distance[k])[1:count]) > 0.5 * _OFF
    ]
    return [(i, j) for n, i in enumerate(off) for j in off[n + 1 :] if distance[i, j] < _NEAR]
