"""All that is known of a garment before a run, and its machine-readable form, `garment.json`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from drake_dress import __version__
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.fit import Comparison, Fit, GarmentSizes, PersonGirths
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class Advice:
    """The size that would suit, as values of scenario keys.

    Attributes:
        key: key of the scale, `garment.coat.scale` or `garment.mesh.scale`.
        value: of that key, with which all measures suit; None if there is none.
        least: smallest such value; None if there is none.
        measures: values of other keys, each of which makes one measure suit, m.
        sentence: the same in words.
    """

    key: str
    value: float | None
    least: float | None
    measures: Mapping[str, float]
    sentence: str


@dataclass(frozen=True)
class GarmentLook:
    """A garment beside a person.

    Attributes:
        name: of the garment's file or scenario.
        mesh: the garment at rest.
        sizes: its measures.
        body: measures of the person.
        girths: the person's girths.
        fit: the verdict.
        advice: the size that would suit.
        mended: what was mended in the garment's file, a line each.
        scenario: YAML of a scenario that runs it.
        command: the command that runs it.
    """

    name: str
    mesh: GarmentMesh
    sizes: GarmentSizes
    body: BodyMeasures
    girths: PersonGirths
    fit: Fit
    advice: Advice
    mended: tuple[str, ...]
    scenario: str
    command: str


def garment_json(look: GarmentLook) -> str:
    """Returns `garment.json`.

    Lengths are in m. Points are in the garment's own frame: +x forward, +y to the wearer's left, z
    up, the origin midway between the shoulder tips.
    """
    sizes, fit, advice = look.sizes, look.fit, look.advice
    content: dict[str, Any] = {
        "garment": look.name,
        "fits": fit.fits,
        "reasons": [finding.text for finding in fit.reasons],
        "can_go_on": not fit.impossible,
        "notes": [finding.text for finding in fit.notes],
        "size_advice": asdict(advice),
        "loops": [_loop(look, k) for k in range(len(sizes.loops))],
        "comparisons": [_comparison(row) for row in fit.comparisons],
        "opening": sizes.opening,
        "front_gap_m": _number(sizes.front_gap),
        "body_length_m": _number(sizes.body_length),
        "extent_m": _point(sizes.extent),
        "area_m2": _number(sizes.area),
        "left_right_difference_m": _number(sizes.asymmetry),
        "edges_m": {
            name: _number(length)
            for name, length in zip(("shortest", "median", "longest"), sizes.edges, strict=True)
        },
        "nodes": sizes.node_count,
        "triangles": sizes.triangle_count,
        "grasp": {
            side: {
                "nodes": len(look.mesh.grasp[side]),
                "center": _point(look.mesh.rest_position[look.mesh.grasp[side]].mean(axis=0)),
            }
            for side in SIDES
        },
        "mended": list(look.mended),
        "person_m": {name: _number(value) for name, value in asdict(look.girths).items()},
        "version": __version__,
    }
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _loop(look: GarmentLook, k: int) -> dict[str, Any]:
    loop = look.sizes.loops[k]
    beside = _beside(look.fit, loop.name)
    return {
        "name": loop.name,
        "girth_m": _number(loop.girth),
        "center": _point(loop.center),
        "person_part": None if beside is None else beside.part,
        "person_girth_m": None if beside is None else _number(beside.person),
        "ratio": None if beside is None else _number(beside.ratio),
        "state": None if beside is None else beside.state or None,
    }


def _beside(fit: Fit, loop: str) -> Comparison | None:
    """Returns the comparison of a loop with the person; None if there is none."""
    name = loop.replace("_", " ")
    return next((row for row in fit.comparisons if row.name == name), None)


def _comparison(row: Comparison) -> dict[str, Any]:
    return {
        "name": row.name,
        "garment_m": _number(row.garment),
        "person_part": row.part,
        "person_m": _number(row.person),
        "ratio": _number(row.ratio),
        "cannot_below": row.limits.least or None,
        "fails_below": row.limits.fails or None,
        "tight_below": row.limits.tight or None,
        "state": row.state or None,
    }


def _number(value: float | None) -> float | None:
    # micrometres: more digits say nothing
    return None if value is None else round(float(value), 6)


def _point(value: FloatArray) -> list[float]:
    return [round(float(x), 6) for x in value]
