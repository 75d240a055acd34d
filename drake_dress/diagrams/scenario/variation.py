"""Draws the quantities that a scenario's seed varies: pose, coat, person, fabric and start.

Each group of keys has its own generator, so the widths of one group do not change another's draws.
An arm whose drawn pose would be inside the wheelchair is led outward until it is beside it.
"""

import copy
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from drake_dress.diagrams.scenario.body import fill_in_body
from drake_dress.diagrams.scenario.coat import COAT_MEASURES, coat_parameters, coat_scale
from drake_dress.diagrams.scenario.schema import (
    Body,
    Coat,
    Person,
    Scenario,
    SideMeasures,
    Variation,
)
from drake_dress.diagrams.sections.person import arms, chair, measures
from drake_dress.models.human.skin.drawing import draw_phenotype
from drake_dress.models.human.wheelchair import room_of_arms
from drake_dress.models.sides import SIDES

# Added to the seed for the generators of the later groups.
_COAT, _PERSON, _BODY = 1, 2, 3
_MASSES = ("upper_arm_mass", "forearm_mass")

# Least distance of a drawn arm from the wheelchair, m; degrees by which it is led outward at once,
# and to which at most.
_LEAST_ROOM, _LEAD, _MOST_ABDUCTED = 0.005, 0.5, 90.0

Draw = Callable[[float], float]


def apply_variation(scenario: Scenario) -> Scenario:
    """Returns the scenario with the values that its seed draws, and without variation."""
    drawn = copy.deepcopy(scenario)
    v, draw = scenario.variation, _uniform(scenario.seed)
    for arm in (drawn.person.left_arm, drawn.person.right_arm):
        arm.abduction_deg += draw(v.arm_angle_deg)
        arm.extension_deg += draw(v.arm_angle_deg)
        arm.elbow_deg = max(0.0, arm.elbow_deg + draw(v.arm_angle_deg))
    scale = 1.0 + draw(v.coat_scale)
    drawn.garment.coat.scale *= scale
    if drawn.garment.mesh is not None:
        drawn.garment.mesh.scale *= scale
    stiffness = 1.0 + draw(v.plant_stiffness)
    drawn.plant.material.stretch_stiffness *= stiffness
    drawn.plant.material.bending_stiffness *= stiffness
    drawn.plant.material.friction *= 1.0 + draw(v.plant_friction)
    drawn.station.start.distance_behind += draw(v.start_offset)
    drawn.station.start.height_offset += draw(v.start_offset)
    drawn.station.start.lateral_offset += draw(v.start_offset)
    if v.coat_measures > 0.0:
        _vary_coat(drawn.garment.coat, v.coat_measures, _uniform(scenario.seed, _COAT))
    if v.person_body:
        _draw_body(drawn.person, np.random.default_rng((scenario.seed, _BODY)))
    if v.person_scale > 0.0 or v.person_measures > 0.0:
        _vary_person(drawn.person, v, _uniform(scenario.seed, _PERSON))
    if scenario.variation != Variation():
        _lead_beside_chair(drawn.person)
    drawn.variation = Variation()
    return drawn


def _vary_coat(coat: Coat, width: float, draw: Draw) -> None:
    whole = coat_parameters(coat)
    for name in COAT_MEASURES:
        # each has its draw, so that no coat changes the draws of another's measures
        factor, value = 1.0 + draw(width), getattr(whole, name)
        if value is not None:
            # given measures are scaled when the coat is made
            setattr(coat, name, value / coat_scale(coat, name) * factor)


def _draw_body(person: Person, rng: np.random.Generator) -> None:
    """Replaces the person's body by that of a drawn adult."""
    drawn = draw_phenotype(rng)
    person.body = Body(str(drawn.sex), drawn.age, drawn.height, drawn.weight, drawn.muscle)
    fill_in_body("variation.person_body", person, given=())


def _vary_person(person: Person, v: Variation, draw: Draw) -> None:
    """Scales all sizes and masses; an arm that differs is scaled as both arms are."""
    scale = 1.0 + draw(v.person_scale)
    body = measures(person)
    masses = dict(zip(_MASSES, body.arm_masses, strict=True))
    for side, group in zip(SIDES, (person.left_measures, person.right_measures), strict=True):
        for name, mass in zip(_MASSES, body.of(side).arm_masses, strict=True):
            if mass != masses[name]:
                setattr(group, name, mass)
    for entry in fields(person.measures):
        value = getattr(person.measures, entry.name)
        # a body that is a tenth larger in all lengths weighs a third more
        whole = scale**3 if entry.name in _MASSES else scale
        if entry.name in _MASSES:
            value = masses[entry.name]
        groups = [g for g in (person.left_measures, person.right_measures) if _has(g, entry.name)]
        if value is None and not groups:
            continue
        own = 1.0 + draw(v.person_measures)
        if value is not None:
            setattr(person.measures, entry.name, value * whole * own)
        for group in groups:
            setattr(group, entry.name, getattr(group, entry.name) * whole * own)


def _lead_beside_chair(person: Person) -> None:
    """Abducts each arm by as much as it takes to be outside of the wheelchair, if there is one."""
    seat = chair(person)
    if seat is None:
        return
    body = measures(person)
    for side, pose in zip(SIDES, (person.left_arm, person.right_arm), strict=True):
        while (
            pose.abduction_deg < _MOST_ABDUCTED
            and room_of_arms(seat, body, arms(person))[side] < _LEAST_ROOM
        ):
            pose.abduction_deg += _LEAD


def _has(group: SideMeasures, name: str) -> bool:
    return getattr(group, name, None) is not None


def _uniform(*seed: int) -> Draw:
    rng = np.random.default_rng(seed)
    return lambda width: float(width * rng.uniform(-1.0, 1.0))
