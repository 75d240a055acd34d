"""What MuJoCo's garment cannot express is refused before a run begins; all integrators let go."""

import sys
from pathlib import Path

import numpy as np
import pytest

from drake_dress.diagrams.integrator import check_integrator
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.diagrams.station import plant_integrator
from drake_dress.discrepancy.lab import SimulatedLab
from drake_dress.errors import UserError
from drake_dress.models.cloth.contact.modes import HELD
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.shipped import shipped_scenario
from tests.needs_mujoco import needs_mujoco
from tests.systems.draped import draped

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


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_only_effects_beyond_mujoco_are_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drake_dress.diagrams.integrator.import_mujoco", lambda: None)
    kind = EFFECTS[name]
    effect = kind(**{p.name: p.typical for p in kind.sizes()})
    check_integrator("my.yaml", "implicit", [effect])
    if name not in BEYOND:
        check_integrator("my.yaml", "mujoco", [effect])
        return
    with pytest.raises(UserError, match=f"my.yaml: effects.{name}: is on with plant.integrator"):
        check_integrator("my.yaml", "mujoco", [effect])


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


@pytest.mark.parametrize(
    "integrator", ["implicit", "projective_dynamics", pytest.param("mujoco", marks=needs_mujoco)]
)
def test_a_garment_that_is_let_go_has_no_held_nodes(integrator: str) -> None:
    cloth = plant_integrator(draped(integrator=integrator))
    state = ClothState.at_rest(cloth.elements.rest_position)
    state, _ = cloth.step(state, Obstacles.none(), np.zeros((len(cloth.held), 3)))
    assert (state.mode[cloth.held] == HELD).all()
    state, _ = cloth.step(state, Obstacles.none(), np.zeros((0, 3)))
    assert not (state.mode == HELD).any()
    assert not state.reaction.any()
