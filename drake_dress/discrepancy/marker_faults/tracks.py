"""Splits a marker's track at its jumps and finds the pieces that do not belong to the marker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

# A step is a jump if it differs from the median of the steps around it by more than
#     _FLOOR + _NOISES σ + min(_CURVED dt², _FASTEST dt).
# In generated data of all motions the largest real difference is 5 mm at 100 Hz, 14 mm at 50 Hz and
# 29 mm at 25 Hz. Noise alone reaches 9 σ once in ten million. Units: m, 1, m/s², m/s.
_FLOOR, _NOISES, _CURVED, _FASTEST = 0.01, 9.0, 50.0, 2.0
# Steps on either side from which a marker's velocity is estimated.
_ABOUT = 2
# Pieces join across others if the marker could get from one to the next at this speed, m/s.
_JOINED = 1.5
# Consecutive pieces that last at least this long, s, join across a jump of less than this size.
_LASTING, _SURE = 0.3, 2.0
# A track in more pieces than this is discarded.
_MOST_PIECES = 400
# Neighbours that a marker is compared with; fewest that must be seen.
_NEIGHBOURS, _LEAST = 8, 3
# Allowed stretch of the cloth; tolerance on the distance along it, m; allowance for noise, σ.
_STRETCHED, _SLACK, _SLACK_NOISES = 1.15, 0.04, 8.0


@dataclass(frozen=True)
class Jump:
    """A step of one marker that its own motion does not explain.

    Attributes:
        marker: index of the marker.
        before: last sample before the step; after: first sample after the step.
        size: deviation from the expected position, relative to `allowed`.
        expected: (3,) expected position after the step, m.
        allowed: allowed deviation from it, m.
    """

    marker: int
    before: int
    after: int
    size: float
    expected: FloatArray
    allowed: float


def find_jumps(time: FloatArray, marker: FloatArray, noise: float) -> list[Jump]:
    """Returns the jumps of all markers (T,m,3), m, in the order of markers and time.

    Args:
        time: (T,) s.
        marker: positions, NaN where not seen, m.
        noise: standard deviation of a coordinate, m.
    """
    found = []
    for k in range(marker.shape[1]):
        seen = np.flatnonzero(np.isfinite(marker[:, k]).all(axis=1))
        if len(seen) < 2:
            continue
        dt, step = np.diff(time[seen]), np.diff(marker[seen, k], axis=0)
        rate = _steady(step / dt[:, None])
        off = np.linalg.norm(step - rate * dt[:, None], axis=1)
        allowed = _FLOOR + _NOISES * noise + np.minimum(_CURVED * dt * dt, _FASTEST * dt)
        for i in np.flatnonzero(off > allowed):
            found.append(
                Jump(
                    k,
                    int(seen[i]),
                    int(seen[i + 1]),
                    float(off[i] / allowed[i]),
                    marker[seen[i], k] + rate[i] * dt[i],
                    float(allowed[i]),
                )
            )
    return found


def out_of_reach(marker: FloatArray, reach: FloatArray | None, noise: float) -> BoolArray:
    """Returns (T,m) where a marker is farther from most of its neighbours than the cloth allows.

    Args:
        marker: (T,m,3) positions, m, NaN where not seen.
        reach: (m,m) distance along the cloth between markers, m; None, if unknown, finds nothing.
        noise: standard deviation of a coordinate, m.
    """
    count = marker.shape[1]
    torn, there = (np.zeros(marker.shape[:2], dtype=np.int64) for _ in range(2))
    if reach is None:
        return np.zeros(marker.shape[:2], dtype=np.bool_)
    for k in range(count):
        others = np.argsort(reach[k])
        others = others[(others != k) & np.isfinite(reach[k][others])][:_NEIGHBOURS]
        distance = np.linalg.norm(marker[:, others] - marker[:, k : k + 1], axis=2)
        most = _STRETCHED * reach[k, others] + _SLACK + _SLACK_NOISES * noise
        there[:, k] = np.isfinite(distance).sum(axis=1)
        torn[:, k] = (distance > most).sum(axis=1)
    far: BoolArray = np.asarray((there >= _LEAST) & (torn >= _LEAST) & (2 * torn > there))
    return far


def strays(time: FloatArray, marker: FloatArray, jumps: list[Jump], far: BoolArray) -> BoolArray:
    """Returns (T,m) where a marker is not on its track.

    Jumps cut a track into pieces. The marker's own pieces are those that join and hold the most
    samples within the reach of its neighbours, less those out of reach.

    Args:
        time: (T,) s.
        marker: (T,m,3) positions, m, NaN where not seen.
        jumps: jumps of all markers.
        far: (T,m) where a marker is out of its neighbours' reach.
    """
    astray = np.zeros(marker.shape[:2], dtype=np.bool_)
    for k in sorted({j.marker for j in jumps}):
        own = [j for j in jumps if j.marker == k]
        seen = np.flatnonzero(np.isfinite(marker[:, k]).all(axis=1))
        cuts = np.searchsorted(seen, [j.after for j in own])
        pieces = np.split(seen, cuts)
        if len(pieces) > _MOST_PIECES:
            astray[seen, k] = True
            continue
        chosen = _joined(time, marker[:, k], pieces, own, far[:, k])
        for i, piece in enumerate(pieces):
            astray[piece, k] = i not in chosen
    return astray


def _joined(
    time: FloatArray, track: FloatArray, pieces: list[IndexArray], cuts: list[Jump], far: BoolArray
) -> set[int]:
    """Returns the indices of the marker's pieces: the heaviest chain of pieces that join."""
    weight = [len(p) - 2.0 * np.count_nonzero(far[p]) for p in pieces]
    total, last = list(weight), [-1] * len(pieces)
    for b in range(len(pieces)):
        for a in range(b):
            joins = (
                _lasts(time, pieces[a], pieces[b]) and cuts[a].size < _SURE
                if b == a + 1
                else _meet(time, track, pieces[a], pieces[b], cuts[a].allowed)
            )
            if joins and total[a] + weight[b] > total[b]:
                total[b], last[b] = total[a] + weight[b], a
    at = int(np.argmax(total))
    chosen = set()
    while at >= 0:
        chosen.add(at)
        at = last[at]
    return chosen


def _lasts(time: FloatArray, *pieces: IndexArray) -> bool:
    return all(time[p[-1]] - time[p[0]] >= _LASTING for p in pieces)


def _meet(
    time: FloatArray, track: FloatArray, a: IndexArray, b: IndexArray, allowed: float
) -> bool:
    """Returns whether the marker could move from the end of piece a to the start of piece b."""
    gap = float(time[b[0]] - time[a[-1]])
    return float(np.linalg.norm(track[b[0]] - track[a[-1]])) <= allowed + _JOINED * gap


def _steady(rate: FloatArray) -> FloatArray:
    """Returns (K,3) the running median of rates over the steps around each, including itself."""
    padded = np.pad(rate, ((_ABOUT, _ABOUT), (0, 0)), mode="reflect" if len(rate) > 2 else "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _ABOUT + 1, axis=0)
    median: FloatArray = np.median(windows, axis=2)
    return median
