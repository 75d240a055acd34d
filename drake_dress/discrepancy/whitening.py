"""Whitens markers and forces of all recordings: one vector of residuals with unit variance.

Numerical error counts as noise, too: the refined simulation may be off by a share of the change by
refinement. Unlike the sensors' noise, such an error is correlated in time. So the noise of a signal
is modelled as

    σ ε_t + s_t z_t,    z an Ornstein–Uhlenbeck process of variance 1 and memory τ,

with σ for the sensor and s_t for the numerical error. The whitened residual is the innovations of
the Kalman filter of this model, so a long constant offset counts only once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d

from drake_dress.discrepancy.experiment import Told
from drake_dress.discrepancy.recording import Recording
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

# Numerical error of the refined replay, as a share of the change by refinement.
NUMERICS_SHARE = 0.45
# Memory τ of the numerical error, s; time over which its size is averaged, s.
MEMORY, _AVERAGED = 0.4, 0.3
# One pair of simulations is a poor estimate of a single marker's error. This share of its variance
# comes from that marker, the rest is the mean over all samples with, or without, contact.
_OWN = 0.6
# Length of a block of held-out data, s.
BLOCK = 0.5


@dataclass(frozen=True)
class Whitening:
    """Whitened data, and the map from predictions to whitened vectors.

    Attributes:
        data: (N,) measured data, whitened.
        block: (N,) index of each entry's block.
        recording: (N,) index of its recording; time: (N,) time since the recording's start, s.
        is_force: (N,) whether it is a force.
        marker: (N,) index of its marker, or of its gripper for forces.
        sensor: (N,) standard deviation of the sensor's noise, m or N.
        filters: noise filters of the recordings.
    """

    data: FloatArray
    block: IndexArray
    recording: IndexArray
    time: FloatArray
    is_force: BoolArray
    marker: IndexArray
    sensor: FloatArray
    filters: tuple[NoiseFilter, ...]

    @property
    def voice(self) -> IndexArray:
        """(N,) index of each entry's voice: its recording and kind of signal."""
        return 2 * self.recording + self.is_force

    @property
    def trained_on(self) -> tuple[BoolArray, BoolArray]:
        """Two masks of entries (N,): what is trained on one is judged on the other."""
        odd: BoolArray = self.block % 2 == 1
        return odd, ~odd

    def vector(self, told: Sequence[Told]) -> FloatArray:
        """Returns (N,) the whitened predictions of all recordings."""
        return np.concatenate(
            [f.whitened(_series(t)) for f, t in zip(self.filters, told, strict=True)]
        )

    def size(self, residual: FloatArray) -> FloatArray:
        """Returns (N,) a whitened residual (N,) converted to m and N."""
        parts = zip(self.filters, self._split(residual), strict=True)
        return np.concatenate([f.unwhitened(part) for f, part in parts])

    def of_size(self, values: FloatArray) -> FloatArray:
        """Returns (N,) values in m and N, (N,), whitened: the inverse of `size`."""
        parts = zip(self.filters, self._split(values), strict=True)
        return np.concatenate([f.innovations(part) for f, part in parts])

    def _split(self, values: FloatArray) -> list[FloatArray]:
        """Returns the values (N,) split by recording."""
        return np.split(values, np.cumsum([f.count for f in self.filters])[:-1])


class NoiseFilter:
    """Whitens the signals of one recording.

    Args:
        time: (S,) time stamps of the samples, s.
        sensor: (C,) standard deviation of the sensors' noise.
        numerics: (S,C) standard deviation of the numerical error.
        kept: (S,C) which values were measured.

    Attributes:
        count: number of measured values.
    """

    def __init__(
        self, time: FloatArray, sensor: FloatArray, numerics: FloatArray, kept: BoolArray
    ) -> None:
        self._kept, self._numerics = kept, numerics
        self._decay = np.exp(-np.diff(time, append=time[-1]) / MEMORY)
        self._gain, self._scale = _gains(sensor, numerics, kept, self._decay)
        self.count = int(np.count_nonzero(kept))

    def whitened(self, values: FloatArray) -> FloatArray:
        """Returns (count,) the innovations of `values` (S,C), in standard deviations."""
        return self.innovations(values[self._kept])

    def innovations(self, values: FloatArray) -> FloatArray:
        """Returns (count,) the innovations of values (count,), in standard deviations."""
        out = np.zeros(self._kept.shape)
        out[self._kept] = values
        _whiten(out, self._numerics, self._kept, self._decay, self._gain, self._scale)
        kept: FloatArray = out[self._kept]
        return kept

    def unwhitened(self, innovations: FloatArray) -> FloatArray:
        """Returns (count,) the values whose innovations are given."""
        out = np.zeros(self._kept.shape)
        out[self._kept] = innovations
        _unwhiten(out, self._numerics, self._kept, self._decay, self._gain, self._scale)
        kept: FloatArray = out[self._kept]
        return kept


def whiten(
    recordings: Sequence[Recording],
    samples: Sequence[IndexArray],
    scenario: Sequence[Told],
    refined: Sequence[Told],
    share: float = NUMERICS_SHARE,
) -> Whitening:
    """Returns the whitening of recordings.

    Args:
        recordings: measured recordings.
        samples: indices of the compared samples, for each recording.
        scenario: predictions of the scenario's simulation.
        refined: predictions of the refined simulation.
        share: numerical error of the refined simulation, as a share of the difference of the two.
    """
    numerics = _numerics(recordings, samples, scenario, refined, share)
    filters, data = [], []
    rows: dict[str, list[npt.NDArray[Any]]] = {
        k: [] for k in ("recording", "time", "force", "marker", "sensor")
    }
    for i, (r, s, off) in enumerate(zip(recordings, samples, numerics, strict=True)):
        force = np.full((len(s), 2, 3), np.nan) if r.gripper_force is None else r.gripper_force[s]
        measured = _series(Told(r.marker_position[s], force, np.zeros(len(s))))
        markers = r.marker_position.shape[1]
        sensor = np.repeat([r.marker_noise, r.force_noise], [3 * markers, 6])
        kept: BoolArray = np.asarray(np.isfinite(measured))
        filters.append(NoiseFilter(r.time[s], sensor, off, kept))
        data.append(filters[-1].whitened(measured))
        signal = np.concatenate([np.repeat(np.arange(markers), 3), np.repeat(np.arange(2), 3)])
        forces = np.repeat([False, True], [3 * markers, 6])
        for name, values in (("marker", signal), ("force", forces), ("sensor", sensor)):
            rows[name].append(np.broadcast_to(values, kept.shape)[kept])
        when = r.time[s] - r.time[0]
        rows["time"].append(np.broadcast_to(when[:, None], kept.shape)[kept])
        rows["recording"].append(np.full(filters[-1].count, i))
    flat = {k: np.concatenate(v) for k, v in rows.items()}
    blocks = (flat["time"] / BLOCK).astype(np.int64)
    block = np.unique(flat["recording"] * 10**6 + blocks, return_inverse=True)[1]
    return Whitening(
        np.concatenate(data),
        block,
        flat["recording"],
        flat["time"],
        flat["force"],
        flat["marker"],
        flat["sensor"],
        tuple(filters),
    )


def _numerics(
    recordings: Sequence[Recording],
    samples: Sequence[IndexArray],
    scenario: Sequence[Told],
    refined: Sequence[Told],
    share: float,
) -> list[FloatArray]:
    """Returns (S,C) for each recording: the standard deviation of the numerical error."""
    own: list[tuple[FloatArray, FloatArray]] = []
    for r, s, coarse, fine in zip(recordings, samples, scenario, refined, strict=True):
        window = max(1, round(_AVERAGED / float(np.median(np.diff(r.time[s])))))

        def squared(a: FloatArray, window: int = window) -> FloatArray:
            mean = uniform_filter1d(np.mean(a**2, axis=2), window, axis=0, mode="nearest")
            return np.maximum(mean, 0.0)

        own.append((squared(fine.marker - coarse.marker), squared(fine.force - coarse.force)))
    touching = np.concatenate([t.contact > 0.0 for t in refined])
    pooled = []
    for k in (0, 1):
        rows = np.concatenate([v[k].mean(axis=1) for v in own])
        whole = float(rows.mean())
        free, touched = (
            float(rows[which].mean()) if which.any() else whole for which in (~touching, touching)
        )
        pooled.append((free, touched))
    found = []
    for fine, variances in zip(refined, own, strict=True):
        columns = []
        for (free, touched), variance in zip(pooled, variances, strict=True):
            others = np.where(fine.contact > 0.0, touched, free)[:, None]
            mixed = _OWN * variance + (1.0 - _OWN) * others
            columns.append(np.repeat(share * np.sqrt(mixed), 3, axis=1))
        found.append(np.concatenate(columns, axis=1))
    return found


def _series(told: Told) -> FloatArray:
    """Returns (S,C) the coordinates of the markers, then the components of the forces."""
    count = len(told.marker)
    return np.concatenate([told.marker.reshape(count, -1), told.force.reshape(count, -1)], axis=1)


@nb.njit(cache=True, nogil=True)
def _gains(sensor, numerics, kept, decay):  # type: ignore[no-untyped-def]
    """Returns Kalman gains and innovation standard deviations (S,C) of all signals."""
    gain, scale = np.zeros(kept.shape), np.zeros(kept.shape)
    for c in range(kept.shape[1]):
        variance = 1.0
        for t in range(kept.shape[0]):
            if kept[t, c]:
                s = numerics[t, c]
                whole = s * s * variance + sensor[c] * sensor[c]
                scale[t, c] = np.sqrt(whole)
                gain[t, c] = s * variance / whole
                variance -= gain[t, c] * s * variance
            variance = decay[t] ** 2 * variance + 1.0 - decay[t] ** 2
    return gain, scale


@nb.njit(cache=True, nogil=True)
def _whiten(values, numerics, kept, decay, gain, scale):  # type: ignore[no-untyped-def]
    for c in range(values.shape[1]):
        state = 0.0
        for t in range(values.shape[0]):
            if kept[t, c]:
                innovation = values[t, c] - numerics[t, c] * state
                values[t, c] = innovation / scale[t, c]
                state += gain[t, c] * innovation
            state *= decay[t]


@nb.njit(cache=True, nogil=True)
def _unwhiten(values, numerics, kept, decay, gain, scale):  # type: ignore[no-untyped-def]
    for c in range(values.shape[1]):
        state = 0.0
        for t in range(values.shape[0]):
            if kept[t, c]:
                innovation = values[t, c] * scale[t, c]
                values[t, c] = innovation + numerics[t, c] * state
                state += gain[t, c] * innovation
            state *= decay[t]
