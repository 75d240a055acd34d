"""Reads the polygons of a Wavefront OBJ file.

The readers of mesh libraries fail on some dialects of the format (byte order marks, tabs, comments
at line ends, relative indices between nodes, Latin-1 names), and do not report the line. This
reader takes nodes, polygons, texture coordinates, objects and groups, and skips everything else
that the format defines for polygons. It refuses the rest and reports the line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.files.polygons import corners_triangulated
from drake_dress.models.garment.files.raw import RawMesh, too_many
from drake_dress.models.garment.files.text import Numbers, decoded, lines_of

# Statements that change nothing about the surface: normals, materials, smoothing, lines, points,
# display. Names (`o`, `g`) are read for `leave_out`.
_PASSED = frozenset(
    "vn vp l p s mg mtllib usemtl maplib usemap bevel c_interp d_interp lod shadow_obj "
    "trace_obj call csh".split()
)
_CURVED = frozenset(
    "cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con ctech stech "
    "bsp bzp cdc cdp res".split()
)
# A name or path may end in a backslash, which is then not a line continuation.
_NAMED = frozenset(("o", "g", "mtllib", "usemtl", "maplib", "usemap"))
_MOST_CORNERS = 1000  # of one polygon
_INDEX = re.compile(r"([+-]?\d{1,18})(?:/([+-]?\d{0,18}))?(?:/[+-]?\d*)?", re.ASCII)


def read_obj(data: bytes, source: str, most_faces: int) -> RawMesh:
    """Returns the mesh of an OBJ file; polygons are cut into triangles.

    Args:
        data: content of the file.
        source: its name, for messages.
        most_faces: number of polygons above which the file is refused.

    Raises:
        UserError: a line cannot be read or names nodes that the file lacks, or there are too many
            polygons.
    """
    numbers = Numbers(source)
    nodes: list[list[float]] = []
    textures: list[list[float]] = []
    node_line: list[int] = []
    polygons: list[list[int]] = []
    polygon_textures: list[list[int]] = []
    polygon_line: list[int] = []
    polygon_part: list[int] = []
    parts: dict[tuple[str, ...], int] = {(): 0}
    name, part = "", 0
    groups: tuple[str, ...] = ()
    for line, keyword, words in _statements(decoded(data, source)):
        if keyword == "v":
            nodes.append(_node(numbers, words, line, source))
            node_line.append(line)
        elif keyword == "vt":
            textures.append(_texture(words))
        elif keyword in ("f", "fo"):
            polygons.append(_corners(words, len(nodes), line, source))
            polygon_textures.append(_texture_corners(words, len(textures)))
            polygon_line.append(line)
            polygon_part.append(part)
            if len(polygons) > most_faces:
                raise too_many(source, most_faces)
        elif keyword in ("o", "g"):
            if keyword == "o":
                name = " ".join(words)
            else:
                # several words are several groups or one name with spaces: either may be asked for
                groups = tuple(dict.fromkeys((*words, " ".join(words))))
            part = parts.setdefault(tuple(filter(None, (name, *groups))), len(parts))
        else:
            _check_passed(keyword, line, source)
    _check_range(polygons, polygon_line, len(nodes), source)
    position = np.array(nodes, dtype=np.float64).reshape(-1, 3)
    node, corner, owner = corners_triangulated(position, polygons)
    return RawMesh.of(
        source,
        position,
        node[corner],
        face_part=np.array(polygon_part, dtype=np.int64)[owner],
        part_names=tuple(parts),
        node_line=np.array(node_line, dtype=np.int64),
        face_line=np.array(polygon_line, dtype=np.int64)[owner],
        uv=_texture_of(textures, polygon_textures)[corner] if textures else None,
    )


def _check_passed(keyword: str, line: int, source: str) -> None:
    """Raises UserError if a statement describes a curved surface, or is none of the format."""
    if keyword in _CURVED:
        raise UserError(
            source, f"line {line}", f"{keyword!r} is a curved surface, expected polygons"
        )
    if keyword not in _PASSED:
        raise UserError(
            source, f"line {line}", f"{keyword[:40]!r} is no statement of the OBJ format"
        )


def _statements(text: str) -> Iterator[tuple[int, str, list[str]]]:
    """Yields line, keyword and words of each statement; drops comments, joins continued lines."""
    lines = iter(enumerate(lines_of(text), start=1))
    for line, content in lines:
        words = content.partition("#")[0].split()
        if not words:
            continue
        keyword = words[0].lower()
        if keyword in _NAMED:
            # in a name, "#" begins a comment only after a space
            words = re.split(r"(?:^|\s)#", content, maxsplit=1)[0].split()
        else:
            while words and words[-1].endswith("\\"):
                words[-1] = words[-1].rstrip("\\")
                _, content = next(lines, (0, ""))
                words += content.partition("#")[0].split()
        yield line, keyword, [word for word in words[1:] if word]


def _node(numbers: Numbers, words: list[str], line: int, source: str) -> list[float]:
    """Returns x, y, z; a weight, a colour, or both may follow them."""
    if len(words) not in (3, 4, 6, 7, 8):
        raise UserError(
            source,
            f"line {line}",
            f"a node of {len(words)} numbers, expected x y z, perhaps with weight or colour",
        )
    values = numbers.read(words, line)
    if len(values) == 4 and values[3] != 1.0:
        raise UserError(
            source, f"line {line}", f"the node has weight {values[3]:g}, expected 1 for polygons"
        )
    return values[:3]


def _corners(words: list[str], count: int, line: int, source: str) -> list[int]:
    """Returns the nodes of a polygon, counted from 0; the file counts from 1, or back from -1."""
    corners = []
    for word in words:
        match = _INDEX.fullmatch(word)
        if match is None:
            raise UserError(
                source,
                f"line {line}",
                f"{word[:40]!r} is no corner of a face, expected NODE/TEXTURE/NORMAL",
            )
        index = int(match[1])
        if index < -count:
            raise UserError(
                source,
                f"line {line}",
                f"names node {index}, but only {count} nodes stand before this line",
            )
        corners.append(index - 1 if index > 0 else count + index if index < 0 else -1)
    if not 3 <= len(corners) <= _MOST_CORNERS:
        raise UserError(
            source,
            f"line {line}",
            f"a face with {len(corners)} corners, expected 3 to {_MOST_CORNERS}",
        )
    return corners


def _texture(words: list[str]) -> list[float]:
    """Returns u, v; NaN where there are no two numbers, as the surface does not depend on them."""
    try:
        u, v = (float(word) for word in words[:2])
    except ValueError:
        return [np.nan, np.nan]
    return [u, v]


def _texture_corners(words: list[str], count: int) -> list[int]:
    """Returns the texture coordinates of a polygon's corners, counted from 0; -1 for none."""
    corners = []
    for word in words:
        match = _INDEX.fullmatch(word)
        text = "" if match is None else match[2] or ""
        index = int(text) if text.strip("+-") else 0
        corners.append(index - 1 if index > 0 else count + index if -count <= index < 0 else -1)
    return corners


def _texture_of(textures: list[list[float]], polygons: list[list[int]]) -> FloatArray:
    """Returns (k,2) texture coordinates of all corners of all polygons, NaN where there are none.

    Args:
        textures: u and v in the order of the file.
        polygons: which of them each corner has; -1 or one that the file lacks for none.
    """
    known = np.array([*textures, [np.nan, np.nan]], dtype=np.float64)
    which = np.array([corner for polygon in polygons for corner in polygon], dtype=np.int64)
    return np.asarray(known[np.where(which < len(textures), which, -1)])


def _check_range(polygons: list[list[int]], lines: list[int], count: int, source: str) -> None:
    lowest = min((min(corners) for corners in polygons), default=0)
    highest = max((max(corners) for corners in polygons), default=-1)
    for corners, line in zip(polygons, lines, strict=True):
        if lowest < 0 and min(corners) < 0:
            hint = " (does the file count from 0? add 1 to all)" if highest < count - 1 else ""
            raise UserError(
                source, f"line {line}", f"names node 0, but OBJ counts nodes from 1{hint}"
            )
        if lowest >= 0 and max(corners) >= count:
            raise UserError(
                source,
                f"line {line}",
                f"names node {max(corners) + 1}, but the file has {count} nodes",
            )
