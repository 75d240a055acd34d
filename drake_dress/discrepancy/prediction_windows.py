"""Free runs: how long the simulation can be trusted without markers, and how far it drifts.

A replay of the inputs alone is chaotic: where cloth folds, two runs from nearly the same state are
soon centimetres apart. So about every second the simulation is restarted from the state of the
replay that is coupled to the markers, and runs freely. It is compared with the data up to the
predictability horizon: the time in which an error of the size of the markers' noise grows a few
times larger.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.discrepancy.experiment import Experiment, FreeRun, Level
from drake_dress.discrepancy.explanation import DISCRETISATION, Explanation
from drake_dress.discrepancy.recording import Recording
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.effects.effect import Effect

# Growth of an error, relative to its size at the start, that marks the horizon.
_GROWN = 3.0
# Shortest horizon, s; bin width of the curves, s.
_LEAST, _BIN = 0.2, 0.05


@dataclass(frozen=True)
class Windows:
    """Results of free runs, before and after the simulation was extended.

    Attributes:
        horizon: horizon of each recording, s; the windows' length if errors do not grow that far.
        growth: (R,K) growth of an error of the size of the markers' noise.
        since: (K,) time since a restart, s.
        before, after: (R,K) RMS of the markers' residual, m, NaN where nothing was seen.
        strayed: RMS within the horizon, before and after, m.
        whole: RMS over the whole recordings, each replayed from its start, before and after, m.
        noise: RMS of the markers' noise, m.
    """

    horizon: tuple[float, ...]
    growth: FloatArray
    since: FloatArray
    before: FloatArray
    after: FloatArray
    strayed: tuple[float, float]
    whole: tuple[float, float]
    noise: float


def windows(
    experiment: Experiment,
    explanation: Explanation,
    progress: Callable[[], None] | None = None,
) -> Windows:
    """Returns the free runs of the scenario's simulation and of the extended one.

    Args:
        experiment: an open experiment.
        explanation: explanation of the experiment.
        progress: called after the free run of each recording.
    """
    finer = any(c.name == DISCRETISATION for c in explanation.causes)
    level: Level = "refined" if finer else "scenario"
    jobs: list[tuple[Level, Sequence[Effect], bool]] = [
        ("scenario", (), True),
        (level, explanation.effects, False),
    ]
    before, after = experiment.tell_free(jobs, progress)
    recordings = experiment.recordings
    length = before[0].length
    since: FloatArray = _BIN * (np.arange(round(length / _BIN), dtype=np.float64) + 0.5)
    growth = np.stack([_growth(run, since) for run in before])
    horizon = tuple(_horizon(g, since, length) for g in growth)
    sides = [_binned(runs, recordings, since) for runs in (before, after)]
    courses, strayed = [], []
    for total, count in sides:
        with np.errstate(invalid="ignore"):
            courses.append(np.sqrt(total / count))
        within = since[None, :] < np.array(horizon)[:, None]
        strayed.append(float(np.sqrt(total[within].sum() / max(count[within].sum(), 1))))
    return Windows(
        horizon,
        growth,
        since,
        courses[0],
        courses[1],
        (strayed[0], strayed[1]),
        (_whole(before, recordings), _whole(after, recordings)),
        float(np.sqrt(3.0 * np.mean([r.marker_noise**2 for r in recordings]))),
    )


def _growth(run: FreeRun, since: FloatArray) -> FloatArray:
    """Returns (K,) the median over the windows of an error's size relative to its initial size."""
    sizes = []
    for window in run.windows:
        if window.disturbed is None:
            continue
        apart = np.sqrt(np.mean(np.sum((window.disturbed - window.marker) ** 2, axis=2), axis=1))
        sizes.append(np.interp(since, window.time - window.time[0], apart / max(apart[0], 1e-12)))
    median: FloatArray = np.median(sizes, axis=0)
    return median


def _horizon(growth: FloatArray, since: FloatArray, length: float) -> float:
    """Returns the time until an error has grown past `_GROWN`, s."""
    past = np.flatnonzero(growth > _GROWN)
    return length if not len(past) else max(_LEAST, float(since[past[0]] - 0.5 * _BIN))


def _binned(
    runs: Sequence[FreeRun], recordings: Sequence[Recording], since: FloatArray
) -> tuple[FloatArray, IndexArray]:
    """Returns squared residuals and their count by recording and time since a restart, (R,K)."""
    total = np.zeros((len(runs), len(since)))
    count = np.zeros((len(runs), len(since)), dtype=np.int64)
    for i, (run, r) in enumerate(zip(runs, recordings, strict=True)):
        for window in run.windows:
            squared = _squared(r.marker_position[window.sample], window.marker)
            seen = np.isfinite(squared)
            at = np.minimum(((window.time - window.time[0]) / _BIN).astype(int), len(since) - 1)
            rows = np.broadcast_to(at[:, None], squared.shape)[seen]
            total[i] += np.bincount(rows, squared[seen], len(since))
            count[i] += np.bincount(rows, minlength=len(since))
    return total, count


def _whole(runs: Sequence[FreeRun], recordings: Sequence[Recording]) -> float:
    """Returns the RMS over whole recordings, m."""
    squared = np.concatenate(
        [
            _squared(r.marker_position, run.whole).ravel()
            for run, r in zip(runs, recordings, strict=True)
        ]
    )
    return float(np.sqrt(np.nanmean(squared)))


def _squared(seen: FloatArray, told: FloatArray) -> FloatArray:
    """Returns (S,m) squared distances, m², NaN where nothing was seen."""
    squared: FloatArray = np.sum((seen - told) ** 2, axis=2)
    return squared
