"""Observations of a person as they come, and the evenly spaced history that predictors take.

Cameras and networks deliver at uneven times, drop frames and lose joints. So each observation has
its stamp, and a sample of the history is a line fitted to the observations around its time: between
two it is their interpolation, among many it averages their noise, and a tremor faster than the
history's period does not fold into a slow motion. Where no observation is near, it is missing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.immutable import Immutable


@dataclass(frozen=True)
class Sampling:
    """The even times of a history, and which observations a sample takes.

    Attributes:
        length: number of samples T, the last one now.
        period: time between samples, s.
        width: half width of the weights about a sample's time, s; observations further away count
            only where none is nearer. Beyond the newest observation it is counted from there.
        gap: largest time between the two observations around a sample, s, and twice the largest age
            of the newest one; beyond, the sample is missing.
    """

    length: int = 20
    period: float = 0.1
    width: float = 0.1
    gap: float = 0.25

    @property
    def kept(self) -> float:
        """How long observations are of use, s."""
        return (self.length - 1) * self.period + self.gap + self.width

    def times(self, now: float) -> FloatArray:
        """Returns the times (T,) of the samples, s."""
        back = np.arange(self.length - 1, -1, -1, dtype=np.float64)
        return now - self.period * back


@dataclass(frozen=True)
class Observations(Immutable):
    """Observations in the order of their stamps.

    Attributes:
        time: (M,) stamps, s, strictly increasing.
        value: (M,k,d), NaN where a point was not seen.
    """

    time: FloatArray = field(default_factory=lambda: np.zeros(0))
    value: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)))

    def added(self, time: float, value: FloatArray, kept: float) -> Observations:
        """Returns these with another one, without those older than `kept`, s, before it.

        An observation that is not newer than the last one is left out: it has been seen before, or
        arrives too late.

        Args:
            time: its stamp, s.
            value: (k,d).
            kept: s.
        """
        if not len(self.time):
            return Observations(np.array([time]), value[None].copy())
        if time <= self.time[-1]:
            return self
        first = int(np.searchsorted(self.time, time - kept))
        return Observations(
            np.append(self.time[first:], time), np.concatenate([self.value[first:], value[None]])
        )

    def sampled(self, now: float, sampling: Sampling) -> FloatArray:
        """Returns the even samples (T,k,d), NaN where a point is missing.

        Args:
            now: time of the last sample, s.
            sampling: times and widths.
        """
        times = sampling.times(now)
        points, size = self.value.shape[1:]
        found = np.full((sampling.length, points, size), np.nan)
        if not len(self.time):
            return found
        seen = np.all(np.isfinite(self.value), axis=2)
        alike: dict[bytes, list[int]] = {}
        for k in range(points):
            alike.setdefault(seen[:, k].tobytes(), []).append(k)
        for group in alike.values():
            rows = np.flatnonzero(seen[:, group[0]])
            if len(rows):
                weights, known = line_weights(self.time[rows], times, sampling)
                values = np.einsum("tm,mkd->tkd", weights, self.value[rows][:, group])
                values[~known] = np.nan
                found[:, group] = values
        return found


def line_weights(
    stamps: FloatArray, times: FloatArray, sampling: Sampling
) -> tuple[FloatArray, BoolArray]:
    """Returns weights (T,M) of observations in each sample, and whether it is known (T,).

    Each row is a linear fit with triangular weights, evaluated at the sample's time; it sums to 1
    and reproduces straight motion exactly. The two observations around a sample always count.

    Args:
        stamps: (M,) of observations, s, increasing.
        times: (T,) of samples, s, increasing.
        sampling: widths.
    """
    after = np.searchsorted(stamps, times)
    last = len(stamps) - 1
    next_, before = np.clip(after, 0, last), np.clip(after - 1, 0, last)
    apart = times[:, None] - stamps[None]
    gap = np.where(after > last, times - stamps[last], stamps[next_] - stamps[before])
    gap = np.where(after == 0, stamps[0] - times, gap)
    known = gap <= np.where((after > last) | (after == 0), 0.5, 1.0) * sampling.gap + 1e-9
    # the triangle reaches at least past both neighbours; beyond the ends it holds a whole width of
    # observations, since a line through a few close ones would be continued with their noise
    reach = np.maximum(np.abs(times - stamps[next_]), np.abs(times - stamps[before]))
    beyond = next_ == before
    width = np.where(beyond, reach + sampling.width, np.maximum(sampling.width, 1.05 * reach))
    weight = np.maximum(0.0, 1.0 - np.abs(apart) / width[:, None])
    total = weight.sum(axis=1)
    mean = (weight * apart).sum(axis=1) / total
    off = apart - mean[:, None]
    spread = (weight * off**2).sum(axis=1)
    # the line at the sample's own time, where `apart` is 0
    slope = np.divide(-mean, spread, out=np.zeros_like(mean), where=spread > 1e-12)
    rows: FloatArray = weight * (1.0 / total[:, None] + slope[:, None] * off)
    return rows, known
