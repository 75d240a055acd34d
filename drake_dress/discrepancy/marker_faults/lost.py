"""Values that stand for a marker that was lost: a constant, or the last position again."""

from __future__ import annotations

import math

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray

# A value farther from the middle of all markers than so many times their usual distance is none.
_FAR = 12.0
# Two markers never share a position; so often is no chance.
_SHARED = 3
# Chance of a repetition anywhere in a recording below which it is no chance.
_CHANCE = 1e-3
# Grippers that move less than this, of the garment's size per second, do not move it.
_STILL = 0.005


def substitutes(marker: FloatArray) -> list[tuple[str, BoolArray]]:
    """Returns what constants stand for markers that were lost, and where (T,m).

    Args:
        marker: (T,m,3) in any unit of length, NaN where not seen.
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
    """Returns (T,m) where a marker repeats its last position and noise would not let it.

    What is stored with few digits repeats now and then, and a garment that stands still in data
    without noise repeats as long as its grippers do: neither is a fault.

    Args:
        time: (T,) s.
        marker: (T,m,3) in any unit of length, NaN where not seen.
        gripper: (T,2,3) in any unit of length.
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
    # so many repetitions in a row are no chance
    length = np.zeros(held.shape, dtype=np.int64)
    for t in range(1, len(held)):
        length[t] = np.where(held[t], length[t - 1] + 1, 0)
    for t in range(len(held) - 2, -1, -1):
        length[t] = np.where(held[t] & held[t + 1], length[t + 1], length[t])
    sure: BoolArray = np.asarray(held & (held.size * chance**length < _CHANCE))
    return sure


def _accidental(marker: FloatArray) -> float:
    """Returns the chance that noise repeats a position, from the digits that are stored."""
    second = np.abs(marker[2:] - 2.0 * marker[1:-1] + marker[:-2])
    second = second[np.isfinite(second)]
    noise = float(np.median(second)) / (0.6745 * np.sqrt(6.0)) if len(second) else 0.0
    values = np.unique(marker[np.isfinite(marker)])
    steps = np.diff(values)
    digit = float(np.min(steps[steps > 1e-12 * np.abs(values).max()], initial=np.inf))
    if digit > noise:
        # what is stored hides the noise: a garment at rest repeats for long
        return 1.0
    # N(0, σ²) is rounded to the same value of a grid of width q at most so often
    return math.erf(digit / (2.0 * np.sqrt(2.0) * noise)) ** 3


def _shared(marker: FloatArray, seen: BoolArray) -> BoolArray:
    """Returns (T,m) where a position is one that several markers have had."""
    found = np.zeros(seen.shape, dtype=np.bool_)
    # the same first coordinate is rare, so only those are compared whole
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
