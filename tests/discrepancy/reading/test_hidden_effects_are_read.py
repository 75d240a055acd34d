"""What may be hidden in measured data is plausible: none of it is refused or taken for a fault."""

from pathlib import Path

import numpy as np
import pytest

from drake_dress.diagrams.garment import build_garment
from drake_dress.discrepancy.hidden_effect import draw_hidden
from drake_dress.discrepancy.measured_log import write_recordings
from drake_dress.discrepancy.reading import read_recordings
from tests.discrepancy.data import quick_scenario, recordings

# Every motion, and the effects that change sizes, forces, axes and clocks most.
HIDDEN = [
    ("rest_size", "sway"),
    ("local_mass", "lift"),
    ("gripper_slip", "pull"),
    ("gravity_tilt", "drop"),
    ("time_offset+camera_rotation+camera_translation", "drag"),
    ("wind+surface_density", "shift"),
    ("gripper_latency", "dress"),
]


@pytest.mark.parametrize(("effects", "motion"), HIDDEN)
@pytest.mark.parametrize("size", [1.5])
def test_hidden_effects_are_read_as_they_are(
    tmp_path: Path, effects: str, motion: str, size: float
) -> None:
    seed = len(effects)
    hidden = draw_hidden(effects, np.random.default_rng(seed), size)
    (made,) = recordings((motion,), hidden, duration=4.0, seed=seed)
    scenario = quick_scenario()
    mesh = build_garment(scenario.garment, scenario.plant.spacing, Path("."))
    path = tmp_path / "measured.h5"
    write_recordings(path, [made], "scenario: text")
    (found,) = read_recordings([path], mesh, scenario.plant.material.surface_density)
    assert found.notes == ()
    np.testing.assert_array_equal(found.marker_position, made.marker_position)
