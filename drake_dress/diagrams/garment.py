"""The garment that a scenario asks for."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

from drake_dress.diagrams.scenario import schema
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.mesh import GarmentMesh

_SCALED = (
    "body_length",
    "chest",
    "shoulder_width",
    "sleeve_length",
    "armhole_girth",
    "cuff_girth",
    "collar_height",
    "neck_width",
    "front_opening",
)


def build_garment(garment: schema.Garment, spacing: float, base: Path) -> GarmentMesh:
    """Returns the garment meshed at `spacing`, m.

    Args:
        garment: pattern or mesh file.
        spacing: wanted edge length, m.
        base: directory that a mesh file's name is relative to.

    Raises:
        UserError: measures contradict each other, or the file cannot be used.
    """
    if garment.mesh is not None:
        from drake_dress.models.garment.load import load_garment

        m = garment.mesh
        return load_garment(
            base / m.file,
            unit=m.unit,
            spacing=spacing,
            loops=m.loops or None,
            grasp=m.grasp or None,
        )
    coat = garment.coat
    parameters = COATS[coat.preset]
    parameters = replace(
        parameters, **{name: coat.scale * getattr(parameters, name) for name in _SCALED}
    )
    given = {
        entry.name: getattr(coat, entry.name)
        for entry in fields(coat)
        if entry.name not in ("preset", "scale", "grasp") and getattr(coat, entry.name) is not None
    }
    if coat.grasp == "seam":
        parameters = replace(parameters, grasp_count=0)
    return make_coat(replace(parameters, **given), spacing, source="garment.coat")
