"""The runs of the study, and the results kept of each."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.study import run_case
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

SCENARIOS = Path(__file__).parents[2] / "scenarios"
METHODS = ("full", "global", "local")
# Person to the scenario with that person.
PERSONS = {
    "dummy": "dummy_standing.yaml",
    "passive_standing": "passive_standing.yaml",
    "passive_sitting": "passive_sitting.yaml",
    "active": "active_standing.yaml",
    "wheelchair": "wheelchair.yaml",
    "stiff_elbow": "stiff_elbow.yaml",
    "stiff_shoulder": "stiff_shoulder.yaml",
    "paralysed_arm": "paralysed_arm.yaml",
    "spasm": "spasm.yaml",
    "limited_range": "limited_range.yaml",
}
# Those of the study in docs/dressing.md; others are asked for by name.
STUDIED = ("dummy", "passive_standing", "passive_sitting", "active")
COATS = {
    "jacket": "{preset: jacket, body_length: 0.70, chest: 1.28, shoulder_width: 0.52, "
    "armhole_girth: 0.60, cuff_girth: 0.36, front_opening: 0.34}",
    "overcoat": "{preset: overcoat, shoulder_width: 0.52, front_opening: 0.34}",
}
# What the seed draws: all measures, as in scenarios/dummy_varied.yaml, or the few drawn for the
# first figures, when coat_scale did not change explicitly given measures.
_SAME = "plant_stiffness: 0.3, plant_friction: 0.3, start_offset: 0.03}"
VARIATIONS = {
    "all": "{arm_angle_deg: 10.0, coat_scale: 0.05, coat_measures: 0.03, person_scale: 0.05, "
    f"person_measures: 0.03, {_SAME}",
    "few": f"{{arm_angle_deg: 10.0, {_SAME}",
}
# Time step of the kept series, s.
SERIES_STEP = 0.2


@dataclass(frozen=True)
class Case:
    """One run: `method` of METHODS, `person` of PERSONS, `coat` of COATS, VARIATIONS."""

    method: str
    person: str
    coat: str
    seed: int
    variation: str = "few"

    @property
    def name(self) -> str:
        """Name for files and tables."""
        which = "" if self.variation == "few" else f"-{self.variation}"
        return f"{self.method}-{self.person}-{self.coat}-{self.seed}{which}"


def cases(
    methods: Sequence[str],
    persons: Sequence[str],
    coats: Sequence[str],
    seeds: Sequence[int],
    variation: str = "all",
) -> list[Case]:
    """Returns all cases, ordered by seed first, so that any part covers all groups evenly."""
    return [
        Case(method, person, coat, seed, variation)
        for seed, person, coat, method in itertools.product(seeds, persons, coats, methods)
    ]


def settings_of(case: Case, overrides: Sequence[str] = ()) -> list[str]:
    """Returns the KEY=VALUE settings of a case's scenario."""
    return [
        f"controller.method={case.method}",
        f"garment.coat={COATS[case.coat]}",
        f"variation={VARIATIONS[case.variation]}",
        *overrides,
    ]


def scenario_of(case: Case, overrides: Sequence[str] = ()) -> Scenario:
    """Returns the scenario of a case, before its variation is drawn."""
    return load_scenario(SCENARIOS / PERSONS[case.person], settings_of(case, overrides), case.seed)


def run(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Executes one run and returns its result.

    Args:
        case: Case to run.
        keep: Folder for its log, report and replay; None to keep none.
        overrides: Further KEY=VALUE settings of the scenario.
    """
    return run_case(
        case,
        SCENARIOS / PERSONS[case.person],
        keep,
        settings_of(case, overrides),
        case.seed,
        _measured,
    )


def _measured(out: Path) -> dict[str, Any]:
    with RunLog.open(out / "run.h5") as log:
        series, force = _series(log)
    return {"force_p99": force, "series": series}


def _series(log: RunLog) -> tuple[dict[str, list[Any]], float]:
    """Returns s, l and force over time, and the 99 % quantile of the gripper force, N."""
    at = np.arange(log.time[0], log.time[-1], SERIES_STEP)
    rows = np.searchsorted(log.time, at)
    force = np.stack([np.linalg.norm(log.gripper_force[side], axis=1) for side in SIDES], axis=1)
    series: dict[str, list[Any]] = {"time": np.round(at, 3).tolist()}
    for k, side in enumerate(SIDES):
        series[f"s_{side}"] = np.round(log.dressing[side][rows, 0], 3).tolist()
        series[f"l_{side}"] = np.round(log.dressing[side][rows, 1], 4).tolist()
        series[f"force_{side}"] = np.round(force[rows, k], 2).tolist()
    return series, float(np.quantile(force, 0.99))
