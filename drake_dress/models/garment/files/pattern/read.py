"""Reads a sewing pattern as a mesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.garment.files.pattern.sewing import sewn
from drake_dress.models.garment.files.pattern.specification import Panel, parse_pattern
from drake_dress.models.garment.files.pattern.worn import worn
from drake_dress.models.garment.files.raw import RawMesh, too_many

SPACING = 0.02  # m: as fine as the plant's cloth; the mesh is brought to other spacings later
_TRIANGLE = 0.43 * SPACING**2  # m², of a triangle
_MOST_LENGTH = 20.0  # m of any panel: a wrong unit would make millions of triangles


def read_pattern(
    data: bytes, source: str, most: int, progress: Callable[[float], None] = lambda _share: None
) -> RawMesh:
    """Returns the sewn garment of a pattern in GarmentCode's JSON format, in the file's unit.

    Its parts are the panels, by name. y points up and z to the front.

    Args:
        data: content of the file.
        source: the file, for messages.
        most: largest number of triangles.
        progress: called with the share of the work that is done.

    Raises:
        UserError: the file is no pattern, or a panel or stitch in it cannot be used.
    """
    pattern = parse_pattern(data, source)
    for panel in pattern.panels:
        for number, curve in enumerate(panel.curves):
            if not 1e-3 < curve.length < _MOST_LENGTH:
                raise UserError(
                    source,
                    f"panels.{panel.name}.edges[{number}]",
                    f"is {curve.length:.3g} m long, expected 0.001 to {_MOST_LENGTH:g} m: "
                    "is properties.units_in_meter right?",
                )
    if sum(_area(panel) for panel in pattern.panels) > most * _TRIANGLE:
        raise too_many(source, most)
    joined = sewn(pattern, SPACING)
    if len(joined.faces) > most:
        raise too_many(source, most)
    position = worn(joined, progress)
    return RawMesh.of(
        source,
        np.asarray(position / pattern.scale),
        joined.faces,
        face_part=joined.panel.astype(np.int64),
        part_names=tuple((panel.name,) for panel in pattern.panels),
    )


def _area(panel: Panel) -> float:
    """Returns the area of the rectangle around a panel, m²."""
    points = np.vstack([curve.sampled(8) for curve in panel.curves])
    return float(np.prod(np.ptp(points, axis=0)))
