"""The plant's garment against a finer one."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.plant.__main__ import SETTINGS
from benchmarks.plant.accuracy import REFERENCE, Part, Setting, compared
from benchmarks.plant.motion import DressingMotion
from benchmarks.plant.replaying import replay
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.models.sides import SIDES

SCENARIO = Path(__file__).parents[2] / "scenarios" / "dummy_standing.yaml"


def still(grippers: np.ndarray) -> DressingMotion:
    """Returns grippers that stay, and a person who is far away."""
    time = np.linspace(0.0, 2.0, 9)
    far = np.tile([[[5.0, 0.0, 0.0]]], (9, 1, 1))
    return DressingMotion(time, np.tile(grippers, (9, 1, 1)), far, far, np.array([0.1]))


def test_settings_are_named_once_and_coarser_than_the_reference() -> None:
    names = [setting.name for setting in SETTINGS]
    assert len(set(names)) == len(names)
    assert set(FIDELITIES) <= set(names)
    for setting in SETTINGS:
        assert setting.spacing >= REFERENCE.spacing
        assert setting.time_step >= REFERENCE.time_step
    # bodies are as the log has them, whatever their step
    expected = {k: v for k, v in FIDELITIES["quick"].items() if k != "body_time_step"}
    assert {k: getattr(Setting.of_fidelity("quick"), k) for k in expected} == expected


@pytest.mark.parametrize("self_collision", [False, True])
def test_what_is_compared_with_itself_is_not_off(self_collision: bool) -> None:
    scenario, folder = load_scenario(SCENARIO), SCENARIO.parent
    setting = Setting("coarse", 0.06, 0.02, self_collision=self_collision)
    mesh, cloth = setting.of(scenario, folder)
    assert cloth.time_step == 0.02
    x = mesh.rest_position
    motion = still(np.stack([x[mesh.grasp[side]].mean(axis=0) for side in SIDES]))
    done = replay(cloth, mesh, motion, x, np.zeros_like(x), 0.0, 1.0)
    part = Part(0.0, x, np.zeros_like(x), done.state.x, done.grippers, done.person)
    (off,) = compared(setting, scenario, folder, mesh, motion, [part])
    assert off["mean_mm"] == pytest.approx(0.0, abs=1e-6)
    assert off["grippers_N"] == pytest.approx(0.0, abs=1e-6)
    longer = Setting("longer steps", 0.06, 0.05, self_collision=self_collision)
    (other,) = compared(longer, scenario, folder, mesh, motion, [part])
    assert other["mean_mm"] > 0.01
