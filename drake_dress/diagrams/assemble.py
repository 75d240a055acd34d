"""From a scenario to the whole diagram."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from pydrake.geometry import Meshcat

from drake_dress.diagrams.build import (
    controller_policy,
    effects,
    local_setup,
    plant_station,
    predictor,
    rates,
    safety_limits,
    station_parameters,
)
from drake_dress.diagrams.dressing import Dressing, make_dressing
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.station import Station, start_grippers
from drake_dress.errors import UserError
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.report.log import RunLogWriter


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
    scenario: Scenario, meshes: Garments, limits: SafetyLimits, page: Meshcat | None = None
) -> Parts:
    """Returns the parts of a scenario's diagram.

    Args:
        scenario: with nothing left to draw.
        meshes: its garments.
        limits: within which it starts.
        page: where the run is shown, if it is.
    """
    station = plant_station(scenario, meshes.plant, page)
    policy = controller_policy(scenario, meshes.belief, station.person)
    return Parts(scenario, meshes, station, policy, limits, page)


def wired(
    p: Parts, writer: RunLogWriter | None = None, record: list[LocalProblem] | None = None
) -> Dressing:
    """Returns the diagram.

    Args:
        p: of which it is made; they serve one diagram.
        writer: open log, if one is kept.
        record: takes the local problems that are solved, if given.
    """
    local = local_setup(p.scenario, p.policy)
    if local is not None and record is not None:
        local = replace(local, record=record)
    return make_dressing(
        p.station,
        p.garments.plant,
        p.policy,
        barycentric_transfer(p.garments.plant, p.garments.belief),
        rates(p.scenario),
        p.limits,
        writer,
        p.page,
        effects(p.scenario),
        predictor(p.scenario),
        local,
    )
