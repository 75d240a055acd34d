"""Recordings and the simulations that are compared with them, at several levels of numerics.

    screening  coarser than the scenario, for derivatives by many parameters
    scenario   the scenario's own settings
    doubled    like refined, with twice the time step
    refined    finer mesh and time step: approximates the scenario's model without numerical error

Fits are multi-fidelity: the change of a coarser level with the parameters is added to the refined
prediction at a point nearby: p ↦ refined(p₀) + level(p) − level(p₀).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from drake_dress.diagrams.scenario import Scenario
from drake_dress.discrepancy.lab import Numerics, SimulatedLab
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.replay import Replayer
from drake_dress.discrepancy.workers import Workers
from drake_dress.machine import worker_count
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.effects.effect import Effect
from drake_dress.models.garment.transfer import barycentric_transfer

Level = Literal["screening", "scenario", "doubled", "refined"]
LEVELS: tuple[Level, ...] = ("screening", "scenario", "doubled", "refined")
_Key = tuple[Level, int, tuple[Effect, ...]]
_Replayers = dict[tuple[Level, int], Replayer]

# ω of the observer, 1/s: soft enough to keep discrepancies visible, stiff enough to follow the
# garment.
GAIN = 6.0
# Approximate length of a free run, s; fewest samples in a window.
_WINDOW, _LEAST_SAMPLES = 1.0, 5
# Simulations that are cached, each of all recordings.
_REMEMBERED = 48
# Bounds on a prediction, m and N: an unstable simulation carries no information and must not
# overflow.
_FAR, _HARD = 10.0, 1e3


@dataclass(frozen=True)
class Told:
    """A simulation's prediction of one recording, at the compared samples.

    Attributes:
        marker: (S,m,3) positions of the markers, m.
        force: (S,2,3) force of the garment on the grippers, N.
        contact: (S,) share of the nodes that touch the person.
    """

    marker: FloatArray
    force: FloatArray
    contact: FloatArray


@dataclass(frozen=True)
class Window:
    """A free run of the simulation over a part of a recording.

    Attributes:
        sample: (W,) indices of the recording's samples; time: (W,) their time stamps, s.
        marker: (W,m,3) markers, m; disturbed: the same from a perturbed start, or None.
    """

    sample: IndexArray
    time: FloatArray
    marker: FloatArray
    disturbed: FloatArray | None


@dataclass(frozen=True)
class FreeRun:
    """A simulation's prediction of one recording without coupling to the markers.

    Attributes:
        windows: free runs, each started from the state of the coupled replay at that time.
        length: longest duration of a window, s.
        whole: (T,m,3) markers of a free run over the whole recording, m.
    """

    windows: tuple[Window, ...]
    length: float
    whole: FloatArray


def level_of(*effects: Effect) -> Level:
    """Returns the coarsest level that resolves the effects.

    Coarse cloth bridges round bodies. Of the changes by friction at the refined level, the
    screening level showed a quarter (correlation 0.28), the scenario's level most (0.85).
    """
    return "scenario" if any(e.NEEDS_CONTACT for e in effects) else "screening"


def levels(numerics: Numerics) -> dict[Level, Numerics]:
    """Returns the numerical settings of each level, derived from those of a scenario."""
    n = numerics
    refined = replace(
        n,
        integrator="implicit",
        spacing=max(0.87 * n.spacing, 0.015),
        time_step=min(0.5 * n.time_step, 0.002),
        iterations=max(n.iterations, 100),
        tolerance=min(n.tolerance, 5e-4),
    )
    return {
        "screening": replace(
            n,
            integrator="implicit",
            spacing=min(1.45 * n.spacing, 0.06),
            time_step=min(2.5 * n.time_step, 0.01),
            tolerance=max(n.tolerance, 2e-3),
        ),
        "scenario": n,
        "doubled": replace(refined, time_step=2.0 * refined.time_step),
        "refined": refined,
    }


class Experiment:
    """All recordings and all levels; a context manager that owns worker processes.

    Args:
        scenario: its plant is the simulation that is compared with data.
        base: directory that a mesh file's name is relative to.
        recordings: recordings, at least one.
        period: time between compared samples, s.
        workers: number of processes; by default the number of cores.
        among: names of the effects that may be a cause; by default all known ones.
    """

    def __init__(
        self,
        scenario: Scenario,
        base: Path,
        recordings: Sequence[Recording],
        period: float = 0.02,
        workers: int | None = None,
        among: Collection[str] | None = None,
    ) -> None:
        self.recordings, self.among = list(recordings), among
        p = scenario.plant
        self.numerics = levels(
            Numerics(p.spacing, p.time_step, p.integrator, p.iterations, p.tolerance)
        )
        self.labs = {
            level: SimulatedLab.of(scenario, base, n) for level, n in self.numerics.items()
        }
        self.samples = [_samples(r, period) for r in self.recordings]
        self._count = workers or worker_count()
        self._workers: Workers | None = None
        # the settled garment at the start of each recording, (n,3) m
        self._starts: dict[tuple[Level, int], FloatArray] = {}
        self._told: dict[_Key, Told] = {}
        self._apart: set[tuple[Level, int]] = set()

    def __enter__(self) -> Experiment:
        replayers: _Replayers = {
            (level, i): Replayer(self.labs[level], r)
            for level in LEVELS
            for i, r in enumerate(self.recordings)
        }
        self._workers = Workers(replayers, self._count)
        try:
            self._settle()
        except BaseException:
            self._workers.end()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        if self._workers is not None:
            self._workers.end()
            self._workers = None

    def _settle(self) -> None:
        """Settles the garment at the first level, from which the others are initialized."""
        first = LEVELS[0]
        count = range(len(self.recordings))
        coarse = self._map(_settled, [((first, i), None) for i in count])
        self._starts = {(first, i): coarse[i] for i in count}
        near: dict[Level, FloatArray] = {
            level: barycentric_transfer(self.labs[first].garment, self.labs[level].garment)
            for level in ("scenario", "refined")
        }
        others = [(level, i) for level in near for i in count]
        fine = self._map(_settled, [(key, near[key[0]] @ coarse[key[1]]) for key in others])
        self._starts |= dict(zip(others, fine, strict=True))
        # same mesh as the refined level
        self._starts |= {("doubled", i): self._starts["refined", i] for i in count}

    def tell(
        self,
        jobs: Sequence[tuple[Level | Sequence[Level], Sequence[Effect]]],
        progress: Callable[[], None] | None = None,
    ) -> list[list[Told]]:
        """Returns the predictions of simulations for each recording; recent ones are cached.

        Contact effects are left out for recordings in which an earlier simulation without effects,
        at the same level, had no contact.

        Args:
            jobs: for each simulation, its level, one for all recordings or one for each, and its
                effects.
            progress: called after each replay of one recording.
        """
        count = len(self.recordings)
        keys = [
            [
                self._key(level if isinstance(level, str) else level[i], i, effects)
                for i in range(count)
            ]
            for level, effects in jobs
        ]
        new = [k for k in dict.fromkeys(k for row in keys for k in row) if k not in self._told]
        work = [
            (level, i, self._start(level, i), effects, self.samples[i]) for level, i, effects in new
        ]
        for key, told in zip(new, self._map(_replay, work, progress), strict=True):
            self._told[key] = told
            if not key[2] and not told.contact.any():
                self._apart.add(key[:2])
        answer = [[self._told[key] for key in row] for row in keys]
        while len(self._told) > _REMEMBERED * count:
            del self._told[next(iter(self._told))]
        return answer

    def _key(self, level: Level, index: int, effects: Sequence[Effect]) -> _Key:
        """Returns the cache key, without contact effects if the recording is known to have none."""
        apart = (level, index) in self._apart
        return (
            level,
            index,
            tuple(e for e in effects if not (apart and e.NEEDS_CONTACT)),
        )

    def tell_free(
        self,
        jobs: Sequence[tuple[Level, Sequence[Effect], bool]],
        progress: Callable[[], None] | None = None,
    ) -> list[list[FreeRun]]:
        """Returns free runs of simulations for each recording.

        Args:
            jobs: for each simulation, its level, its effects, and whether windows are run a second
                time from a perturbed start.
            progress: called after each recording.
        """
        count = len(self.recordings)
        work = [
            (level, i, self._start(level, i), tuple(effects), disturbed)
            for level, effects, disturbed in jobs
            for i in range(count)
        ]
        told = self._map(_run_free, work, progress)
        return [told[j * count : (j + 1) * count] for j in range(len(jobs))]

    def _start(self, level: Level, index: int) -> FloatArray:
        if self._workers is None:
            raise RuntimeError("the experiment is not open; use `with`")
        return self._starts[level, index]

    def _map(self, function, work, progress=None):  # type: ignore[no-untyped-def]
        if self._workers is None:
            raise RuntimeError("the experiment is not open; use `with`")
        return self._workers.map(function, work, progress)


def _settled(replayers: _Replayers, key: tuple[Level, int], near: FloatArray | None) -> FloatArray:
    return replayers[key].settled(near)


def _replay(
    replayers: _Replayers,
    level: Level,
    index: int,
    start: FloatArray,
    effects: tuple[Effect, ...],
    samples: IndexArray,
) -> Told:
    replayer = replayers[level, index]
    replayer.start_from(start)
    try:
        p = replayer.run(effects, gain=GAIN)
    except ValueError:
        # coarse steps may be unstable at some values of the effects that are tried
        if not effects:
            raise
        markers = replayer.recording.marker_position.shape[1]
        count = len(samples)
        far = np.full((count, markers, 3), _FAR)
        return Told(far, np.full((count, 2, 3), _HARD), np.zeros(count))
    return Told(
        np.clip(np.nan_to_num(p.marker_position[samples]), -_FAR, _FAR),
        np.clip(np.nan_to_num(p.gripper_force[samples]), -_HARD, _HARD),
        p.contact[samples],
    )


def _run_free(
    replayers: _Replayers,
    level: Level,
    index: int,
    start: FloatArray,
    effects: tuple[Effect, ...],
    disturbed: bool,
) -> FreeRun:
    replayer = replayers[level, index]
    replayer.start_from(start)
    time = replayer.recording.time
    count = max(1, round(replayer.recording.duration / _WINDOW))
    length = replayer.recording.duration / count
    begins = time[0] + length * np.arange(count)
    kept = replayer.run(effects, gain=GAIN, keep=begins)
    rng = np.random.default_rng(index)
    found = []
    for begin, x, v in zip(begins, kept.position, kept.velocity, strict=True):
        sample = np.flatnonzero((time >= begin - 1e-9) & (time <= begin + length + 1e-9))
        if len(sample) < _LEAST_SAMPLES:
            continue
        starts = [(x, v)]
        if disturbed:
            starts.append((x + replayer.error(rng), v))
        told = [
            replayer.run(effects, 0.0, start, begin, begin + length).marker_position[sample]
            for start in starts
        ]
        found.append(Window(sample, time[sample], told[0], told[1] if disturbed else None))
    return FreeRun(tuple(found), length, replayer.run(effects, 0.0).marker_position)


def _samples(recording: Recording, period: float) -> IndexArray:
    """Returns the index of the first sample in each period."""
    slots = np.floor((recording.time - recording.time[0]) / period + 1e-6)
    return np.flatnonzero(np.diff(slots, prepend=-1.0) > 0)
