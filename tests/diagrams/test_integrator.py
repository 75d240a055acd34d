"""What MuJoCo's garment cannot express is refused before a run begins."""

import sys
from pathlib import Path

import pytest

from drake_dress.diagrams.integrator import check_integrator
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.discrepancy.lab import SimulatedLab
from drake_dress.errors import UserError
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.human.body import BodyMeasures, body_capsules
from drake_dress.shipped import shipped_scenario

# Effects that change the fabric or its contact in ways that MuJoCo's cloth has no parameter for.
BEYOND = {
    "anisotropic_stiffness",
    "strain_stiffening",
    "velocity_dependent_friction",
    "anisotropic_friction",
    "adhesion",
}
SCENARIO = shipped_scenario("dummy_standing")
SETTINGS = ["plant.integrator=mujoco", "plant.spacing=0.06"]

CAPSULES = body_capsules(BodyMeasures(), "standing")


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_only_effects_beyond_mujoco_are_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drake_dress.diagrams.integrator.import_mujoco", lambda: None)
    kind = EFFECTS[name]
    effect = kind(**{p.name: p.typical for p in kind.sizes()})
    check_integrator("my.yaml", "implicit", [effect], CAPSULES)
    if name not in BEYOND:
        check_integrator("my.yaml", "mujoco", [effect], CAPSULES)
        return
    with pytest.raises(UserError, match=f"my.yaml: effects.{name}: is on with plant.integrator"):
        check_integrator("my.yaml", "mujoco", [effect], CAPSULES)


def test_a_missing_mujoco_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    scenario = load_scenario(SCENARIO, SETTINGS)
    with pytest.raises(UserError, match=r"mujoco: is not installed.*drake_dress\[mujoco\]") as told:
        read_setup(scenario, SCENARIO)
    assert "\n" not in str(told.value)


def test_explain_refuses_mujoco() -> None:
    scenario = load_scenario(SCENARIO, SETTINGS)
    with pytest.raises(UserError, match=r"plant\.integrator: is mujoco"):
        SimulatedLab.of(scenario, Path())


def test_limbs_that_taper_are_refused_by_mujoco_alone() -> None:
    tapered = body_capsules(BodyMeasures(elbow_radius=0.04), "standing")
    check_integrator("my.yaml", "implicit", [], tapered)
    with pytest.raises(UserError, match=r"person\.measures: has limbs that taper"):
        check_integrator("my.yaml", "mujoco", [], tapered)
