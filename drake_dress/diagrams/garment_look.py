"""Looks at a garment before a run: writes its page, its figures, and a scenario that runs it."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drake_dress.diagrams.garment import as_held, read_whole
from drake_dress.diagrams.garment_fit import Judged, advice_on, judged
from drake_dress.diagrams.scenario import (
    Scenario,
    apply_variation,
    checked_scenario,
    load_scenario,
    resolved_yaml,
)
from drake_dress.diagrams.scenario.edges import at_edges
from drake_dress.diagrams.scenario.schema import Coat, Mesh
from drake_dress.diagrams.sections.person import measures
from drake_dress.file_output import GARMENT_FILES, claimed, write_text
from drake_dress.models.garment.front import front_of
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import BodyMeasures
from drake_dress.report.garment_look import GarmentLook, garment_json
from drake_dress.shipped import scenario_file
from drake_dress.yaml_text import read_yaml, write_yaml

# The scenario that a garment file is put into.
BASE = "dummy_standing"


@dataclass(frozen=True)
class Subject:
    """A garment to look at.

    Attributes:
        given: its file or scenario, as named by the user.
        scenario: that contains it; a variation is not drawn yet.
        base: directory that a mesh file's name is relative to.
        picks_hold: whether the look says where to hold the garment: a file that is open is held at
            the edges of its opening, unless the user wants something else.
    """

    given: str
    scenario: Scenario
    base: Path
    picks_hold: bool = False

    def held(self, mesh: GarmentMesh) -> tuple[Subject, GarmentMesh]:
        """Returns the subject and its mesh as it is best held."""
        if not self.picks_hold or front_of(mesh) == "closed":
            return self, mesh
        scenario = at_edges(self.scenario)
        return replace(self, scenario=scenario), as_held(mesh, scenario.garment)


def garment_source(given: str) -> tuple[Path, bool]:
    """Returns the file of a garment or scenario, and whether it is a garment's.

    Raises:
        UserError: there is neither a file nor a shipped scenario of that name.
    """
    is_mesh = Path(given).suffix.lower() not in ("", ".yaml", ".yml")
    return (Path(given) if is_mesh else scenario_file(given)), is_mesh


def subject_of(
    given: str, person: Path | None, overrides: Sequence[str] = (), seed: int | None = None
) -> Subject:
    """Returns the scenario of a garment.

    Args:
        given: a garment's file, a scenario's file, or the name of a shipped scenario. A garment's
            file is put into the scenario `BASE`.
        person: scenario whose person is to wear it; None for that of the garment's own scenario.
        overrides: KEY=VALUE each.
        seed: replaces the scenario's own.

    Raises:
        UserError: a file, key or value cannot be used.
    """
    source, is_mesh = garment_source(given)
    base = source.parent
    said = [text.partition("=")[0] for text in overrides]
    if is_mesh:
        # a quoted text, as its name may contain anything
        overrides = [f"garment.mesh.file={json.dumps(str(source))}", *overrides]
        source, base = scenario_file(BASE), Path()
    scenario = load_scenario(source, overrides, seed)
    if person is not None:
        scenario = replace(scenario, person=load_scenario(person).person)
    picks = is_mesh and not any(
        key == "garment.hold" or key.startswith("garment.mesh.grasp") for key in said
    )
    return Subject(given, scenario, base, picks)


def look_at(subject: Subject, out: Path) -> GarmentLook:
    """Returns all that is to be told of a garment.

    Args:
        subject: the garment in its scenario.
        out: directory in which its scenario is to be written.

    Raises:
        UserError: the garment cannot be used.
    """
    drawn = apply_variation(subject.scenario)
    garment = drawn.garment
    spacings = (drawn.plant.spacing, drawn.controller.spacing)
    at_edges = True if subject.picks_hold else None
    found: Judged = judged(garment, drawn.person, spacings, subject.base, at_edges)
    body: BodyMeasures = measures(drawn.person)
    mended = () if garment.mesh is None else read_whole(garment.mesh, subject.base).notes
    subject, mesh = subject.held(found.mesh)
    return GarmentLook(
        name=subject.given,
        mesh=mesh,
        sizes=found.sizes,
        body=body,
        girths=found.girths,
        fit=found.fit,
        advice=advice_on(garment, found.fit),
        mended=mended,
        scenario=_scenario_text(subject, out),
        command=f"drake-dress run {out / GARMENT_FILES[2]}",
    )


def write_look(subject: Subject, out: Path) -> GarmentLook:
    """Writes page, figures and scenario of a garment into a directory, all or none.

    Raises:
        UserError: the garment cannot be used, or another command writes there.
    """
    # its plots take a second to import
    from drake_dress.report.garment_html import garment_page

    look = look_at(subject, out)
    texts = (garment_page(look), garment_json(look), look.scenario)
    with claimed("--out", out):
        for name, text in zip(GARMENT_FILES, texts, strict=True):
            write_text(out / name, text)
    return look


def verdict(look: GarmentLook) -> str:
    """Returns the verdict in one line."""
    words = {True: "it fits", False: "it does not fit", None: "it cannot be judged"}
    if look.fit.impossible:
        words[False] = "it cannot go on"
    if look.fit.reasons:
        words[True] = "it is tight"
    reasons = "; ".join(finding.text for finding in look.fit.reasons)
    return words[look.fit.fits] + (f": {reasons}" if reasons else "")


def _scenario_text(subject: Subject, out: Path) -> str:
    """Returns YAML of the subject's scenario with the keys that differ from the defaults."""
    scenario = subject.scenario
    mesh = scenario.garment.mesh
    if mesh is not None:
        # links are followed: the system takes `..` after them
        file = subject.base / mesh.file
        folder = os.path.relpath(os.path.realpath(file.parent), os.path.realpath(out))
        moved = replace(mesh, file=os.path.join(folder, file.name))
        # the mesh replaces the coat
        scenario = replace(scenario, garment=replace(scenario.garment, coat=Coat(), mesh=moved))
    content, default = (_plain(each) for each in (scenario, checked_scenario(Scenario())))
    default["garment"]["mesh"] = vars(Mesh())
    name = " ".join(Path(subject.given).name.split())
    head = f"# {name}, written by drake-dress garment. Keys that are not given have the defaults.\n"
    return head + (write_yaml(_differing(content, default)) or "seed: 0\n")


def _plain(scenario: Scenario) -> dict[str, Any]:
    content: dict[str, Any] = read_yaml("scenario", resolved_yaml(scenario))
    return content


def _differing(content: dict[str, Any], default: dict[str, Any]) -> dict[str, Any]:
    """Returns the values that differ from the defaults, in their groups."""
    found: dict[str, Any] = {}
    for key, value in content.items():
        other = default.get(key)
        if isinstance(value, dict) and isinstance(other, dict):
            below = _differing(value, other)
            if below:
                found[key] = below
        elif key not in default or value != other:
            found[key] = value
    return found
