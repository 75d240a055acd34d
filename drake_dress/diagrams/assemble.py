"""Assembles the whole diagram from a scenario's setup."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from pydrake.geometry import Meshcat
from pydrake.multibody.plant import MultibodyPlant

from drake_dress.diagrams.arms import ArmSetup
from drake_dress.diagrams.confirmation import Confirmation
from drake_dress.diagrams.dressing import Dressing, make_dressing
from drake_dress.diagrams.eyes import with_tracker
from drake_dress.diagrams.hardware_station import (
    at_start,
    listen,
    make_hardware_station,
    open_bus,
)
from drake_dress.diagrams.own_parts import NOTHING, OwnParts, own_controller
from drake_dress.diagrams.person import Person, add_person
from drake_dress.diagrams.planning import ControlSetup
from drake_dress.diagrams.prediction import Predictor
from drake_dress.diagrams.sections.controller import local_setup
from drake_dress.diagrams.sections.hardware import hardware_parameters
from drake_dress.diagrams.setup import Garments, Setup
from drake_dress.diagrams.station import (
    Sight,
    SimulatedStation,
    Station,
    StationParameters,
    make_simulated_station,
    robots_at_start,
)
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.release_gate import confirmed_at_once


@dataclass(frozen=True)
class Parts:
    """The parts of a scenario's diagram, before they are wired.

    Attributes:
        setup: the scenario's values.
        station: simulated or hardware.
        policy: of the global controller.
        page: Meshcat page that shows the run, if any.
        in_worker: whether garment and global controller run in worker processes.
        own: the user's own parts.
    """

    setup: Setup
    station: Station
    policy: DressingPolicy
    page: Meshcat | None = None
    in_worker: bool = False
    own: OwnParts = NOTHING

    @property
    def garments(self) -> Garments:
        """The garments of plant and controller."""
        return self.setup.garments


def simulated_station(
    setup: Setup, page: Meshcat | None = None, in_worker: bool = False
) -> SimulatedStation:
    """Returns the simulated station, with estimates of the controller's garment.

    Args:
        setup: the scenario's values.
        page: Meshcat page that shows the run, if any.
        in_worker: whether the garment is stepped in a worker process.
    """
    transfer = barycentric_transfer(setup.garments.plant, setup.garments.belief)
    sight = Sight(transfer, setup.rates.command_period)
    return make_simulated_station(replace(setup.station, in_worker=in_worker), page, sight)


def parts(
    setup: Setup, page: Meshcat | None = None, in_worker: bool = False, own: OwnParts = NOTHING
) -> Parts:
    """Returns the parts of a simulated scenario's diagram.

    Args:
        setup: the scenario's values.
        page: Meshcat page that shows the run, if any.
        in_worker: whether the garment is stepped, and the global controller solves, in worker
            processes.
        own: the user's own parts.

    Raises:
        ArmReachError: the arms cannot reach the start of the run, or later goals of a dressing.
    """
    station = simulated_station(setup, page, in_worker)
    policy = setup.policy(station.person, own.costs)
    if setup.garments.tracked is not None:
        station = with_tracker(station, setup, policy)
    return Parts(setup, station, policy, page, in_worker, own)


def hardware_parts(
    setup: Setup,
    page: Meshcat | None = None,
    told: Callable[[str], None] = lambda _: None,
    stopped: Callable[[], bool] = lambda: False,
    own: OwnParts = NOTHING,
) -> Parts:
    """Returns the parts of a diagram whose station is hardware behind LCM messages.

    The true garment is unknown, so the controller's garment replaces it.

    Args:
        setup: the scenario's values.
        page: Meshcat page that shows the run, if any.
        told: called with the name of each source when its first sound message arrives.
        stopped: returns whether to give up waiting.
        own: the user's own parts.

    Raises:
        ArmReachError: the arms cannot reach the start of the run, or later goals of a dressing.
        StationSilentError: a source sent no sound message in time.
        NotAtStartError: an arm is not at its start.
        NoBusError: the bus cannot be opened.
    """
    setup = setup.as_estimated()
    person = described_person(setup.station)
    planned = planned_arms(setup.station, person)
    policy = setup.policy(person, own.costs)
    p = hardware_parameters(setup.scenario.station, setup.station)
    # Subscriptions from Python live as long as their bus, so the run opens a new one without any.
    heard = listen(p, open_bus(p.links.lcm_url), told, stopped)
    robots = at_start(p, planned, heard.joints)
    asks = setup.scenario.station.hardware.release == "confirm"
    confirm = Confirmation(page=page) if asks else confirmed_at_once
    station = make_hardware_station(p, open_bus(p.links.lcm_url), person, robots, heard, confirm)
    return Parts(setup, station, policy, page, own=own)


def described_person(p: StationParameters) -> Person:
    """Returns the scenario's person, in a plant of its own that is never simulated."""
    plant = MultibodyPlant(p.body_time_step)
    return add_person(plant, p.measures, p.posture, p.arms, p.joints, turns=False, chair=p.chair)


def planned_arms(p: StationParameters, person: Person) -> ArmSetup:
    """Returns both arms at the start of a run.

    Raises:
        ArmReachError: they cannot reach it, or later goals of a dressing.
        ValueError: the grippers float.
    """
    if p.placement is None:
        raise ValueError("grippers float, expected arms")
    return robots_at_start(p, p.placement, p.measures, person)


def person_predictor(p: Parts) -> Predictor:
    """Returns the predictor of the person: the user's own, or the scenario's."""
    return p.own.predictor or p.setup.predictor


def control_setup(p: Parts, record: list[LocalProblem] | None = None) -> ControlSetup:
    """Returns the controllers of a scenario.

    Args:
        p: its parts.
        record: list to which the local controller appends the problems that it solves.
    """
    controller, own = p.setup.scenario.controller, p.own
    local = None if own.controller is not None else local_setup(controller, p.policy)
    if local is not None and record is not None:
        local = replace(local, record=record)
    return ControlSetup(
        p.policy,
        p.setup.rates,
        p.setup.limits,
        person_predictor(p),
        local,
        p.in_worker,
        None if own.controller is None else own_controller(own.controller),
    )


def wired(
    p: Parts, writer: RunLogWriter | None = None, record: list[LocalProblem] | None = None
) -> Dressing:
    """Returns the diagram.

    Args:
        p: its parts, which can be used in one diagram only.
        writer: open log, if one is kept.
        record: list to which the local controller appends the problems that it solves.
    """
    control = control_setup(p, record)
    skin = None if p.page is None else p.setup.station.skin(drawn_in=False)
    return make_dressing(p.station, p.setup.garments.plant, control, writer, p.page, skin)
