"""Simulations that are made up: linear, but for cloth that folds otherwise, and a decoy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from drake_dress.discrepancy.attribution import Comparison
from drake_dress.discrepancy.candidates import Candidate, Probe
from drake_dress.discrepancy.experiment import Experiment, Level, Told
from drake_dress.discrepancy.recording import Recording
from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.fabric import StretchStiffness

COUNT, SAMPLES, MARKERS, NOISE = 4, 200, 6, 1e-3
TRUTH = 0.05
ASTRAY = 2
# Stretch stiffness, N/m, that changes as much as 1 kg/m² of weight.
DECOY = 1e4


def lasting(rng: np.random.Generator, memory: float = 20) -> FloatArray:
    """Returns errors of variance 1 that stay for so many samples."""
    shape = (COUNT, SAMPLES, MARKERS, 3)
    decay = np.exp(-1.0 / memory)
    found, fresh = np.empty(shape), rng.standard_normal(shape)
    found[:, 0] = fresh[:, 0]
    for t in range(1, SAMPLES):
        found[:, t] = decay * found[:, t - 1] + np.sqrt(1.0 - decay**2) * fresh[:, t]
    return found


def probe_of(
    lab: MadeUp, effects: Sequence[Effect]
) -> Callable[..., list[tuple[Candidate, FloatArray]]]:
    """Returns what takes the place of `search.probe`: a column for each of some effects."""

    def probe(
        experiment: Experiment, comparison: Comparison, progress: Callable[[], None] | None = None
    ) -> list[tuple[Candidate, FloatArray]]:
        columns = []
        for e in effects:
            (told,) = lab.tell([("screening", [e])])
            column = comparison.whitening.vector(told) - comparison.vector["screening"]
            candidate = Candidate(e.NAME, (Probe(e, "added", -np.inf),))
            columns.append((candidate, column[:, None]))
        return columns

    return probe


class MadeUp(Experiment):
    """Simulations that move markers in proportion to what cloth weighs more.

    From a weight on, the coarsest one folds the cloth of one recording another way. Finer ones are
    `steeper` by that factor. What was seen weighs more by `truth`, kg/m². Stretch stiffness is a
    decoy: it does what weight does and a little that was seen besides, but what refining changes
    with it is larger than all of that. Effects act `during` those samples only, by steady
    offsets, while cloth touches the person. Refining the scenario changes markers by `numerics`, m;
    what was measured is off the refined one by `off`, m. Both stay for about 0.4 s. With `apart`
    the decoy also does something that was not seen, m where it is as strong as the truth.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        folds_from: float = 0.02,
        steeper: float = 1.0,
        besides: float = 0.0,
        during: slice = slice(None),
        truth: float = TRUTH,
        numerics: float = 0.0,
        off: float = 0.0,
        apart: float = 0.0,
    ) -> None:
        time = np.arange(SAMPLES, dtype=float) * 0.02
        self.told_at: list[tuple[Level, ...]] = []
        self._folds_from, self._steeper = folds_from, steeper
        self._base = rng.normal(0.0, 0.1, (COUNT, SAMPLES, MARKERS, 3))
        self._slope = rng.normal(0.0, 0.1, (COUNT, SAMPLES, MARKERS, 3))
        self._other = rng.normal(0.0, 0.03, (SAMPLES, MARKERS, 3))
        self._besides = (
            np.random.default_rng(7).normal(0.0, 1.0, (COUNT, SAMPLES, MARKERS, 3))
            * besides
            / TRUTH
        )
        self._shown_apart = (
            np.random.default_rng(8).normal(0.0, 1.0, (COUNT, SAMPLES, MARKERS, 3)) * apart / TRUTH
        )
        self._touching = np.zeros(SAMPLES)
        self._touching[during] = 1.0
        for slope in (self._slope, self._besides):
            if during != slice(None):
                slope[:] = slope[:, :1] * self._touching[:, None, None]
        self._finer = rng.normal(0.0, 0.2e-3, (2, COUNT, SAMPLES, MARKERS, 3))
        if numerics:
            self._finer[0] = numerics * lasting(rng)
        path = np.zeros((SAMPLES, 2, 3))
        self.recordings = []
        for i in range(COUNT):
            seen = self._marker("refined", i, truth / steeper, 0.0)
            if off:
                seen = seen + off * lasting(rng)[i]
            seen = seen + truth * self._besides[i]
            seen = seen + rng.normal(0.0, NOISE, (SAMPLES, MARKERS, 3))
            self.recordings.append(
                Recording(
                    f"r{i}", time, path, seen, np.zeros((MARKERS, 3)), None, None, NOISE, 0.05
                )
            )
        self.samples = [np.arange(SAMPLES)] * COUNT

    def slope(self, i: int) -> FloatArray:
        return self._slope[i]

    def tell(
        self,
        jobs: Sequence[tuple[Level | Sequence[Level], Sequence[Effect]]],
        progress: Callable[[], None] | None = None,
    ) -> list[list[Told]]:
        answer = []
        for level, effects in jobs:
            levels: Sequence[Level] = [level] * COUNT if isinstance(level, str) else level
            self.told_at.append(tuple(levels))
            decoy = _added(e for e in effects if isinstance(e, StretchStiffness)) / DECOY
            added = _added(e for e in effects if not isinstance(e, StretchStiffness))
            answer.append(
                [
                    Told(
                        self._marker(at, i, added, decoy),
                        np.zeros((SAMPLES, 2, 3)),
                        self._touching,
                    )
                    for i, at in enumerate(levels)
                ]
            )
        return answer

    def _marker(self, level: Level, i: int, added: float, decoy: float) -> FloatArray:
        steeper = 1.0 if level == "screening" else self._steeper
        marker = self._base[i] + steeper * (added + decoy) * self._slope[i]
        marker = marker + decoy * (self._besides[i] + self._shown_apart[i])
        if level == "scenario" and decoy != 0.0:
            marker = marker + 2.0 * self._touching[:, None, None] * self._other
        if level in ("screening", "scenario"):
            marker = marker + self._finer[0, i]
        if level == "doubled":
            marker = marker + self._finer[1, i]
        if level == "screening" and i == ASTRAY and abs(added) > self._folds_from:
            marker = marker + self._other
        return marker


def _added(effects: Iterable[Effect]) -> float:
    return sum(e.values()["added"] for e in effects)
