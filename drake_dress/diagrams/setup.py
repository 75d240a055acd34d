"""A scenario's sections, converted once to the values that the diagram's builders take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from drake_dress.diagrams.cameras import CameraFaults
from drake_dress.diagrams.garment import build_garment, check_opening
from drake_dress.diagrams.integrator import check_integrator
from drake_dress.diagrams.person import Person, person_arms, person_model
from drake_dress.diagrams.planning import Rates
from drake_dress.diagrams.prediction import Predictor
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.diagrams.sections.controller import controller_policy, predictor, solve_budget
from drake_dress.diagrams.sections.effects import effects
from drake_dress.diagrams.sections.person import (
    arms,
    behaviour,
    chair,
    joints,
    measures,
    phenotype,
    posture,
)
from drake_dress.diagrams.sections.safety import safety_limits
from drake_dress.diagrams.sections.station import cameras, placement
from drake_dress.diagrams.station import StationParameters, start_grippers
from drake_dress.errors import UserError
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.costs import GarmentCost
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.wheelchair import room_of_arms
from drake_dress.models.perception.vision import opencv


@dataclass(frozen=True)
class Garments:
    """The garment of the plant, the coarser one of the controller, and the tracked one, if any."""

    plant: GarmentMesh
    belief: GarmentMesh
    tracked: GarmentMesh | None = None


@dataclass(frozen=True)
class Setup:
    """The values of a scenario with nothing left to draw.

    Attributes:
        scenario: from which the values were read.
        source: its file, for messages and relative paths.
        garments: of plant and controller.
        station: parameters of the simulated station.
        limits: of the safety governor.
        rates: periods and delays.
        predictor: of the person.
    """

    scenario: Scenario
    source: Path
    garments: Garments
    station: StationParameters
    limits: SafetyLimits
    rates: Rates
    predictor: Predictor

    def as_estimated(self) -> Setup:
        """Returns the setup for an unknown true garment, which the controller's replaces."""
        belief = self.garments.belief
        station = replace(self.station, mesh=belief)
        return replace(self, garments=replace(self.garments, plant=belief), station=station)

    def policy(self, person: Person, costs: Sequence[GarmentCost] = ()) -> DressingPolicy:
        """Returns the policy of the global controller.

        Args:
            person: as added to a plant.
            costs: the user's own, in addition to those that the scenario lists.
        """
        controller, s = self.scenario.controller, self.station
        arms = person_arms(s.measures, s.posture, s.arms, s.joints)
        in_real_time = self.scenario.station.kind == "hardware"
        return controller_policy(
            controller,
            self.garments.belief,
            person_model(s.measures, s.posture, person, arms),
            solve_budget(controller.global_mpc, in_real_time),
            costs,
            self.station.in_front,
        )


def read_setup(scenario: Scenario, source: Path) -> Setup:
    """Returns the setup of a scenario.

    Args:
        scenario: with nothing left to draw.
        source: its file, for messages and relative paths.

    Raises:
        UserError: the garment cannot be used, or hangs outside the grippers' limits at the start;
            the wheelchair does not fit the person, or an arm at rest is inside it;
            the plant's integrator is missing or has no such effects; or the predictor's weights
            cannot be used.
    """
    foreseen = predictor(scenario.controller, source.parent)
    plant = build_garment(scenario.garment, scenario.plant.spacing, source.parent)
    belief = build_garment(scenario.garment, scenario.controller.spacing, source.parent)
    check_opening(plant, scenario.station.side, str(source))
    station = station_parameters(scenario, plant)
    _check_chair(str(source), station)
    check_integrator(str(source), station.integrator, station.effects)
    limits = safety_limits(scenario.safety)
    broken = limits.broken_at(start_grippers(station))
    if broken is not None:
        raise UserError(str(source), "safety", f"{broken} at the start")
    tracked = None
    if scenario.perception.kind == "cameras":
        tracked = build_garment(scenario.garment, scenario.perception.spacing, source.parent)
    garments = Garments(plant, belief, tracked)
    return Setup(scenario, source, garments, station, limits, rates(scenario), foreseen)


def _check_chair(source: str, p: StationParameters) -> None:
    """Checks that the person fits into the wheelchair, if there is one.

    Raises:
        UserError: the chair does not fit, or an arm at rest is inside it.
    """
    if p.chair is None:
        return
    try:
        room = room_of_arms(p.chair, p.measures, p.arms)
    except UserError as error:
        raise UserError(source, f"{error.source}.{error.key}", error.message) from error
    for side, gap in room.items():
        if gap < 0.0:
            raise UserError(
                source,
                f"person.{side}_arm",
                f"is {-1e3 * gap:.0f} mm inside the wheelchair, expected a pose outside of it "
                "(abduction_deg leads the arm past armrest and push handle)",
            )


def station_parameters(scenario: Scenario, mesh: GarmentMesh) -> StationParameters:
    """Returns the parameters of the simulated station with the garment `mesh`."""
    plant, person, station = scenario.plant, scenario.person, scenario.station
    return StationParameters(
        mesh=mesh,
        material=Material(**vars(plant.material)),
        time_step=plant.time_step,
        body_time_step=plant.body_time_step,
        integrator=plant.integrator,
        implicitness=plant.implicitness,
        buckling_wavelength=plant.buckling_wavelength,
        iterations=plant.iterations,
        tolerance=plant.tolerance,
        self_collision=plant.self_collision,
        grasp_stiffness=plant.grasp_stiffness,
        effects=effects(scenario.effects),
        measures=measures(person),
        posture=posture(person),
        arms=arms(person),
        joints=joints(person),
        chair=chair(person),
        behaviour=behaviour(person.behaviour, scenario.seed),
        gripper_max_speed=station.gripper.max_speed,
        gripper_max_acceleration=station.gripper.max_acceleration,
        in_front=station.side == "front",
        distance_behind=station.start.distance_behind,
        height_offset=station.start.height_offset,
        lateral_offset=station.start.lateral_offset,
        placement=placement(station.arms, person, station.side),
        mode=station.arms.mode,
        cameras=cameras(station.cameras),
        camera_faults=camera_faults(scenario),
        phenotype=phenotype(person),
    )


def camera_faults(scenario: Scenario) -> CameraFaults | None:
    """Returns what is wrong with camera images; None where no controller sees with them."""
    if scenario.perception.kind != "cameras":
        return None
    opencv()  # told now where it is missing, and not in the middle of a run
    errors = model_of(scenario.station.camera_errors)
    return CameraFaults(errors, scenario.seed, effects(scenario.effects))


def rates(scenario: Scenario) -> Rates:
    """Returns periods and delays of controllers, log and plant."""
    c = scenario.controller
    return Rates(
        global_period=c.global_mpc.period,
        global_delay=c.global_mpc.delay,
        command_period=1.0 / c.command_rate,
        log_period=1.0 / scenario.log.rate,
        arm_period=1.0 / scenario.station.arms.rate,
        plant_period=scenario.plant.body_time_step,
    )
