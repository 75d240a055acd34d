"""Finds the loops of a garment that are named by a place on it or by a plane.

`near (x, y, z) m` means, for a cuff, the boundary nearest to this point; for an armhole, the
shortest closed line around the sleeve there. `plane (x, y, z) m, (a, b, c)` means, for an armhole,
the line in the plane through this point with this normal. Both are in the axes of the file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.cut import cut_along, plane_line, shortest_line
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.files.text import TRIPLE
from drake_dress.models.garment.merge import gap_between
from drake_dress.models.garment.mesh import loop_length
from drake_dress.models.garment.openings import CUFF_GIRTH

_NEAR = re.compile(rf"near\s*{TRIPLE}\s*(?:m)?")
_PLANE = re.compile(rf"plane\s*{TRIPLE}\s*(?:m)?\s*,\s*{TRIPLE}")
_FARTHEST = 0.1  # of a point from the garment, m


def placed_loops(
    position: FloatArray, faces: IntArray, entries: Mapping[str, str], source: str
) -> tuple[FloatArray, IntArray, dict[str, IntArray]]:
    """Returns the mesh with lines that the entries ask for as edges, and the loops by name.

    Old nodes keep their index and place.

    Args:
        position: (n,3), m, in the axes of the file.
        faces: (F,3) of a manifold.
        entries: by loop name.
        source: file put in front of messages.

    Raises:
        UserError: an entry cannot be read, its point is off the garment, or there is no such loop.
    """
    loops: dict[str, IntArray] = {}
    for name in sorted(entries, key=lambda name: not name.endswith("cuff")):
        key, text = f"loops.{name}", entries[name].strip()
        is_cuff = name.endswith("cuff")
        plane = None if is_cuff else _PLANE.fullmatch(text)
        match = plane or _NEAR.fullmatch(text)
        if match is None:
            expected = "'near (0.5, 0, 1.2) m'"
            if not is_cuff:
                expected += " or 'plane (0.2, 0, 1.3) m, (1, 0, 0)'"
            raise UserError(source, key, f"is {text!r}, expected a list of nodes or {expected}")
        numbers = [float(word) for word in match.groups()]
        point = np.array(numbers[:3])
        _check_near(position, point, key, source)
        if is_cuff:
            loops[name] = _nearest(faces, position, point, key, source)
            continue
        if plane is not None:
            line = plane_line(position, faces, point, numbers[3:])
        else:
            cuff = loops.get(f"{name.partition('_')[0]}_cuff")
            if cuff is None:
                cuff = _nearest(faces, position, point, key, source)
            on_mesh = position[np.argmin(np.linalg.norm(position - point, axis=1))]
            line = shortest_line(position, faces, on_mesh, position[cuff].mean(axis=0) - on_mesh)
        if line is None:
            raise UserError(source, key, f"{text!r} cuts no closed line around a sleeve")
        position, faces, loops[name] = cut_along(position, faces, line)
    return position, faces, loops


def _check_near(position: FloatArray, point: FloatArray, key: str, source: str) -> None:
    off = gap_between(position, point[None])
    if off > _FARTHEST:
        low, high = position.min(axis=0).round(2).tolist(), position.max(axis=0).round(2).tolist()
        raise UserError(
            source,
            key,
            f"the point is {off:.2g} m off the garment, which reaches from {low} to {high} m in "
            "the file's axes",
        )


def _nearest(
    faces: IntArray, position: FloatArray, point: FloatArray, key: str, source: str
) -> IntArray:
    """Returns the boundary of a cuff's girth that is nearest; any boundary if there is none."""
    loops = boundary_loops(faces)
    if not loops:
        raise UserError(source, key, "the garment has no openings, expected open sleeves")
    low, high = CUFF_GIRTH
    small = [loop for loop in loops if low <= loop_length(position, loop) <= high]
    off = [float(np.linalg.norm(position[q] - point, axis=1).min()) for q in small or loops]
    return (small or loops)[int(np.argmin(off))]
