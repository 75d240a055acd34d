"""The cases of the study and their hidden effects; generated data are kept."""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_dress.diagrams.scenario import Scenario
from drake_dress.discrepancy.generate import Sensors, Session, measured, record_all
from drake_dress.discrepancy.hidden_effect import NOTHING, draw_hidden, hideable
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.unlisted_effects import UNLISTED
from drake_dress.models.effects.effect import Effect

DURATION = 4.0
# A deliberately coarse model: five times the time step, one iteration.
COARSE = ("plant.time_step=0.02", "plant.iterations=1")


@dataclass(frozen=True)
class Case:
    """One set of recordings.

    Attributes:
        group: Group: effect, nothing, pair, coarse or outside.
        hide: Effects joined by "+", or nothing.
        seed: Seed of all draws.
        size: Factor on the effect's strength.
        marker_noise, force_noise: Noise of markers, m, and forces, N.
    """

    group: str
    hide: str
    seed: int
    size: float = 1.0
    marker_noise: float = 1e-3
    force_noise: float = 0.05

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"{self.group}-{self.hide}-{self.seed}-{self.size:g}-{self.marker_noise:g}"


def cases(
    groups: Sequence[str], draws: dict[str, int], seed: int, size: float, noise: float
) -> list[Case]:
    """Returns the cases of the selected groups, with `draws` for each."""
    found: list[Case] = []
    forces = 50.0 * noise

    def add(group: str, hide: str, k: int) -> None:
        found.append(Case(group, hide, seed + k, size, noise, forces))

    for k in range(max(draws.values(), default=0)):
        if "effect" in groups and k < draws["effect"]:
            for name in hideable():
                add("effect", name, k)
        if "nothing" in groups and k < draws["nothing"]:
            add("nothing", NOTHING, k)
        if "pair" in groups and k < draws["pair"]:
            rng = np.random.default_rng([seed + k, 2])
            add("pair", "+".join(rng.choice(list(hideable()), 2, replace=False)), k)
        if "coarse" in groups and k < draws["coarse"]:
            add("coarse", NOTHING, k)
        if "outside" in groups and k < draws["outside"]:
            for name in UNLISTED:
                add("outside", name, k)
    return found


def study(
    groups: Sequence[str],
    draws: dict[str, int],
    seed: int,
    sizes: Sequence[float],
    noises: Sequence[float],
    beside: int,
) -> list[Case]:
    """Returns the cases of a study: all groups at the first size and noise, effects at the others.

    The further sizes and noises are ordered by effect, in a shuffled order, so that an unfinished
    study has covered the same effects at each of them.

    Args:
        groups: Groups to include.
        draws: Number of draws by group.
        seed: Seed of the first draw.
        sizes: Factors on the effects' strength.
        noises: Noises of markers, m.
        beside: Number of draws of each effect at each further size or noise.
    """
    found = cases(groups, draws, seed, sizes[0], noises[0])
    if "effect" in groups:
        settings = [(sizes[0], n) for n in noises[1:]] + [(s, noises[0]) for s in sizes[1:]]
        further = [cases(["effect"], {"effect": beside}, seed, *setting) for setting in settings]
        count = len(hideable())
        mixed = np.random.default_rng(seed).permutation(count)
        for k in range(beside):
            for i in mixed:
                found += [draws_there[k * count + i] for draws_there in further]
    return found


def make(
    case: Case, scenario: Scenario, base: Path, cache: Path, workers: int | None = None
) -> tuple[list[Effect], list[Recording]]:
    """Returns hidden effects and noisy recordings; keeps the noise-free truth in `cache`."""
    seeds = [case.seed, *case.hide.encode()]
    hidden = draw_hidden(case.hide, np.random.default_rng(seeds), case.size)
    sensors = Sensors(marker_noise=case.marker_noise, force_noise=case.force_noise)
    session = Session(duration=DURATION, sensors=sensors)
    key = json.dumps(
        [case.hide, case.seed, case.size, DURATION, *[repr(e) for e in hidden], str(scenario)]
    )
    path = cache / f"truth-{hashlib.sha256(key.encode()).hexdigest()[:16]}.pickle"
    if path.exists():
        clean = pickle.loads(path.read_bytes())
    else:
        clean = record_all(scenario, base, hidden, seeds, session, workers)
        cache.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial")
        partial.write_bytes(pickle.dumps(clean))
        partial.replace(path)
    rng = np.random.default_rng([case.seed, round(1e6 * case.marker_noise), *case.hide.encode()])
    return hidden, [measured(r, sensors, rng) for r in clean]
