"""A small lab and what it recorded; coarse and short, so that tests are quick."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.discrepancy.generate import Sensors, measured, record
from drake_dress.discrepancy.lab import Numerics, SimulatedLab
from drake_dress.discrepancy.recording import Recording
from drake_dress.models.effects.effect import Effect

SCENARIO = Path(__file__).parents[2] / "scenarios" / "measured.yaml"
QUICK = ("plant.spacing=0.06", "plant.time_step=0.008", "plant.tolerance=2e-3")
SENSORS = Sensors(rate=50.0, markers=24)


@lru_cache
def quick_scenario() -> Scenario:
    return load_scenario(SCENARIO, QUICK)


def recordings(
    motions: Sequence[str] = ("sway",),
    effects: Sequence[Effect] = (),
    duration: float = 1.6,
    seed: int = 0,
    noise: bool = True,
    numerics: Numerics | None = None,
) -> list[Recording]:
    """Returns what a lab with effects records; its simulation is the scenario's."""
    rng = np.random.default_rng(seed)
    lab = SimulatedLab.of(quick_scenario(), SCENARIO.parent, numerics)
    lab = SimulatedLab(**{**vars(lab), "effects": tuple(effects)})
    found = [record(lab, name, duration, SENSORS, rng) for name in motions]
    return [measured(r, SENSORS, rng) for r in found] if noise else found
