"""Holds a recording's clock against what a recording can be: seconds, increasing, without holes."""

from __future__ import annotations

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Fewest samples that say anything; shortest and longest recording, s: an hour of simulations at
# four levels of numerics begins at about ten minutes.
_LEAST_SAMPLES, _SHORTEST, _LONGEST = 20, 0.5, 600.0
# Time between samples, s: the median, and the longest time without any. Cloth that swings by moves
# within 0.1 s; faster than a force sensor's 20 kHz nothing measures.
_FASTEST, _SLOWEST, _LONGEST_GAP = 5e-5, 0.1, 0.5
# A clock that begins later than this, s, counts from another time than the recording's begin, and
# rounding would show in it.
_EPOCH = 1e5
# What a time unit would have to be for the spacing to be right.
_UNITS = ((1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds"))


def checked_time(source: str, key: str, time: FloatArray) -> tuple[FloatArray, list[str]]:
    """Returns (T,) s, from 0 on where the clock begins at an epoch, and a note if it does.

    Raises:
        UserError: too few samples, too short or too long, not increasing, too slow, or with a gap.
    """
    count = len(time)
    if count < _LEAST_SAMPLES:
        raise UserError(source, key, f"has {count} samples, expected {_LEAST_SAMPLES} or more")
    step = np.diff(time)
    if np.any(step <= 0.0):
        at = int(np.argmax(step <= 0.0)) + 1
        raise UserError(
            source, key, f"does not increase at sample {at}, expected strictly increasing"
        )
    usual = float(np.median(step))
    if usual > _SLOWEST:
        raise UserError(
            source,
            key,
            f"has samples {usual:.4g} s apart, expected seconds, {_SLOWEST:g} s apart at most"
            f"{_meant(usual)}",
        )
    duration = float(time[-1] - time[0])
    if usual < _FASTEST:
        raise UserError(
            source,
            key,
            f"has samples {usual:.3g} s apart, expected seconds, {_FASTEST:g} s apart at least",
        )
    if step.max() > _LONGEST_GAP:
        at = int(np.argmax(step))
        raise UserError(
            source,
            key,
            f"has a gap of {step[at]:.4g} s after sample {at}, expected {_LONGEST_GAP:g} s at most",
        )
    if duration < _SHORTEST:
        raise UserError(source, key, f"covers {duration:.3g} s, expected {_SHORTEST} or more")
    if duration > _LONGEST:
        raise UserError(
            source, key, f"covers {duration:.4g} s, expected seconds, {_LONGEST:g} at most"
        )
    if abs(time[0]) <= _EPOCH:
        return time, []
    return time - time[0], [f"{key} begins at {time[0]:.6g} s; it is counted from there"]


def _meant(usual: float) -> str:
    """Returns in which unit a spacing would be usual, 1 to 20 ms."""
    for size, name in _UNITS:
        if 5e-4 <= usual * size <= 0.05:
            return f"; is it in {name}, or are these frame numbers?"
    return ""
