"""The specification of a sewing pattern: panels with edges, and stitches between edges.

The format is that of GarmentCode (Korosteleva and Sorkine-Hornung 2023): under `pattern`, `panels`
by name and `stitches`. A panel has `vertices` in its plane, `edges` that form one loop, and
`translation` and `rotation` (deg, about x, then y, then z) in space. An edge has `endpoints` and
perhaps a `curvature`. A stitch is a pair of a panel's name and an edge's number.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.files.pattern.curve import Curve, curve_of

_CENTIMETRES = 100.0  # units in a metre, if the file does not say
_SAME_WAY = "right_wrong"  # word after a stitch whose edges run the same way


@dataclass(frozen=True)
class Panel:
    """A flat piece of cloth.

    Attributes:
        name: its name.
        curves: its edges in order around it, m.
        rotation: (3,3) from the panel's axes to those of the pattern.
        translation: (3,), m.
    """

    name: str
    curves: tuple[Curve, ...]
    rotation: FloatArray
    translation: FloatArray

    def placed(self, points: FloatArray) -> FloatArray:
        """Returns points (k,2) of the panel's plane in space, (k,3)."""
        flat = np.column_stack([points, np.zeros(len(points))])
        return np.asarray(flat @ self.rotation.T + self.translation)


@dataclass(frozen=True)
class Stitch:
    """Two edges, each as panel and edge number, that are sewn together.

    Attributes:
        first: one edge.
        second: the other.
        same_way: whether their starts meet; otherwise the start of each meets the other's end.
    """

    first: tuple[int, int]
    second: tuple[int, int]
    same_way: bool


@dataclass(frozen=True)
class Pattern:
    """Panels and stitches of a file, and m per unit of the file."""

    source: str
    scale: float
    panels: tuple[Panel, ...]
    stitches: tuple[Stitch, ...]


def parse_pattern(data: bytes, source: str) -> Pattern:
    """Returns the pattern of a JSON specification.

    Raises:
        UserError: it is no JSON, a part is absent or malformed; the key names panel and edge.
    """
    try:
        content = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise UserError(source, "", f"is no JSON, expected a sewing pattern: {error}") from error
    if not isinstance(content, dict) or not isinstance(content.get("pattern"), dict):
        raise UserError(source, "pattern", "is missing, expected panels and stitches")
    pattern = content["pattern"]
    panels = pattern.get("panels")
    if not isinstance(panels, dict) or not panels:
        raise UserError(source, "pattern.panels", "is missing or empty, expected panels by name")
    scale = _scale(content, source)
    relative = _relative(content, source)
    read = tuple(_panel(n, p, scale, relative, source) for n, p in panels.items())
    stitches = pattern.get("stitches", [])
    if not isinstance(stitches, list):
        raise UserError(source, "pattern.stitches", "expected a list of pairs of edges")
    pairs = tuple(_stitch(i, s, read, source) for i, s in enumerate(stitches))
    _check_sewn_once(pairs, read, source)
    return Pattern(source, scale, read, pairs)


def _properties(content: dict[str, Any]) -> dict[str, Any]:
    properties = content.get("properties")
    return properties if isinstance(properties, dict) else {}


def _scale(content: dict[str, Any], source: str) -> float:
    """Returns metres per unit of the file."""
    units = _properties(content).get("units_in_meter", _CENTIMETRES)
    if isinstance(units, bool) or not isinstance(units, int | float) or not 0 < units < 1e6:
        raise UserError(
            source, "properties.units_in_meter", f"is {units!r}, expected a number, 100 for cm"
        )
    return 1.0 / float(units)


def _relative(content: dict[str, Any], source: str) -> bool:
    kind = _properties(content).get("curvature_coords", "relative")
    if kind not in ("relative", "absolute"):
        raise UserError(
            source, "properties.curvature_coords", f"is {kind!r}, expected relative or absolute"
        )
    return bool(kind == "relative")


def _panel(name: str, panel: Any, scale: float, relative: bool, source: str) -> Panel:
    key = f"panels.{name}"
    if not isinstance(panel, dict):
        raise UserError(source, key, "expected vertices, edges, translation and rotation")
    vertices = _numbers(panel.get("vertices"), f"{key}.vertices", 2, source) * scale
    edges = panel.get("edges")
    if not isinstance(edges, list) or len(edges) < 2:
        raise UserError(source, f"{key}.edges", "expected a list of two or more edges")
    ends = [_endpoints(e, len(vertices), f"{key}.edges[{i}]", source) for i, e in enumerate(edges)]
    for i, (_, end) in enumerate(ends):
        following = (i + 1) % len(ends)
        if ends[following][0] != end:
            raise UserError(
                source,
                f"{key}.edges[{following}]",
                f"starts at vertex {ends[following][0]}, expected {end}, where the edge before it "
                "ends: edges form one loop",
            )
    curves = tuple(
        curve_of(
            vertices[a],
            vertices[b],
            edge.get("curvature"),
            None if relative else scale,
            scale,
            (source, f"{key}.edges[{i}].curvature"),
        )
        for i, (edge, (a, b)) in enumerate(zip(edges, ends, strict=True))
    )
    turn = _numbers([panel.get("rotation", [0, 0, 0])], f"{key}.rotation", 3, source)[0]
    move = _numbers([panel.get("translation", [0, 0, 0])], f"{key}.translation", 3, source)[0]
    return Panel(name, curves, _rotation(np.deg2rad(turn)), move * scale)


def _endpoints(edge: Any, count: int, key: str, source: str) -> tuple[int, int]:
    ends = edge.get("endpoints") if isinstance(edge, dict) else None
    if (
        not isinstance(ends, list)
        or len(ends) != 2
        or not all(type(v) is int and 0 <= v < count for v in ends)
        or ends[0] == ends[1]
    ):
        raise UserError(
            source, f"{key}.endpoints", f"is {ends!r}, expected two vertices from 0 to {count - 1}"
        )
    return ends[0], ends[1]


def _numbers(rows: Any, key: str, width: int, source: str) -> FloatArray:
    try:
        array = np.asarray(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros(0)
    if array.ndim != 2 or array.shape[1] != width or not (np.abs(array) < 1e9).all():
        raise UserError(source, key, f"expected {width} finite numbers each")
    return array


def _rotation(angles: FloatArray) -> FloatArray:
    """Returns the matrix that turns about x, then y, then z, by angles in rad."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def _stitch(number: int, stitch: Any, panels: tuple[Panel, ...], source: str) -> Stitch:
    key = f"stitches[{number}]"
    if not isinstance(stitch, list) or len(stitch) not in (2, 3):
        raise UserError(source, key, "expected two edges, each by panel and edge")
    if len(stitch) == 3 and stitch[2] != _SAME_WAY:
        raise UserError(source, key, f"has {stitch[2]!r} after its edges, expected {_SAME_WAY!r}")
    names = [panel.name for panel in panels]
    sides = []
    for side in stitch[:2]:
        name = side.get("panel") if isinstance(side, dict) else None
        if name not in names:
            expected = ", ".join(names)
            raise UserError(source, key, f"names panel {name!r}, expected one of {expected}")
        panel = names.index(name)
        edge, count = side.get("edge"), len(panels[panel].curves)
        if type(edge) is not int or not 0 <= edge < count:
            raise UserError(
                source, key, f"names edge {edge!r} of {name}, expected 0 to {count - 1}"
            )
        sides.append((panel, edge))
    return Stitch(sides[0], sides[1], len(stitch) == 3)


def _check_sewn_once(stitches: tuple[Stitch, ...], panels: tuple[Panel, ...], source: str) -> None:
    seen: dict[tuple[int, int], int] = {}
    for number, stitch in enumerate(stitches):
        for panel, edge in (stitch.first, stitch.second):
            if (panel, edge) in seen:
                raise UserError(
                    source,
                    f"stitches[{number}]",
                    f"sews edge {edge} of {panels[panel].name}, which stitch "
                    f"{seen[panel, edge]} sews already, expected each edge once",
                )
            seen[panel, edge] = number
