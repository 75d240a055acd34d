"""A small lab and what it recorded; coarse and short, so that tests are quick."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.discrepancy.generate import Sensors, measured, record
from drake_dress.discrepancy.lab import Lab

SCENARIO = Path(__file__).parents[2] / "scenarios" / "measured.yaml"
QUICK = ("plant.spacing=0.06", "plant.time_step=0.008", "plant.tolerance=2e-3")
SENSORS = Sensors(rate=50.0, markers=24)


@lru_cache
def quick_scenario():
    return load_scenario(SCENARIO, QUICK)


def recordings(motions=("sway",), effects=(), duration=1.6, seed=0, noise=True, numerics=None):
    """Returns what a lab with effects records; its simulation is the scenario's."""
    rng = np.random.default_rng(seed)
    lab = Lab.of(quick_scenario(), SCENARIO.parent, numerics)
    lab = Lab(**{**vars(lab), "effects": tuple(effects)})
    found = [record(lab, name, duration, SENSORS, rng) for name in motions]
    return [measured(r, SENSORS, rng) for r in found] if noise else found
