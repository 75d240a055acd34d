"""The key `plant.fidelity`: one word for the resolution of the garment's simulation."""

from pathlib import Path

import pytest

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario, resolved_yaml
from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.diagrams.scenario.schema import Plant
from drake_dress.diagrams.setup import station_parameters
from drake_dress.errors import UserError


def scenario_file(folder: Path, text: str) -> Path:
    path = folder / "scenario.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", FIDELITIES)
def test_a_word_gives_every_value_that_is_not_given(tmp_path: Path, name: str) -> None:
    path = scenario_file(tmp_path, "plant: {tolerance: 0.003}")
    plant = load_scenario(path, [f"plant.fidelity={name}"]).plant
    given = {k: v for k, v in FIDELITIES[name].items() if k != "tolerance"}
    assert {k: getattr(plant, k) for k in given} == given
    assert plant.tolerance == 0.003
    # a logged scenario loads to the same values, even if the word's meaning changes later
    again = scenario_file(tmp_path, resolved_yaml(load_scenario(path, [f"plant.fidelity={name}"])))
    assert load_scenario(again).plant == plant


@pytest.mark.parametrize("text", ["seed: 0", "plant: {}", "plant: {fidelity: standard}"])
def test_standard_is_what_nothing_is_said_of(tmp_path: Path, text: str) -> None:
    plant = load_scenario(scenario_file(tmp_path, text)).plant
    assert plant == Plant()
    assert {k: getattr(plant, k) for k in FIDELITIES["standard"]} == FIDELITIES["standard"]


def test_another_word_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"plant\.fidelity.*fine or standard"):
        load_scenario(scenario_file(tmp_path, "plant: {fidelity: finest}"))


def test_all_words_reach_what_steps_the_garment(tmp_path: Path) -> None:
    path = scenario_file(tmp_path, "seed: 0")
    for name, values in FIDELITIES.items():
        scenario = load_scenario(path, [f"plant.fidelity={name}"])
        mesh = build_garment(scenario.garment, scenario.plant.spacing, tmp_path)
        p = station_parameters(scenario, mesh)
        numerics = {k: getattr(p, k) for k in values if k != "spacing"}
        assert numerics == {k: v for k, v in values.items() if k != "spacing"}
        lengths = mesh.rest_position[mesh.faces]
        assert abs(lengths[:, 0] - lengths[:, 1]).max() < 2.0 * values["spacing"]
        assert p.body_time_step == scenario.plant.body_time_step
