"""From a scenario to the whole diagram."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from pydrake.geometry import Meshcat

from drake_dress.diagrams.build import (
    controller_policy,
    described_person,
    hardware_parameters,
    local_setup,
    planned_arms,
    plant_station,
    predictor,
    rates,
    safety_limits,
    station_parameters,
)
from drake_dress.diagrams.dressing import ControlSetup, Dressing, make_dressing
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.hardware_station import (
    at_start,
    listen,
    make_hardware_station,
    open_bus,
)
from drake_dress.diagrams.own_parts import NOTHING, OwnParts, own_controller
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.station import Station, start_grippers
from drake_dress.errors import UserError
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.report.log_writer import RunLogWriter


@dataclass(frozen=True)
class Garments:
    """The plant's garment, and the controller's."""

    plant: GarmentMesh
    belief: GarmentMesh


@dataclass(frozen=True)
class Parts:
    """What the diagram of a scenario is made of, before it is wired."""

    scenario: Scenario
    garments: Garments
    station: Station
    policy: DressingPolicy
    limits: SafetyLimits
    page: Meshcat | None
    in_worker: bool = False
    own: OwnParts = NOTHING


def garments(scenario: Scenario, source: Path) -> tuple[Garments, SafetyLimits]:
    """Returns the scenario's garments, and the limits that its start is within.

    Args:
        scenario: with nothing left to draw.
        source: its file, for messages and paths relative to it.

    Raises:
        UserError: the garment cannot be used, or hangs outside the grippers' limits at first.
    """
    plant = build_garment(scenario.garment, scenario.plant.spacing, source.parent)
    belief = build_garment(scenario.garment, scenario.controller.spacing, source.parent)
    limits = safety_limits(scenario)
    broken = limits.broken_at(start_grippers(station_parameters(scenario, plant)))
    if broken is not None:
        raise UserError(str(source), "safety", f"{broken} at the start")
    return Garments(plant, belief), limits


def parts(
    scenario: Scenario,
    meshes: Garments,
    limits: SafetyLimits,
    page: Meshcat | None = None,
    in_worker: bool = False,
    own: OwnParts = NOTHING,
) -> Parts:
    """Returns the parts of a scenario's diagram.

    Args:
        scenario: with nothing left to draw.
        meshes: its garments.
        limits: within which it starts.
        page: where the run is shown, if it is.
        in_worker: whether the true garment is stepped, and the global controller solves, in
            processes of their own.
        own: parts of a user's own.
    """
    station = plant_station(scenario, meshes.plant, page, meshes.belief, in_worker)
    policy = controller_policy(scenario, meshes.belief, station.person, own.costs)
    return Parts(scenario, meshes, station, policy, limits, page, in_worker, own)


def hardware_parts(
    scenario: Scenario,
    meshes: Garments,
    limits: SafetyLimits,
    page: Meshcat | None = None,
    told: Callable[[str], None] = lambda _: None,
    stopped: Callable[[], bool] = lambda: False,
    own: OwnParts = NOTHING,
) -> Parts:
    """Returns the parts of a scenario's diagram whose station is behind messages.

    Args:
        scenario: with nothing left to draw.
        meshes: its garments; the controller's alone is used, and stands for both then.
        limits: within which it starts.
        page: where the run is shown, if it is.
        told: is called with each source that is heard.
        stopped: whether to give up waiting.
        own: parts of a user's own.

    Raises:
        ArmReachError: the arms do not reach where the run begins.
        StationSilentError: a source is silent.
        NotAtStartError: an arm is elsewhere.
        NoBusError: there is no such bus.
    """
    at = station_parameters(scenario, meshes.belief)
    person = described_person(at)
    planned = planned_arms(at, person)
    policy = controller_policy(scenario, meshes.belief, person, own.costs)
    p = hardware_parameters(scenario, meshes.belief)
    # subscriptions in Python end with their bus: a run has none
    heard = listen(p, open_bus(p.links.lcm_url), told, stopped)
    robots = at_start(p, planned, heard.joints)
    lcm = open_bus(p.links.lcm_url)
    station = make_hardware_station(p, lcm, person, robots, heard)
    believed = Garments(meshes.belief, meshes.belief)
    return Parts(scenario, believed, station, policy, limits, page, own=own)


def wired(
    p: Parts, writer: RunLogWriter | None = None, record: list[LocalProblem] | None = None
) -> Dressing:
    """Returns the diagram.

    Args:
        p: of which it is made; they serve one diagram.
        writer: open log, if one is kept.
        record: takes the local problems that are solved, if given.
    """
    local = None if p.own.controller is not None else local_setup(p.scenario, p.policy)
    if local is not None and record is not None:
        local = replace(local, record=record)
    control = ControlSetup(
        p.policy,
        rates(p.scenario),
        p.limits,
        p.own.predictor or predictor(p.scenario),
        local,
        p.in_worker,
        None if p.own.controller is None else own_controller(p.own.controller),
    )
    return make_dressing(p.station, p.garments.plant, control, writer, p.page)
