"""The table of scenario keys is complete and agrees with the loader."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.key_table import (
    Key,
    markdown_table,
    scenario_groups,
    scenario_keys,
)
from drake_dress.errors import UserError
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.skin.measures import MEASURED

KEYS = {key.name: key for key in scenario_keys()}
_SOME = {"upper_arm_mass": 1.6, "forearm_mass": 1.2, "waist_width": 0.3}
SIZES = {
    e.name: e.default or _SOME.get(e.name, 0.05 if e.name.endswith("radius") else 0.2)
    for e in dataclasses.fields(BodyMeasures)
}
# A scenario with each optional group, and one entry in each list.
# With all measures given, no scan is read.
EVERYTHING = f"""
garment:
  mesh: {{file: a.obj, loops: {{left_cuff: [1, 2, 3]}}, grasp: {{left: [4]}}, leave_out: [Button]}}
person:
  posture: sitting
  chair: {{}}
  body: {{scan: {{file: a.ply, joints: {{left_hand: [0, 0.3, 0.8]}}}}}}
  measures: {{{", ".join(f"{name}: {SIZES[name]}" for name in MEASURED)}}}
  behaviour:
    kind: active
    motions: [{{reach: {{}}}}, {{turn: {{}}}}, {{withdraw: {{}}}}, {{wave: {{amplitude: 0.01}}}}]
    tremor: {{}}
    spasm: {{}}
safety: {{workspace: {{low: [-2, -2, 0], high: [2, 2, 3]}}}}
station: {{cameras: [{{name: front, position: [2, 0, 1], target: [0, 0, 1]}}]}}
lab: {{faults: [{{}}]}}
effects: {{{", ".join(f"{name}: {{}}" for name in EFFECTS)}}}
"""


@pytest.fixture
def everything(tmp_path: Path) -> Path:
    path = tmp_path / "scenario.yaml"
    path.write_text(EVERYTHING, encoding="utf-8")
    return path


def leaves(value: Any, name: str = "") -> Iterator[str]:
    """Yields the dotted keys of all values of a loaded scenario."""
    named = name.endswith(
        (".loops", ".grasp", ".scan.joints", "controller.costs")
    )  # the user chooses their keys
    if isinstance(value, dict) and not named:
        for key, item in value.items():
            yield from leaves(item, f"{name}.{key}" if name else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            yield from leaves(item, f"{name}[]")
    elif name not in ("effects", "person.behaviour.motions", "lab.faults"):
        yield name


def test_every_key_that_a_scenario_holds_is_in_the_table(everything: Path) -> None:
    held = set(leaves(dataclasses.asdict(load_scenario(everything))))
    # each entry of the list has the other three motions as empty keys
    motions = {f"person.behaviour.motions[].{m}" for m in ("reach", "turn", "withdraw", "wave")}
    assert held - motions == set(KEYS)


def test_every_key_has_a_meaning_of_its_own_words() -> None:
    for key in KEYS.values():
        assert re.match(r"\S.*[.)]$", key.meaning), key
        assert len(key.meaning.split()) >= 2, key
        assert key.meaning.count("`") % 2 == 0, key


def test_every_group_is_described_once() -> None:
    groups = scenario_groups()
    assert all(group.meaning for group in groups)
    assert len({group.name for group in groups}) == len(groups)


def test_what_the_table_allows_is_what_the_loader_takes(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text("seed: 0", encoding="utf-8")
    told = [key for key in KEYS.values() if key.allowed and settable(key)]
    assert len(told) > 300
    for key in told:
        with pytest.raises(UserError, match=re.escape(f"{key.name}: ")):
            load_scenario(path, [f"{key.name}={outside(key)}"])


def settable(key: Key) -> bool:
    """Returns whether `--set` reaches a single value of the key."""
    return "[]" not in key.name and not key.type.startswith("list")


def outside(key: Key) -> str:
    """Returns a value that the table does not allow."""
    if key.type.startswith("text"):
        return "no_such_word"
    low, high = map(float, key.allowed.split(" to "))
    assert low < high
    return str(int(2 * high) if key.type.startswith("whole") else 2.0 * high)


def test_defaults_are_those_of_an_empty_scenario(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text("seed: 0", encoding="utf-8")
    scenario = load_scenario(path)
    assert float(KEYS["plant.spacing"].default) == scenario.plant.spacing
    assert KEYS["controller.method"].default == scenario.controller.method
    assert KEYS["safety.soft_force_limit"].default == ""
    assert KEYS["plant.self_collision"].default == "true"
    assert float(KEYS["controller.tasks.flat"].default) == scenario.controller.tasks.flat


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("safety.yield_rate", "m/s/N"),
        ("person.joints.elbow_damping", "N·m·s/rad"),
        ("controller.stages.prepared_distance", "m"),
        ("effects.gripper_slip.rate", "m/(N·s)"),
        ("effects.gripper_slip.rate_std", "m/(N·s)"),
        ("effects.friction.added", ""),
        ("plant.material.friction", ""),
        ("controller.global_mpc.weights.safety", "1/N²"),
    ],
)
def test_units_are_told_apart_from_words(name: str, unit: str) -> None:
    assert KEYS[name].unit == unit
    assert not unit or f", {unit}" not in KEYS[name].meaning


def test_the_table_is_markdown_with_a_row_for_each_key() -> None:
    rows = [line for line in markdown_table().splitlines() if line.startswith("| `")]
    assert len(rows) == len(KEYS)
    # six cells, whatever the texts contain
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {7}
