"""`person.body`: what a scenario's measures follow from."""

from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.text import resolved_yaml
from drake_dress.diagrams.sections.person import measures
from drake_dress.errors import UserError
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin
from drake_dress.models.human.skin.scan import NEEDED

WORDS = "sex: female, age: 80, height: 1.58, weight: 55"


def scenario_with(path: Path, person: str) -> Path:
    path.write_text(f"person: {{{person}}}\n", encoding="utf-8")
    return path


def write_scan(folder: Path) -> str:
    """Writes a scan in cm; returns the key `scan` that names it."""
    skin = phenotype_skin(Phenotype("male", 40, 1.75, 80))
    trimesh.Trimesh(100.0 * skin.vertices, skin.faces, process=False).export(folder / "scan.ply")
    joints = {n: 100.0 * skin.joints[n.replace("_hand", "_knuckle_middle")] for n in NEEDED}
    listed = ", ".join(f"{n}: [{', '.join(f'{x:.3f}' for x in p)}]" for n, p in joints.items())
    return f"scan: {{file: scan.ply, unit: cm, joints: {{{listed}}}}}"


def test_measures_are_those_of_the_body(tmp_path: Path) -> None:
    scenario = load_scenario(scenario_with(tmp_path / "s.yaml", f"body: {{{WORDS}}}"))
    expected = body_measures(skin_measures(phenotype_skin(Phenotype("female", 80, 1.58, 55))))
    assert asdict(measures(scenario.person)) == pytest.approx(asdict(expected), abs=1e-5)


def test_given_measures_stay(tmp_path: Path) -> None:
    one = f"body: {{{WORDS}}}, measures: {{forearm_radius: 0.05, hip_width: 0.4}}"
    both = [
        measures(load_scenario(scenario_with(tmp_path / f"{i}.yaml", text)).person)
        for i, text in enumerate((one, f"body: {{{WORDS}}}"))
    ]
    changed = {
        e.name for e in fields(BodyMeasures) if getattr(both[0], e.name) != getattr(both[1], e.name)
    }
    assert changed == {"forearm_radius", "hip_width"}
    assert both[0].forearm_radius == 0.05


def test_without_a_body_measures_are_the_defaults(tmp_path: Path) -> None:
    scenario = load_scenario(scenario_with(tmp_path / "s.yaml", "posture: sitting"))
    assert measures(scenario.person) == BodyMeasures()
    assert scenario.person.body is None


def test_single_keys_can_be_set(tmp_path: Path) -> None:
    path = scenario_with(tmp_path / "s.yaml", f"body: {{{WORDS}}}")
    taller = load_scenario(path, ["person.body.height=1.70", "person.body.weight=64"])
    assert measures(taller.person).shoulder_height > 1.33


def test_scan_beside_the_scenario_gives_the_measures(tmp_path: Path) -> None:
    scenario = load_scenario(
        scenario_with(tmp_path / "s.yaml", f"body: {{{write_scan(tmp_path)}}}")
    )
    found = measures(scenario.person)
    expected = body_measures(skin_measures(phenotype_skin(Phenotype("male", 40, 1.75, 80))))
    for name in ("shoulder_height", "upper_arm_radius", "forearm_radius", "chest_width"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=0.025)


def test_resolved_scenario_loads_to_the_same_person_without_the_scan(tmp_path: Path) -> None:
    path = scenario_with(tmp_path / "s.yaml", f"body: {{{write_scan(tmp_path)}}}")
    scenario = load_scenario(path)
    (tmp_path / "scan.ply").unlink()
    again = tmp_path / "resolved.yaml"
    again.write_text(resolved_yaml(scenario), encoding="utf-8")
    assert load_scenario(again) == scenario
    assert "scan.ply" in yaml.safe_load(again.read_text())["person"]["body"]["scan"]["file"]


BAD = [
    ("body: {sex: female, age: 80, height: 1.58}", "person.body.weight: is missing, expected sex"),
    ("body: {}", "person.body.sex: is missing, expected sex, age, height, weight, or scan"),
    (f"body: {{{WORDS}, scan: {{file: a.ply}}}}", "person.body.sex: is given beside scan"),
    ("body: {scan: {unit: cm}}", "person.body.scan.file: is missing, expected a mesh file"),
    ("body: {scan: {file: absent.ply}}", "absent.ply: no such file"),
    (f"body: {{{WORDS}, sex: 0.5}}", "person.body.sex"),
    (f"body: {{{WORDS}, age: 300}}", "person.body.age: is 300.0, expected 4 to 100"),
    (f"body: {{{WORDS}, weight: 200}}", "person.body.weight: is 200 kg, expected 29"),
    (f"body: {{{WORDS}, height: 2.2}}", "person.body.weight: is 55 kg, expected"),
    (f"body: {{{WORDS}, tall: 2.2}}", "person.body.tall: unknown key"),
]


@pytest.mark.parametrize(("person", "message"), BAD)
def test_unusable_body_is_told_with_its_key(tmp_path: Path, person: str, message: str) -> None:
    # a later key replaces an earlier one of the same name
    words = yaml.safe_load(f"{{{person}}}")["body"]
    path = tmp_path / "s.yaml"
    path.write_text(yaml.safe_dump({"person": {"body": words}}), encoding="utf-8")
    with pytest.raises(UserError, match=message) as caught:
        load_scenario(path)
    assert "\n" not in str(caught.value)


def test_same_scenario_gives_the_same_measures(tmp_path: Path) -> None:
    path = scenario_with(tmp_path / "s.yaml", f"body: {{{WORDS}}}")
    first, second = (asdict(measures(load_scenario(path).person)) for _ in range(2))
    assert np.array_equal(list(first.values()), list(second.values()))
