"""Reads scenarios.

The content of a file is checked against the schema's types and loaded by Drake. Then the values are
checked against their ranges and against each other.
"""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

from pydrake.common.yaml import yaml_load_typed

from drake_dress.diagrams.scenario.body import fill_in_body
from drake_dress.diagrams.scenario.checks import (
    check_behaviour,
    check_cameras,
    check_chair,
    check_coat,
    check_controller,
    check_costs,
    check_drawn_body,
    check_hardware,
    check_hold,
    check_joints,
    check_perception,
    check_safety,
)
from drake_dress.diagrams.scenario.fidelity import fill_in_fidelity
from drake_dress.diagrams.scenario.girths import replace_girths
from drake_dress.diagrams.scenario.schema import SCHEMAS, GlobalMpc, Measures, Scenario
from drake_dress.diagrams.scenario.text import resolved_yaml
from drake_dress.diagrams.scenario.typed import check_ranges, field_type, kind_of, typed
from drake_dress.errors import UserError
from drake_dress.plan_delay import kept_plan_delay
from drake_dress.plugins import load_installed_plugins
from drake_dress.text_file import read_text
from drake_dress.yaml_text import read_yaml, write_yaml

# Sections that a scenario of any version has if the program wrote it.
_WRITTEN = {"seed", "duration", "garment", "person", "plant", "controller", "station", "log"}
_DELAY, _MEASURED = "controller.global_mpc.delay", "measured"


def load_scenario(
    path: str | Path, overrides: Sequence[str] = (), seed: int | None = None
) -> Scenario:
    """Returns the scenario in `path`, with `KEY=VALUE` overrides and seed applied.

    Raises:
        UserError: the file, a key or a value is unusable.
    """
    load_installed_plugins()
    source = str(path)
    content = _read(Path(path))
    _check_one_garment(source, content)
    for item in overrides:
        key, separator, text = item.partition("=")
        if not separator or not key:
            raise UserError("--set", item, "expected KEY=VALUE, such as plant.spacing=0.015")
        _override(content, key, text)
    if seed is not None:
        content["seed"] = seed
    return _checked(source, content)


def checked_scenario(scenario: Scenario, source: str = "scenario") -> Scenario:
    """Returns a copy of a scenario that was made or changed in Python, after all checks.

    Args:
        scenario: scenario to check.
        source: name of the scenario in messages.

    Raises:
        UserError: a value is unusable.
    """
    # all values are written, so those that are the default count as not given
    return _checked(source, read_yaml(source, resolved_yaml(scenario)), vars(Measures()))


def _checked(
    source: str, content: dict[str, Any], defaults: dict[str, float | None] | None = None
) -> Scenario:
    """Returns the scenario that the content of a file describes."""
    _resolve_delay(source, content)
    fill_in_fidelity(content)
    content = typed(source, "", content, Scenario)
    replace_girths(source, content, defaults or {})
    _fill_in_by_name(content)
    try:
        scenario: Scenario = yaml_load_typed(schema=Scenario, data=write_yaml(content))
    except (RuntimeError, ValueError, TypeError) as error:
        raise UserError(source, "", f"cannot be read: {error}") from error
    check_ranges(source, "", scenario)
    check_drawn_body(source, scenario)
    fill_in_body(source, scenario.person, _given_measures(content))
    check_ranges(source, "person.measures", scenario.person.measures)
    _move_force_limit(source, content, scenario)
    check_safety(source, scenario.safety, 1.0 / scenario.controller.command_rate)
    check_controller(source, scenario.controller)
    check_costs(source, scenario.controller.costs)
    check_joints(source, scenario.person)
    check_chair(source, scenario.person)
    check_coat(source, scenario.garment.coat)
    check_hold(source, scenario.garment)
    check_behaviour(source, scenario.person)
    check_hardware(source, scenario.station)
    check_cameras(source, scenario)
    check_perception(source, scenario)
    return scenario


def _read(path: Path) -> dict[str, Any]:
    source = str(path)
    content = read_yaml(source, read_text(path, "a scenario in YAML"))
    if content is None:
        raise UserError(source, "", "is empty, expected a scenario in YAML")
    if not isinstance(content, dict):
        raise UserError(source, "", f"holds {kind_of(content)}, expected keys with values")
    return content


def _check_one_garment(source: str, content: dict[str, Any]) -> None:
    """Checks that a file gives a coat or a mesh, but not both.

    A scenario with all sections was written by the program, with the coat that the mesh replaced.
    """
    garment = content.get("garment")
    both = isinstance(garment, dict) and all(
        garment.get(name) is not None for name in ("coat", "mesh")
    )
    if not both or content.keys() >= _WRITTEN:
        return
    raise UserError(
        source,
        "garment.mesh",
        "is given beside garment.coat, expected one of them: the file would replace the coat "
        "(--set garment.mesh.file=FILE does so on purpose)",
    )


def _override(content: dict[str, Any], key: str, text: str) -> None:
    """Writes the YAML value `text` at the dotted `key`."""
    try:
        value = read_yaml("--set", text, one_value=True)
    except UserError as error:
        below = f"{error.key}: " if error.key else ""
        raise UserError("--set", key, f"{below}{error.message}") from error
    *parents, last = key.split(".")
    schema: Any = Scenario
    place = content
    for depth, name in enumerate(parents):
        schema = field_type("--set", ".".join(parents[:depth]), name, schema)
        if place.get(name) is None:
            place[name] = {}
        place = place[name]
        if not isinstance(place, dict):
            raise UserError("--set", key, f"{name} holds a value, expected keys below it")
    if key == _DELAY and value == _MEASURED:
        place[last] = value
        return
    hint = field_type("--set", ".".join(parents), last, schema)
    place[last] = typed("--set", key, value, hint)


def _resolve_delay(source: str, content: dict[str, Any]) -> None:
    """Replaces the word `measured` by the delay of plans on this machine.

    The logged scenario contains the number, so its run can be repeated on any machine.
    """
    place: Any = content
    for name in _DELAY.split(".")[:-1]:
        place = place.get(name) if isinstance(place, dict) else None
    if not isinstance(place, dict) or place.get("delay") != _MEASURED:
        return
    seconds = kept_plan_delay()
    if seconds is None:
        raise UserError(
            source,
            _DELAY,
            f"is {_MEASURED}, and nothing was measured on this machine; "
            "run drake-dress bench delay first, or write a number of s",
        )
    step = place.get("time_step", GlobalMpc.time_step)
    if not isinstance(step, int | float) or isinstance(step, bool) or not 0.0 < step < math.inf:
        return  # checks of types and ranges report it
    place["delay"] = round(step * max(1, math.ceil(seconds / step - 1e-9)), 9)


def _given_measures(content: dict[str, Any]) -> list[str]:
    """Returns the names of the person's measures that a scenario's content gives."""
    return list((content.get("person") or {}).get("measures") or {})


def _fill_in_by_name(content: dict[str, Any]) -> None:
    """Adds all parameters of the given effects and costs, in the order of their registration."""
    for key, schema_of in SCHEMAS.items():
        *parents, last = key.split(".")
        place: Any = content
        for parent in parents:
            place = place.get(parent) or {}
        given = place.get(last)
        if given is None:
            continue
        filled = {}
        for name, schema in get_type_hints(schema_of()).items():
            if given.get(name) is not None:
                filled[name] = dataclasses.asdict(get_args(schema)[0](**given[name]))
        place[last] = filled


def _move_force_limit(source: str, content: dict[str, Any], scenario: Scenario) -> None:
    """Moves the limit from its old key to the group `safety`."""
    mpc = scenario.controller.global_mpc
    if mpc.force_limit is None:
        return
    if "force_limit" in content.get("safety", {}):
        raise UserError(
            source,
            "controller.global_mpc.force_limit",
            f"is {mpc.force_limit} N beside safety.force_limit, "
            "expected the latter alone: this key is its old name",
        )
    scenario.safety.force_limit, mpc.force_limit = mpc.force_limit, None
