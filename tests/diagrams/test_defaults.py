"""An empty scenario has the defaults of the models that it is converted to."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from drake_dress.diagrams.assemble import described_person
from drake_dress.diagrams.person import person_model
from drake_dress.diagrams.scenario import Scenario, schema
from drake_dress.diagrams.scenario.mirror import Mirror, mirror_of, model_of
from drake_dress.diagrams.sections.controller import controller_policy, local_setup, solve_budget
from drake_dress.diagrams.sections.hardware import hardware_parameters
from drake_dress.diagrams.sections.safety import safety_limits
from drake_dress.diagrams.setup import rates, station_parameters
from drake_dress.diagrams.station import StationParameters
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.task_parameters import TaskParameters
from drake_dress.models.garment.coat import CoatParameters, make_coat

# Fields whose defaults differ on purpose between library and scenario.
_MEANT = {
    # a scenario has a certain fabric; the library has no preset one
    "Material.damping",
    "Material.stretch_stiffness",
    # the scenario has a pose; in the library an arm hangs down
    "ArmPose.abduction",
    "ArmPose.extension",
    "ArmPose.elbow_flexion",
    # set by `scenario_of_everything`
    "Behaviour.kind",
    "Behaviour.motions",
    "Behaviour.tremor",
    "Turn.start",
    "Turn.angle",
    "Withdraw.start",
    "Wave.start",
    "StationParameters.placement",
}


def differing(value: Any, seen: set[int]) -> Iterator[tuple[str, Any, Any]]:
    """Yields fields below `value` that differ from their default: name, default, value."""
    if id(value) in seen or isinstance(value, str | bytes | np.ndarray):
        return
    seen.add(id(value))
    if isinstance(value, dict):
        value = tuple(value.values())
    if isinstance(value, tuple | list):
        for item in value:
            yield from differing(item, seen)
        return
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        return
    for entry in dataclasses.fields(value):
        own = getattr(value, entry.name, None)
        default = default_of(entry)
        if default is dataclasses.MISSING:
            yield from differing(own, seen)
        elif not same(own, default):
            if not dataclasses.is_dataclass(default):
                yield f"{type(value).__name__}.{entry.name}", default, own
            yield from differing(own, seen)


def default_of(entry: dataclasses.Field[Any]) -> Any:
    """Returns a field's default, MISSING if it has none."""
    if entry.default_factory is not dataclasses.MISSING:
        return entry.default_factory()
    return entry.default


def same(a: Any, b: Any) -> bool:
    """Returns whether two values are equal, numbers up to rounding."""
    if isinstance(a, float) and isinstance(b, float):
        return a == pytest.approx(b, rel=1e-12)
    return np.array_equal(np.asarray(a, object), np.asarray(b, object))


def scenario_of_everything() -> Scenario:
    """Returns a scenario of defaults with arms and an active person."""
    scenario = Scenario()
    scenario.station.arms.model = "panda"
    scenario.controller.method = "full"
    scenario.person.behaviour.kind = "active"
    scenario.person.behaviour.motions = [
        schema.Motion(reach=schema.Reach()),
        schema.Motion(turn=schema.Turn()),
        schema.Motion(withdraw=schema.Withdraw()),
        schema.Motion(wave=schema.Wave()),
    ]
    scenario.person.behaviour.tremor = schema.Tremor()
    return scenario


def policy_of(scenario: Scenario, station: StationParameters) -> DressingPolicy:
    """Returns the global controller's policy with the station's garment."""
    person = person_model(station.measures, station.posture, described_person(station))
    controller = scenario.controller
    budget = solve_budget(controller.global_mpc, in_real_time=False)
    return controller_policy(controller, station.mesh, person, budget)


def test_scenario_and_library_have_the_same_defaults() -> None:
    scenario = scenario_of_everything()
    mesh = make_coat(CoatParameters(), 0.06)
    station = station_parameters(scenario, mesh)
    policy = policy_of(scenario, station)
    local = local_setup(scenario.controller, policy)
    assert local is not None
    parts = [
        station,
        policy.parameters,
        local.controller.parameters,
        safety_limits(scenario.safety),
        hardware_parameters(scenario.station, station),
        rates(scenario),
    ]
    found = {name: (default, own) for name, default, own in differing(parts, set())}
    assert {name: pair for name, pair in found.items() if name not in _MEANT} == {}
    assert set(found) == _MEANT


def test_every_setting_of_the_tasks_reaches_the_policy() -> None:
    """A change of any number of `controller.tasks` or `controller.stages` changes the policy."""
    mesh = make_coat(CoatParameters(), 0.06)
    station = station_parameters(Scenario(), mesh)
    plain = policy_of(Scenario(), station).parameters.tasks
    for group in ("tasks", "stages"):
        for entry in dataclasses.fields(getattr(Scenario().controller, group)):
            scenario = Scenario()
            values = getattr(scenario.controller, group)
            old = getattr(values, entry.name)
            if not isinstance(old, int | float):
                continue
            setattr(values, entry.name, old + 1)
            moved = policy_of(scenario, station).parameters.tasks
            here: Any
            here, there = (plain, moved) if group == "tasks" else (plain.stages, moved.stages)
            assert getattr(there, entry.name) == getattr(here, entry.name) + 1, entry.name
            assert dataclasses.replace(here, **{entry.name: old + 1}) == there


def test_a_mirror_has_what_its_model_has_and_leads_back_to_it() -> None:
    @mirror_of(TaskParameters, without=("stages",))
    class Tasks(Mirror):
        """All tasks, with their approaches."""

    model = TaskParameters()
    # the decorator makes its fields from those of the model
    values: Any = Tasks()
    assert [a.tilt for a in values.approaches] == [a.tilt for a in model.approaches]
    assert model_of(values) == model
    values.approaches[2].tilt = 0.7
    values.flat = 0.6
    changed = model_of(values)
    assert changed.approaches[2].tilt == 0.7
    assert changed.flat == 0.6
    # each mirror has its own copy of the defaults
    assert Tasks().approaches[2].tilt == model.approaches[2].tilt
    with pytest.raises(TypeError, match="speed"):
        Tasks(speed=1.0)
