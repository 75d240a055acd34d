"""Finds values that encode a lost marker: a constant, or the last position repeated."""

from __future__ import annotations

import math

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray

# A value is no position if it is farther from the median of all markers than this multiple of their
# median distance from it.
_FAR = 12.0
# Two markers never share a position; this many occurrences are no coincidence.
_SHARED = 3
# Probability of a repetition anywhere in a recording below which it is no coincidence.
_CHANCE = 1e-3
# Gripper speed below which the garment is still, in distances between the grippers per second.
_STILL = 0.005


def substitutes(marker: FloatArray) -> list[tuple[str, BoolArray]]:
    """Returns descriptions of the values that encode lost markers, and where (T,m) they are.

    Args:
        marker: (T,m,3) positions in any unit of length, NaN where not seen.
    """
    found = []
    x, y, z = (marker[:, :, k] for k in range(3))
    equal: BoolArray = np.asarray((x == y) & (y == z))
    for value in np.unique(x[equal]):
        found.append((f"is ({value:g}, {value:g}, {value:g})", equal & (x == value)))
    left = np.where(equal[:, :, None], np.nan, marker)
    seen = np.isfinite(left).all(axis=2)
    if not seen.any():
        return found
    points = left[seen]
    away = np.linalg.norm(left - np.median(points, axis=0), axis=2)
    far: BoolArray = np.asarray(seen & (away > _FAR * np.median(away[seen])))
    if far.any():
        first = left[far][0]
        what = "is far from all others, as ({:g}, {:g}, {:g})".format(*first)
        found.append((what, far))
    shared = _shared(left, seen & ~far)
    if shared.any():
        found.append(("has a position that others have too", shared))
    return found


def held_values(time: FloatArray, marker: FloatArray, gripper: FloatArray) -> BoolArray:
    """Returns (T,m) where a marker repeats its last position although noise would change it.

    Two kinds of repetition are no fault: occasional ones in data that are stored with few digits,
    and those of a garment that is still in data without noise, while its grippers are still.

    Args:
        time: (T,) s.
        marker: (T,m,3) positions in any unit of length, NaN where not seen.
        gripper: (T,2,3) positions in any unit of length.
    """
    held = np.zeros(marker.shape[:2], dtype=np.bool_)
    held[1:] = (marker[1:] == marker[:-1]).all(axis=2)
    seen = np.isfinite(marker).all(axis=2)
    if not held.any():
        return held
    step = np.linalg.norm(np.diff(gripper, axis=0), axis=2).max(axis=1) / np.diff(time)
    apart = float(np.median(np.linalg.norm(gripper[:, 0] - gripper[:, 1], axis=1)))
    still = np.zeros(len(time), dtype=np.bool_)
    still[1:] = step < _STILL * max(apart, 1e-12)
    still &= held.sum(axis=1) >= 0.9 * np.maximum((seen & np.roll(seen, 1, axis=0)).sum(axis=1), 1)
    held &= ~still[:, None]
    chance = _accidental(marker)
    # length of each run of repetitions, to find those that are no coincidence
    length = np.zeros(held.shape, dtype=np.int64)
    for t in range(1, len(held)):
        length[t] = np.where(held[t], length[t - 1] + 1, 0)
    for t in range(len(held) - 2, -1, -1):
        length[t] = np.where(held[t] & held[t + 1], length[t + 1], length[t])
    sure: BoolArray = np.asarray(held & (held.size * chance**length < _CHANCE))
    return sure


def _accidental(marker: FloatArray) -> float:
    """Returns the probability that noise repeats a position, given the stored digits."""
    second = np.abs(marker[2:] - 2.0 * marker[1:-1] + marker[:-2])
    second = second[np.isfinite(second)]
    noise = float(np.median(second)) / (0.6745 * np.sqrt(6.0)) if len(second) else 0.0
    values = np.unique(marker[np.isfinite(marker)])
    steps = np.diff(values)
    digit = float(np.min(steps[steps > 1e-12 * np.abs(values).max()], initial=np.inf))
    if digit > noise:
        # rounding hides the noise: positions of a garment at rest repeat for long
        return 1.0
    # upper bound on the probability that N(0, σ²) is rounded to the same value of a grid of width q
    return math.erf(digit / (2.0 * np.sqrt(2.0) * noise)) ** 3


def _shared(marker: FloatArray, seen: BoolArray) -> BoolArray:
    """Returns (T,m) where a position occurs for several markers."""
    found = np.zeros(seen.shape, dtype=np.bool_)
    # equal first coordinates are rare, so only those positions are compared in full
    x, count = np.unique(marker[:, :, 0][seen], return_counts=True)
    likely = seen & np.isin(marker[:, :, 0], x[count >= _SHARED])
    if not likely.any():
        return found
    rows = np.argwhere(likely)
    points, index = np.unique(marker[likely], axis=0, return_inverse=True)
    index = index.ravel()
    pairs = np.unique(np.stack([index, rows[:, 1]], axis=1), axis=0)
    owners = np.bincount(pairs[:, 0], minlength=len(points))
    times = np.bincount(index, minlength=len(points))
    bad = ((owners > 1) & (times >= _SHARED))[index]
    found[rows[bad, 0], rows[bad, 1]] = True
    return found
