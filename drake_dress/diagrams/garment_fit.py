"""Whether the garment of a scenario goes on its person, in the words of the scenario's keys."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from drake_dress.diagrams.garment import as_held, build_garment, read_whole
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.coat import COAT_MEASURES, coat_parameters
from drake_dress.diagrams.scenario.ranges import range_of
from drake_dress.diagrams.sections.person import measures
from drake_dress.diagrams.setup import Setup
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import make_coat
from drake_dress.models.garment.fit import (
    Finding,
    Fit,
    GarmentSizes,
    PersonGirths,
    garment_sizes,
    judge,
    person_girths,
    size_advice,
)
from drake_dress.models.garment.life_size import is_life_size
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.report.garment_look import Advice

_TRIAL_SPACING = 0.06  # of a coat that is cut only to see whether it can be, m
_HINT = "drake-dress garment shows it"


@dataclass(frozen=True)
class Judged:
    """A garment at the resolution of its file, its measures, the person's, and the verdict."""

    mesh: GarmentMesh
    sizes: GarmentSizes
    girths: PersonGirths
    fit: Fit


def judged(
    garment: schema.Garment,
    person: schema.Person,
    spacings: tuple[float, float],
    base: Path,
    at_edges: bool | None = None,
) -> Judged:
    """Returns the verdict on a garment and a person.

    Args:
        garment: pattern or mesh file.
        person: who is to wear it.
        spacings: of a coat, and of the mesh on which distances over the cloth are measured, m.
        base: directory that a mesh file's name is relative to.
        at_edges: whether it is to be held at the edges of its opening; None as it says itself.

    Raises:
        UserError: the garment cannot be used.
    """
    at_edges = garment.hold == "edges" if at_edges is None else at_edges
    fine, coarse = spacings
    simple = build_garment(garment, coarse, base)
    if garment.mesh is not None:
        mesh = as_held(read_whole(garment.mesh, base).mesh(), garment)
    else:
        mesh = build_garment(garment, fine, base)
    sizes = garment_sizes(mesh, simple)
    girths = person_girths(measures(person))
    return Judged(mesh, sizes, girths, judge(sizes, girths, at_edges))


def check_fit(setup: Setup) -> None:
    """Checks before a run that the garment goes on; tells on stderr what is tight.

    Raises:
        UserError: the garment cannot go on.
    """
    garment = setup.scenario.garment
    mesh = setup.garments.plant
    if garment.mesh is not None:
        mesh = read_whole(garment.mesh, setup.source.parent).mesh()
    girths = person_girths(setup.station.measures)
    sizes = garment_sizes(mesh, setup.garments.belief)
    fit = judge(sizes, girths, garment.hold == "edges")
    from_front = setup.scenario.station.side == "front"
    for finding in (*fit.impossible, *fit.reasons):
        if finding.level == "unknown" and from_front:
            continue
        more = len(fit.reasons) - 1
        others = f" ({more} more)" if more else ""
        message = f"{finding.text}{others}; {_HINT}"
        if finding.level == "cannot":
            raise UserError(str(setup.source), key_of(garment, finding), message)
        print(f"{setup.source}: {key_of(garment, finding)}: {message}", file=sys.stderr)
        return


def key_of(garment: schema.Garment, finding: Finding) -> str:
    """Returns the scenario key that a finding is about."""
    if garment.mesh is not None:
        return "garment.mesh.scale" if finding.measure else "garment.mesh.file"
    is_key = finding.measure in COAT_MEASURES
    return f"garment.coat.{finding.measure}" if is_key else "garment.coat.scale"


def advice_on(garment: schema.Garment, fit: Fit) -> Advice:
    """Returns the size that would suit, as values of scenario keys that can be used."""
    size = size_advice(fit)
    now, key = garment.coat.scale, "garment.coat.scale"
    if garment.mesh is not None:
        now, key = garment.mesh.scale, "garment.mesh.scale"
    if size.scale == 1.0:
        told = "The size suits; nothing needs to change."
        return Advice(key, now, now * size.least, {}, told)
    if size.scale is None:
        return Advice(key, None, None, {}, "No size of this garment suits.")
    value = _rounded_up(now * size.scale)
    problem = _problem_of_scale(garment, fit, key, value, size.scale)
    told = f"With {key}: {value:g} all judged measures would suit."
    if problem is not None:
        told = f"{key}: {value:g} would suit, but {problem}."
    measures = _measures(garment, size.measures)
    if measures:
        each = ", ".join(f"{name}: {length:g}" for name, length in measures.items())
        told += f" Or change the measures alone: {each}."
    usable = value if problem is None else None
    return Advice(key, usable, now * size.least, measures, told)


def _problem_of_scale(
    garment: schema.Garment, fit: Fit, key: str, value: float, factor: float
) -> str | None:
    """Returns why a value of the scale cannot be used; None if it can."""
    low, high = range_of(key) or (0.0, math.inf)
    if not low <= value <= high:
        return f"{low:g} to {high:g} are allowed"
    if garment.mesh is None:
        return _problem_of_coat(replace(garment.coat, scale=value))
    row = next(row for row in fit.comparisons if row.name == "shoulder width")
    width = factor * (row.garment or 0.0)
    return None if is_life_size(width) else f"the shoulders would be {width:.2f} m wide"


def _measures(garment: schema.Garment, wanted: Mapping[str, float]) -> dict[str, float]:
    """Returns keys of a coat that make it suit without a change of scale; empty if none do."""
    if garment.mesh is not None or not set(wanted) <= set(COAT_MEASURES):
        return {}
    # measures are given before they are scaled
    given = {name: _rounded_up(length / garment.coat.scale) for name, length in wanted.items()}
    coat = replace(garment.coat)
    for name, length in given.items():
        setattr(coat, name, length)
    if _problem_of_coat(coat) is not None:
        return {}
    return {f"garment.coat.{name}": length for name, length in given.items()}


def _problem_of_coat(coat: schema.Coat) -> str | None:
    """Returns why a coat cannot be cut; None if it can."""
    try:
        make_coat(coat_parameters(coat), _TRIAL_SPACING)
    except UserError as error:
        return f"such a coat cannot be cut ({error.key})"
    return None


def _rounded_up(value: float) -> float:
    """Returns the next larger value with three significant digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / step - 1e-9) * step:.6g}")
