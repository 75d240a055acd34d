"""`person.body`: what a scenario's measures follow from."""

from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from drake_dress.diagrams.scenario import (
    Scenario,
    apply_variation,
    checked_scenario,
    load_scenario,
)
from drake_dress.diagrams.scenario.schema import Variation
from drake_dress.diagrams.scenario.text import resolved_yaml
from drake_dress.diagrams.sections.person import measures
from drake_dress.errors import UserError
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.skin.measures import MEASURED, body_measures, skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin
from drake_dress.models.human.skin.scan import NEEDED
from tests.present import present

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


DRAWN = "variation: {person_body: true}\n"


def drawn(folder: Path, seed: int, text: str = DRAWN) -> Scenario:
    path = folder / "drawn.yaml"
    path.write_text(text, encoding="utf-8")
    return apply_variation(load_scenario(path, seed=seed))


def test_seed_draws_the_body_and_all_its_measures(tmp_path: Path) -> None:
    first, again, other = (drawn(tmp_path, seed) for seed in (4, 4, 5))
    assert first == again
    assert first.variation == Variation()
    body = present(first.person.body)
    person = Phenotype(present(body.sex), *map(present, (body.age, body.height, body.weight)))
    expected = body_measures(skin_measures(phenotype_skin(person)))
    assert asdict(measures(first.person)) == pytest.approx(asdict(expected), abs=1e-5)
    one, two = (asdict(measures(s.person)) for s in (first, other))
    assert all(one[name] != two[name] for name in MEASURED)


def test_drawn_body_does_not_change_what_else_is_drawn(tmp_path: Path) -> None:
    others = "arm_angle_deg: 10, coat_measures: 0.03, person_measures: 0.02"
    both = drawn(tmp_path, 6, f"variation: {{person_body: true, {others}}}\n")
    alone = drawn(tmp_path, 6, f"variation: {{{others}}}\n")
    assert both.garment == alone.garment
    assert both.person.left_arm == alone.person.left_arm
    # each measure of the drawn body varies on its own
    body = drawn(tmp_path, 6)
    for name in ("upper_arm_length", "chest_width", "hand_radius"):
        factor = getattr(alone.person.measures, name) / getattr(BodyMeasures, name)
        plain = getattr(body.person.measures, name)
        assert getattr(both.person.measures, name) == pytest.approx(plain * factor)


def test_drawn_body_is_loaded_again_from_the_log_s_scenario(tmp_path: Path) -> None:
    once = drawn(tmp_path, 8)
    (tmp_path / "again.yaml").write_text(resolved_yaml(once), encoding="utf-8")
    again = load_scenario(tmp_path / "again.yaml")
    assert again == once
    assert apply_variation(again) == once
    # what is not drawn yet can be written and read, too
    plain = load_scenario(tmp_path / "drawn.yaml", seed=8)
    assert apply_variation(checked_scenario(plain)) == once


@pytest.mark.parametrize(
    ("person", "key"),
    [
        (f"person: {{body: {{{WORDS}}}}}", "person.body"),
        ("person: {measures: {hand_girth: 0.2}}", "person.measures.hand_radius"),
        ("person: {right_measures: {forearm_length: 0.3}}", "person.right_measures.forearm_length"),
        ("", "variation.person_scale"),
    ],
)
def test_sizes_beside_a_drawn_body_are_refused(tmp_path: Path, person: str, key: str) -> None:
    scale = ", person_scale: 0.05" if not person else ""
    text = f"variation: {{person_body: true{scale}}}\n{person}\n"
    with pytest.raises(UserError) as told:
        drawn(tmp_path, 0, text)
    assert told.value.key == key
    assert "beside variation.person_body" in str(told.value)


def test_neck_length_can_be_given_beside_a_drawn_body(tmp_path: Path) -> None:
    scenario = drawn(tmp_path, 0, f"{DRAWN}person: {{measures: {{neck_length: 0.1}}}}\n")
    assert scenario.person.measures.neck_length == 0.1
