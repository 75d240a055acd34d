"""Pairs of a drawn cut and a drawn body, and the scenario of each.

The seed of a cut draws preset, size table and the measures' own variation (`draw_coat`); the seed
of a body draws sex, age, height and weight (`draw_phenotype`). Both seeds together draw the size,
from one below the person's own to two above it, and the seed of the run, which varies pose, fabric
and start.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.dressing.cases import PERSONS, SCENARIOS
from benchmarks.dressing.cases import VARIATIONS as DRESSING
from benchmarks.study import run_case
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.diagrams.scenario.drawn_coat import draw_coat, in_size, own_size
from drake_dress.diagrams.scenario.edges import AT_EDGES
from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.models.human.skin.drawing import draw_phenotype
from drake_dress.models.human.skin.measures import skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin

# Posture to its scenario.
POSTURES = {"standing": PERSONS["dummy"], "sitting": "dummy_sitting.yaml"}
# What the seed of a run draws besides: pose, fabric and start, or nothing.
VARIATIONS = {"few": DRESSING["few"], "none": "{}"}
# Sizes by letters: the tables have them in this order for women and men.
SIZES = ("XS", "S", "M", "L", "XL", "XXL", "3XL", "4XL", "5XL")
# Sizes of the coat, counted from the person's own.
STEPS = (-1, 0, 1, 2)
# A coat that comes on late is watched after its release as well.
_DURATION = "duration=120"
# First numbers of the generators' seeds.
_CUT, _BODY, _PAIR = 1, 2, 3
_DIGITS = 5  # of a coat's measures, m
# What is kept of a run's summary.
_KEPT = (
    *("success", "reason", "stays_on", "collar_to_neck_m", "dressing_time_s"),
    *("s_left", "s_right", "s_dressed_left", "s_dressed_right"),
    *("linking_number_left", "linking_number_right", "simulated_time_s"),
    *("max_gripper_force_N", "max_penetration_m", "max_edge_strain"),
    *("realtime_factor", "wall_time_s", "version"),
)


@dataclass(frozen=True)
class Case:
    """A pair: seeds of cut, body and run, a posture of `POSTURES`, one of `VARIATIONS`."""

    cut: int
    body: int
    seed: int
    posture: str = "standing"
    variation: str = "few"

    @property
    def name(self) -> str:
        """Name for files and tables."""
        which = "" if self.variation == "few" else f"-{self.variation}"
        return f"cut{self.cut}-body{self.body}-{self.posture}{which}"


def pairs(
    cuts: Sequence[int], bodies: Sequence[int], posture: str, variation: str = "few"
) -> list[Case]:
    """Returns every cut with every body, by the seeds of both."""
    return [
        Case(cut, body, int(_generator(cut, body).integers(1000, 2**31)), posture, variation)
        for cut in cuts
        for body in bodies
    ]


@lru_cache(maxsize=64)
def body_of(seed: int) -> Phenotype:
    """Returns the person whom a seed draws."""
    return draw_phenotype(np.random.default_rng([_BODY, seed]))


def coat_of(case: Case) -> Coat:
    """Returns the coat of a pair: the cut in the size that is drawn for this body."""
    cut = _cut_of(case.cut)
    own = size_for(case.body, cut.size_table)
    rng = _generator(case.cut, case.body)
    rng.integers(1000, 2**31)  # the seed of the run
    step = STEPS[int(rng.integers(len(STEPS)))]
    return in_size(cut, SIZES[int(np.clip(SIZES.index(own) + step, 0, len(SIZES) - 1))])


def size_for(body: int, table: str) -> str:
    """Returns the person's own size: that whose chest is nearest to the tape's around theirs."""
    return own_size(table, _chest_of(body), SIZES)


def settings_of(case: Case, overrides: Sequence[str] = ()) -> list[str]:
    """Returns the KEY=VALUE settings of a pair's scenario."""
    coat, plain = asdict(coat_of(case)), asdict(Coat())
    keys = {name: _rounded(value) for name, value in coat.items() if value != plain[name]}
    person = body_of(case.body)
    body = {key: getattr(person, key) for key in ("sex", "age", "height", "weight")}
    return [
        f"garment.coat={json.dumps(keys)}",
        f"person.body={json.dumps(body)}",
        f"variation={VARIATIONS[case.variation]}",
        *AT_EDGES,
        _DURATION,
        *overrides,
    ]


def scenario_of(case: Case, overrides: Sequence[str] = ()) -> Scenario:
    """Returns the scenario of a pair, before its variation is drawn."""
    return load_scenario(_file_of(case), settings_of(case, overrides), case.seed)


def run(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Executes one run and returns its result.

    Args:
        case: pair to dress.
        keep: folder for its log, report and replay; None to keep none.
        overrides: further KEY=VALUE settings of the scenario.
    """
    result = run_case(case, _file_of(case), keep, settings_of(case, overrides), case.seed)
    if "summary" in result:
        result["summary"] = {key: result["summary"].get(key) for key in _KEPT}
    return result


def _file_of(case: Case) -> Path:
    return SCENARIOS / POSTURES[case.posture]


@lru_cache(maxsize=64)
def _cut_of(seed: int) -> Coat:
    coat = draw_coat(np.random.default_rng([_CUT, seed]))
    return in_size(coat, "M")


@lru_cache(maxsize=64)
def _chest_of(seed: int) -> float:
    """Returns the girth of a person's chest, as a tape measures it, m."""
    return skin_measures(phenotype_skin(body_of(seed))).trunk.chest[0]


def _generator(cut: int, body: int) -> np.random.Generator:
    return np.random.default_rng([_PAIR, cut, body])


def _rounded(value: Any) -> Any:
    return round(value, _DIGITS) if isinstance(value, float) else value
