"""Markers and forces of all recordings as one vector in units of their noise.

What the simulation's own numerics leave open counts as noise too: where the refined replay differs
from the scenario's, nothing finer than a share of that difference can be held against physics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d

from drake_dress.discrepancy.experiment import Told
from drake_dress.discrepancy.recording import Recording

FloatArray = npt.NDArray[np.float64]

# Share of the difference between scenario and refined replay that the refined one may still be off.
NUMERICS_SHARE = 0.75
# Length of a block that is judged as one, s; time over which numerics are averaged, s.
BLOCK, _AVERAGED = 0.5, 0.3


@dataclass(frozen=True)
class Whitening:
    """Maps what simulations say to one vector.

    Attributes:
        data: (N,) what was measured over its noise.
        block: (N,) number of the block that an entry is in.
        recording: (N,) its recording; time: (N,) s.
        is_force: (N,) whether it is a force.
        marker: (N,) which marker, or gripper for forces.
        noise_share: (N,) sensors' noise over all noise, standard deviations.
        scale: (N,) what one unit is, m or N.
    """

    data: FloatArray
    block: npt.NDArray[np.int64]
    recording: npt.NDArray[np.int64]
    time: FloatArray
    is_force: npt.NDArray[np.bool_]
    marker: npt.NDArray[np.int64]
    noise_share: FloatArray
    scale: FloatArray
    _kept: npt.NDArray[np.bool_]

    def vector(self, told: Sequence[Told]) -> FloatArray:
        """Returns (N,) what simulations say of the recordings, in units of the noise."""
        values: FloatArray = _stacked(told)[self._kept] / self.scale
        return values


def whiten(
    recordings: Sequence[Recording],
    samples: Sequence[npt.NDArray[np.int64]],
    scenario: Sequence[Told],
    refined: Sequence[Told],
) -> Whitening:
    """Returns the whitening of what was measured.

    Args:
        recordings: what was measured.
        samples: indices that are compared, of each.
        scenario: what the scenario's simulation says.
        refined: what the refined one says.
    """
    measured, noise = [], []
    rows: dict[str, list[npt.NDArray]] = {k: [] for k in ("recording", "time", "force", "marker")}
    for i, (r, s, coarse, fine) in enumerate(
        zip(recordings, samples, scenario, refined, strict=True)
    ):
        force = np.full((len(s), 2, 3), np.nan) if r.gripper_force is None else r.gripper_force[s]
        measured.append(Told(r.marker_position[s], force, np.zeros(len(s))))
        window = max(1, round(_AVERAGED / float(np.median(np.diff(r.time[s])))))
        noise.append(
            Told(
                _noise(r.marker_noise, fine.marker - coarse.marker, window),
                _noise(r.force_noise, fine.force - coarse.force, window),
                np.zeros(len(s)),
            )
        )
        for is_force, shape in ((False, fine.marker.shape), (True, fine.force.shape)):
            rows["recording"].append(np.full(np.prod(shape), i))
            when = r.time[s] - r.time[0]
            rows["time"].append(np.repeat(when, np.prod(shape[1:])))
            rows["force"].append(np.full(np.prod(shape), is_force))
            rows["marker"].append(np.tile(np.repeat(np.arange(shape[1]), 3), shape[0]))
    values, scale = _stacked(measured), _stacked(noise)
    kept = np.isfinite(values)
    flat = {k: np.concatenate(v)[kept] for k, v in rows.items()}
    blocks = (flat["time"] / BLOCK).astype(np.int64)
    block = np.unique(flat["recording"] * 10**6 + blocks, return_inverse=True)[1]
    sensor = np.concatenate(
        [
            np.full(a.size, n)
            for r, t in zip(recordings, refined, strict=True)
            for a, n in ((t.marker, r.marker_noise), (t.force, r.force_noise))
        ]
    )[kept]
    return Whitening(
        values[kept] / scale[kept],
        block,
        flat["recording"],
        flat["time"],
        flat["force"],
        flat["marker"],
        sensor / scale[kept],
        scale[kept],
        kept,
    )


def _noise(sensor: float, numerics: FloatArray, window: int) -> FloatArray:
    """Returns (S,k,3) the standard deviation of a coordinate."""
    squared = np.mean(numerics**2, axis=2)
    averaged = uniform_filter1d(squared, window, axis=0, mode="nearest")
    deviation: FloatArray = np.sqrt(sensor**2 + NUMERICS_SHARE**2 * averaged)
    return np.repeat(deviation[:, :, None], 3, axis=2)


def _stacked(told: Sequence[Told]) -> FloatArray:
    return np.concatenate([np.concatenate([t.marker.ravel(), t.force.ravel()]) for t in told])
