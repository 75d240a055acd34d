"""Effects in a scenario: reading, refusal, and action in the station."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import Scenario, load_scenario, resolved_yaml
from drake_dress.diagrams.sections.effects import effects
from drake_dress.diagrams.setup import station_parameters
from drake_dress.diagrams.station import make_simulated_station
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.air import Wind
from drake_dress.models.effects.registry import EFFECTS
from tests.discrepancy.data import SCENARIO
from tests.models.effects.own import HemChain, registered

QUICK = ["plant.spacing=0.06", "plant.time_step=0.01", "plant.body_time_step=0.01"]


def test_every_effect_can_be_switched_on_and_loads_again(tmp_path: Path) -> None:
    settings = [
        f"effects.{name}.{p.name}={p.typical}"
        for name, kind in EFFECTS.items()
        for p in kind.parameters()
    ]
    scenario = load_scenario(SCENARIO, settings)
    assert [e.NAME for e in effects(scenario.effects)] == list(EFFECTS)
    copy = tmp_path / "all.yaml"
    copy.write_text(resolved_yaml(scenario))
    assert effects(load_scenario(copy).effects) == effects(scenario.effects)


def test_what_is_not_given_is_off_and_uncertainties_do_not_matter() -> None:
    assert effects(load_scenario(SCENARIO).effects) == ()
    told = load_scenario(SCENARIO, ["effects.air_drag.coefficient_std=0.3"])
    assert effects(told.effects) == ()


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("effects.air_drag.coefficient=-1", ["effects.air_drag.coefficient", "0 to 10"]),
        ("effects.air_drag.size=1", ["effects.air_drag.size", "coefficient"]),
        ("effects.airdrag.coefficient=1", ["effects.airdrag", "air_drag"]),
        ("effects.wind.x=fast", ["effects.wind.x", "number"]),
    ],
)
def test_bad_effects_are_named(setting: str, words: list[str]) -> None:
    with pytest.raises(UserError) as error:
        load_scenario(SCENARIO, [setting])
    for word in words:
        assert word in str(error.value)


def test_an_effect_of_a_users_own_is_a_key_like_the_others(tmp_path: Path) -> None:
    setting = "effects.hem_chain.mass=0.1"
    with registered():
        scenario = load_scenario(SCENARIO, [setting, "effects.wind.x=1"])
        assert effects(scenario.effects) == (Wind(x=1.0), HemChain(mass=0.1))
        copy = tmp_path / "own.yaml"
        copy.write_text(resolved_yaml(scenario))
        assert load_scenario(copy) == scenario
        for bad, words in (
            ("mass=2", "is 2.0, expected 0 to 1"),
            ("size=1", "mass, mass_std, height"),
        ):
            with pytest.raises(UserError, match=f"effects.hem_chain.*{words}"):
                load_scenario(SCENARIO, [f"effects.hem_chain.{bad}"])
    with pytest.raises(UserError, match=r"effects\.hem_chain: unknown effect \(load your own with"):
        load_scenario(SCENARIO, [setting])
    with pytest.raises(UserError, match=r"effects\.hem_chain: unknown effect"):
        effects(scenario.effects)


def test_effects_set_in_python_are_held_against_the_list() -> None:
    scenario = Scenario()
    scenario.effects["wind"] = {"x": 1.0, "x_std": 0.1}
    assert effects(scenario.effects) == (Wind(x=1.0),)
    scenario.effects["wind"] = {"speed": 1.0}
    with pytest.raises(UserError, match=r"effects\.wind\.speed: unknown key, expected x, y, z"):
        effects(scenario.effects)
    scenario.effects["wind"] = {"x": 100.0}
    with pytest.raises(ValueError, match=r"wind\.x is 100\.0 m/s, expected -5 to 5"):
        effects(scenario.effects)


def pulled(
    settings: Sequence[str], seconds: float = 0.5, command: Sequence[float] = (0.0, 0.0, 0.0)
) -> tuple[FloatArray, FloatArray]:
    """Returns gripper forces (2,3), N, and the garment (n,3), m, after hanging for a while."""
    scenario = load_scenario(SCENARIO, [*QUICK, *settings])
    mesh = build_garment(scenario.garment, scenario.plant.spacing, SCENARIO.parent)
    station = make_simulated_station(station_parameters(scenario, mesh))
    simulator = Simulator(station.diagram)
    context = simulator.get_mutable_context()
    for i, side in enumerate(("left", "right")):
        port = station.diagram.GetInputPort(f"{side}_gripper.position_command")
        port.FixValue(context, station.start_grippers[i] + np.array(command))
    simulator.AdvanceTo(seconds)
    forces = [
        station.diagram.GetOutputPort(f"{side}_gripper.force_measured").Eval(context)
        for side in ("left", "right")
    ]
    garment = station.diagram.GetOutputPort("cheat_garment_position").Eval(context)
    return np.stack(forces), garment.reshape(-1, 3)


def test_a_heavier_garment_weighs_on_the_station_s_grippers() -> None:
    plain, _ = pulled([])
    heavy, _ = pulled(["effects.surface_density.added=0.15"])
    assert heavy[:, 2].sum() / plain[:, 2].sum() == pytest.approx(1.5, rel=0.02)


def test_an_effect_of_a_users_own_weighs_on_them_too() -> None:
    plain, _ = pulled([])
    with registered():
        heavy, _ = pulled(["effects.hem_chain.mass=0.2"])
    assert plain[:, 2].sum() - heavy[:, 2].sum() == pytest.approx(0.2 * 9.81, rel=0.02)


def test_compliant_grippers_let_the_garment_down() -> None:
    _, before = pulled([])
    force, after = pulled(["effects.gripper_compliance.compliance=0.02"])
    drop = np.mean(before[:, 2] - after[:, 2])
    assert drop == pytest.approx(-0.02 * force[:, 2].mean(), rel=0.1)


def test_late_grippers_move_the_garment_later() -> None:
    ways = []
    for delay in (0.0, 0.2):
        setting = [] if delay == 0.0 else [f"effects.gripper_latency.delay={delay}"]
        _, start = pulled(setting, 0.0)
        _, after = pulled(setting, 0.25, (0.2, 0.0, 0.0))
        ways.append(float((after - start)[:, 0].max()))
    assert ways[1] < 0.3 * ways[0]
