"""Checks a recording's time stamps: in seconds, strictly increasing, without gaps."""

from __future__ import annotations

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Fewest samples of use; shortest and longest recording, s. Ten minutes of data take about an hour
# to simulate at four levels of numerics.
_LEAST_SAMPLES, _SHORTEST, _LONGEST = 20, 0.5, 600.0
# Bounds on the median time between samples, and the longest gap, s. 0.1 s still resolves swinging
# cloth; no force sensor is faster than 20 kHz.
_FASTEST, _SLOWEST, _LONGEST_GAP = 5e-5, 0.1, 0.5
# A clock that starts later than this, s, counts from an epoch, and rounding errors would show.
_EPOCH = 1e5
# Other units that the time stamps may be in, s.
_UNITS = ((1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds"))


def checked_time(source: str, key: str, time: FloatArray) -> tuple[FloatArray, list[str]]:
    """Returns time stamps (T,), s, shifted to start at 0 if they count from an epoch, and notes.

    Raises:
        UserError: too few samples, too short or too long, not increasing, sampled too slowly or too
            fast, or with a gap.
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
    """Returns a hint at the unit in which a spacing would be usual, 0.5 to 50 ms; empty if none."""
    for size, name in _UNITS:
        if 5e-4 <= usual * size <= 0.05:
            return f"; is it in {name}, or are these frame numbers?"
    return ""
