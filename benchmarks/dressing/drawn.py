"""The numbers drawn by a run's seed, by which the runs of a study differ."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

from benchmarks.dressing.cases import Case, scenario_of
from drake_dress.diagrams.scenario import Scenario, apply_variation
from drake_dress.diagrams.scenario.coat import coat_parameters
from drake_dress.diagrams.sections.person import measures


def drawn(case: Case) -> dict[str, float]:
    """Returns the drawn measures, angles and values of a run by name, in SI units and degrees."""
    scenario = _scenario(replace(case, seed=0))
    return values(apply_variation(replace(scenario, seed=case.seed)))


@lru_cache
def _scenario(case: Case) -> Scenario:
    return scenario_of(case)


def values(scenario: Scenario) -> dict[str, float]:
    """Returns the numbers of a scenario that a variation may change."""
    found: dict[str, float] = {}
    for side in ("left", "right"):
        arm = getattr(scenario.person, f"{side}_arm")
        for name in ("abduction_deg", "extension_deg", "elbow_deg"):
            found[f"{side}_{name}"] = getattr(arm, name)
    sizes = _numbers(scenario.person.measures)
    masses = measures(scenario.person).arm_masses
    sizes |= zip(("upper_arm_mass", "forearm_mass"), masses, strict=True)
    found |= {f"body_{k}": v for k, v in sizes.items()}
    coat = coat_parameters(scenario.garment.coat)
    found |= {f"coat_{k}": v for k, v in coat.lengths.items()}
    if coat.sleeve_slope_deg is not None:
        found["coat_sleeve_slope_deg"] = coat.sleeve_slope_deg
    fabric = scenario.plant.material
    found |= {f"fabric_{k}": getattr(fabric, k) for k in ("stretch_stiffness", "friction")}
    found |= {f"start_{k}": v for k, v in _numbers(scenario.station.start).items()}
    return found


def _numbers(entry: Any) -> dict[str, float]:
    """Returns the values that are given."""
    found = {f.name: getattr(entry, f.name) for f in fields(entry)}
    return {name: float(value) for name, value in found.items() if value is not None}
