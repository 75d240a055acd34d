"""Checks the values of a scenario against each other."""

import dataclasses
import math
import re

from drake_dress.diagrams.scenario.ranges import SOURCES
from drake_dress.diagrams.scenario.schema import (
    Coat,
    Controller,
    Garment,
    Insertion,
    Measures,
    Motion,
    Person,
    Safety,
    Scenario,
    Station,
)
from drake_dress.diagrams.sections.person import joints, spasm
from drake_dress.errors import UserError
from drake_dress.models.control.insertion_search import InsertionParameters
from drake_dress.models.control.own_costs import registered_costs
from drake_dress.models.control.task_parameters import LEAST_APPROACHES
from drake_dress.models.garment.coat import body_of_size
from drake_dress.models.human import motions
from drake_dress.models.human.arm import JOINT_NAMES
from drake_dress.models.human.skin.measures import MEASURED
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.injection import sources_of


def check_controller(source: str, controller: Controller) -> None:
    """Checks periods, delays and steps of the controllers against each other."""
    mpc = controller.global_mpc
    for name, part in (("global_mpc", mpc), ("local", controller.local)):
        if part.delay >= part.period:
            raise UserError(
                source,
                f"controller.{name}.delay",
                f"is {part.delay} s, expected less than the period, {part.period} s",
            )
    for name, least in LEAST_APPROACHES.items():
        count = len(getattr(controller.tasks, name))
        if count < least:
            raise UserError(
                source, f"controller.tasks.{name}", f"has {count} entries, expected {least} or more"
            )
    steps = mpc.delay / mpc.time_step
    if abs(steps - round(steps)) > 1e-6 or round(steps) >= mpc.horizon:
        raise UserError(
            source,
            "controller.global_mpc.delay",
            f"is {mpc.delay} s, expected a multiple of time_step, {mpc.time_step} s, "
            "within the horizon",
        )
    _check_insertion(source, controller.insertion)


def _check_insertion(source: str, insertion: Insertion) -> None:
    """Checks the lengths of the places and ranges of the search for an insertion."""
    plain = InsertionParameters()
    for entry in dataclasses.fields(InsertionParameters):
        value, wanted = getattr(insertion, entry.name), getattr(plain, entry.name)
        if not isinstance(wanted, tuple):
            continue
        words = "front, inward, up in m" if len(wanted) == 3 else "a smallest and a largest value"
        if len(value) != len(wanted) or (len(wanted) == 2 and value[0] > value[1]):
            raise UserError(
                source, f"controller.insertion.{entry.name}", f"is {value}, expected {words}"
            )


def check_safety(source: str, safety: Safety, command_period: float) -> None:
    """Checks the safety limits against each other."""
    soft, least = safety.soft_force_limit, safety.least_distance
    if soft is not None and soft >= safety.force_limit:
        raise UserError(
            source,
            "safety.soft_force_limit",
            f"is {soft} N, expected less than force_limit, {safety.force_limit} N",
        )
    if safety.max_braking < safety.max_acceleration:
        raise UserError(
            source,
            "safety.max_braking",
            f"is {safety.max_braking} m/s², expected max_acceleration, "
            f"{safety.max_acceleration} m/s², at least",
        )
    if safety.largest_distance is not None and safety.largest_distance <= least:
        raise UserError(
            source,
            "safety.largest_distance",
            f"is {safety.largest_distance} m, expected more than least_distance, {least} m",
        )
    if safety.stale_time < command_period:
        raise UserError(
            source,
            "safety.stale_time",
            f"is {safety.stale_time} s, expected a period of the commands, "
            f"{command_period:g} s, at least",
        )
    if safety.workspace is not None:
        corners = {"low": safety.workspace.low, "high": safety.workspace.high}
        for name, corner in corners.items():
            if len(corner) != 3 or not all(math.isfinite(x) for x in corner):
                raise UserError(
                    source, f"safety.workspace.{name}", f"is {corner}, expected x, y, z in m"
                )
        if not all(low < high for low, high in zip(*corners.values(), strict=True)):
            raise UserError(
                source,
                "safety.workspace.high",
                f"is {corners['high']}, expected more than low, {corners['low']}, on each axis",
            )


def check_hardware(source: str, station: Station) -> None:
    """Checks the requirements of hardware: arms and a bus."""
    if station.kind == "hardware" and station.arms.model != "panda":
        raise UserError(
            source,
            "station.arms.model",
            f"is {station.arms.model}, expected panda with station.kind: hardware",
        )
    url = station.hardware.lcm_url
    if not url.startswith(("udpm://", "memq://")):
        raise UserError(
            source,
            "station.hardware.lcm_url",
            f"is {url!r}, expected udpm://ADDRESS:PORT?ttl=0",
        )


def check_cameras(source: str, scenario: Scenario) -> None:
    """Checks the cameras, and the sources that faults name."""
    names: set[str] = set()
    for i, camera in enumerate(scenario.station.cameras):
        key = f"station.cameras[{i}]"
        if not re.fullmatch(r"[a-z][a-z0-9_]*", camera.name) or camera.name in names:
            raise UserError(
                source,
                f"{key}.name",
                f"is {camera.name!r}, expected a name of its own, such as front",
            )
        names.add(camera.name)
        for name in ("position", "target"):
            point = getattr(camera, name)
            if len(point) != 3 or not all(math.isfinite(x) for x in point):
                raise UserError(source, f"{key}.{name}", f"is {point}, expected x, y, z in m")
        ahead = [t - p for t, p in zip(camera.target, camera.position, strict=True)]
        if math.hypot(ahead[0], ahead[1]) < 1e-3:
            raise UserError(
                source, f"{key}.target", "is straight above or below, expected it to the side"
            )
    sources = [*SOURCES, *(f"camera_{name}" for name in sorted(names))]
    for i, fault in enumerate(scenario.lab.faults):
        if fault.source not in sources:
            raise UserError(
                source,
                f"lab.faults[{i}].source",
                f"is {fault.source!r}, expected {' or '.join(sources)}",
            )
        own = sources_of(fault.kind)
        if own and fault.source not in own:
            raise UserError(
                source,
                f"lab.faults[{i}].source",
                f"is {fault.source!r}, expected {' or '.join(own)} with kind {fault.kind}",
            )


def check_perception(source: str, scenario: Scenario) -> None:
    """Checks that there are cameras to see with, and that estimates are ready in time."""
    p = scenario.perception
    if p.kind == "cameras" and not scenario.station.cameras:
        raise UserError(source, "station.cameras", "is empty, expected cameras to see with")
    if p.kind == "cameras" and scenario.station.kind == "hardware":
        raise UserError(
            source,
            "perception.kind",
            "is cameras, expected oracle with station.kind: hardware, where the garment's estimate "
            "comes as messages",
        )
    steps = round(p.period / p.filter.time_step)
    if steps < 1 or abs(steps * p.filter.time_step - p.period) > 1e-6:
        raise UserError(
            source,
            "perception.period",
            f"is {p.period:g}, expected a multiple of the filter's time_step, "
            f"{p.filter.time_step:g}",
        )
    if p.delay >= p.period:
        raise UserError(
            source,
            "perception.delay",
            f"is {p.delay:g}, expected less than the period, {p.period:g}",
        )


def check_joints(source: str, person: Person) -> None:
    """Checks that the limits of each joint are a smaller and a larger angle."""
    for group in ("joints", "left_joints", "right_joints"):
        for name in JOINT_NAMES:
            limits = getattr(getattr(person, group), f"{name}_limits_deg")
            if limits is not None and not (len(limits) == 2 and limits[0] < limits[1]):
                raise UserError(
                    source,
                    f"person.{group}.{name}_limits_deg",
                    f"is {limits}, expected the smallest and the largest angle in degrees",
                )


def check_chair(source: str, person: Person) -> None:
    """Checks that who has a wheelchair sits in it."""
    if person.chair is not None and person.posture != "sitting":
        raise UserError(
            source,
            "person.chair",
            f"is given to a {person.posture} person, expected person.posture: sitting",
        )


def check_coat(source: str, coat: Coat) -> None:
    """Checks that the coat's size is in its table."""
    if coat.size is not None:
        try:
            body_of_size(coat.size_table, coat.size)
        except UserError as error:
            raise UserError(source, f"garment.coat.{error.key}", error.message) from error


def check_hold(source: str, garment: Garment) -> None:
    """Checks that nothing else says where a garment that is held at its edges is held."""
    if garment.hold == "shoulders":
        return
    given = None
    if garment.mesh is not None and garment.mesh.grasp:
        given = "mesh.grasp"
    elif garment.mesh is None and garment.coat.grasp != Coat.grasp:
        given = "coat.grasp"
    if given is not None:
        raise UserError(
            source,
            "garment.hold",
            f"is {garment.hold}, but garment.{given} also says where the garment is held; "
            "expected one of them",
        )


def check_drawn_body(source: str, scenario: Scenario) -> None:
    """Checks that nothing else gives the sizes of a person whose body is drawn.

    Loading sets all measures, so only those that differ from the default person's are given ones.
    """
    if not scenario.variation.person_body:
        return
    person, default = scenario.person, Measures()
    measures, sides = person.measures, ("left_measures", "right_measures")
    given = [f"measures.{n}" for n in MEASURED if getattr(measures, n) != getattr(default, n)]
    given += [
        f"{side}.{name}"
        for side in sides
        for name, value in vars(getattr(person, side)).items()
        if value is not None
    ]
    keys = ["person.body"] if person.body is not None else [f"person.{name}" for name in given]
    if scenario.variation.person_scale > 0.0:
        keys.append("variation.person_scale")
    if keys:
        raise UserError(
            source,
            keys[0],
            "is given beside variation.person_body, which draws the person's sizes; "
            "expected one of them",
        )


def check_behaviour(source: str, person: Person) -> None:
    """Checks the motions against each other, the kind of person and what the arms can do."""
    behaviour = person.behaviour
    key = "person.behaviour.motions"
    if behaviour.motions and behaviour.kind != "active":
        raise UserError(
            source, key, f"are given to a {behaviour.kind} person, expected kind: active"
        )
    if behaviour.spasm is not None:
        try:
            spasm(behaviour.spasm)
        except UserError as error:
            raise UserError(source, f"person.behaviour.spasm.{error.key}", error.message) from error
    names = [entry.name for entry in dataclasses.fields(Motion)]
    reaching: set[str] = set()
    for i, motion in enumerate(behaviour.motions):
        given = [name for name in names if getattr(motion, name) is not None]
        if len(given) != 1:
            came = " and ".join(given) or "nothing"
            raise UserError(
                source, f"{key}[{i}]", f"is {came}, expected just one of {', '.join(names)}"
            )
        _check_speed(source, f"{key}[{i}]", motion, behaviour.max_hand_speed)
        _check_tone(source, f"{key}[{i}].{given[0]}", getattr(motion, given[0]), person)
        if motion.reach is not None:
            side = motion.reach.side
            sides = {"left", "right"} if side == "both" else {side}
            if sides & reaching:
                raise UserError(
                    source,
                    f"{key}[{i}].reach.side",
                    f"is {side}, expected one reach for each hand",
                )
            reaching |= sides


def _check_tone(source: str, key: str, motion: object, person: Person) -> None:
    """Checks that no arm without muscle tone is to move by itself."""
    moved = getattr(motion, "side", None)  # a turn moves both arms with the body
    both = joints(person)
    for side in SIDES:
        if both.of(side).tone == 0.0 and moved in (side, "both"):
            raise UserError(
                source,
                f"{key}.side",
                f"is {moved}, but the {side} arm is paralysed (tone 0), expected an arm with tone",
            )


def _check_speed(source: str, key: str, motion: Motion, max_hand_speed: float) -> None:
    if motion.turn is not None:
        turn = motions.Turn(
            angle=math.radians(motion.turn.angle_deg), duration=motion.turn.duration
        )
        if turn.speed > motions.FASTEST_TURN:
            raise UserError(
                source,
                f"{key}.turn.duration",
                f"is {turn.duration} s, a turn at up to {turn.speed:.2g} rad/s, "
                f"expected at most {motions.FASTEST_TURN} rad/s",
            )
    if motion.wave is not None:
        w = motion.wave
        wave = motions.Wave(duration=w.duration, amplitude=w.amplitude, frequency=w.frequency)
        if wave.speed > max_hand_speed:
            raise UserError(
                source,
                f"{key}.wave",
                f"moves the hand at up to {wave.speed:.2g} m/s, "
                f"expected at most max_hand_speed, {max_hand_speed:g} m/s",
            )


def check_costs(source: str, values: dict[str, dict[str, float]]) -> None:
    """Checks that a user's costs accept their values."""
    try:
        registered_costs(values)
    except UserError as error:
        raise UserError(source, f"{error.source}.{error.key}", error.message) from error
