"""The noise of a recording: as given in its file, or estimated from the data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drake_dress.discrepancy.reading.raw import MARKERS, UNITS, RawRecording
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Smallest noise that is estimated, and largest that is accepted, by unit.
_LEAST = {"m": 1e-4, "N": 1e-3}
_MOST = {"m": 0.05, "N": 20.0}
# Noise of forces that are not measured, N.
_UNMEASURED = 0.05
# Ratio of estimated to given noise, or its inverse, above which a note is made.
_OTHERWISE = 3.0


def noise_of(
    raw: RawRecording, datasets: Sequence[str], values: FloatArray | None
) -> tuple[float, list[str]]:
    """Returns the standard deviation of a coordinate, and a note if the data contradict it.

    Args:
        raw: the recording.
        datasets: datasets of one kind; the largest noise given for any of them is used.
        values: (T,k,3) their values, NaN where not measured; None if nothing was measured.

    Raises:
        UserError: the given noise is larger than that of any useful sensor.
    """
    if values is None:
        return _UNMEASURED, []
    unit = UNITS[datasets[0]]
    found = _estimated(values, _LEAST[unit])
    given = {name: raw.noise[name] for name in datasets if name in raw.noise}
    if not given:
        return found, []
    name = max(given, key=lambda n: given[n])
    if given[name] > _MOST[unit]:
        raise UserError(
            raw.source,
            raw.key(name),
            f"has noise_std {given[name]:g}, expected {unit}, up to {_MOST[unit]:g}",
        )
    ratio = found / given[name]
    if ratio <= _OTHERWISE and (ratio >= 1.0 / _OTHERWISE or found <= _LEAST[unit]):
        return given[name], []
    what = "markers scatter" if name == MARKERS else "forces scatter"
    return given[name], [
        f"noise_std of {raw.key(name)} is {given[name]:.2g} {unit}, the {what} by "
        f"{found:.2g} {unit}; what the file says is used"
    ]


def _estimated(values: FloatArray, least: float) -> float:
    """Returns the noise (standard deviation of a coordinate) of values (T,k,3), at least `least`.

    It is estimated from the median absolute second difference over the quieter half of the time:
    at rest and in steady motion, second differences are noise alone.
    """
    second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    second = second[np.isfinite(second).any(axis=(1, 2))]
    if not len(second):
        return least
    size = np.nanmedian(second, axis=(1, 2))
    quiet = size <= np.median(size)
    # the median of |N(0, 6 σ²)| is 0.6745 √6 σ
    return max(float(np.nanmedian(second[quiet])) / (0.6745 * np.sqrt(6.0)), least)
