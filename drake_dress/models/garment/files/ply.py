"""Reads PLY files with `plyfile`, and checks what it takes on trust.

`plyfile` reserves memory for as many rows as the header tells, and does not look at what follows
the last of them.
"""

from __future__ import annotations

import io
import re

import numpy as np
from plyfile import PlyData, PlyElement, PlyParseError

from drake_dress.errors import UserError
from drake_dress.models.garment.files.polygons import triangulated
from drake_dress.models.garment.files.raw import IndexArray, RawMesh, too_many

_LIST_NAMES = ("vertex_indices", "vertex_index")
_END = re.compile(rb"^end_header[ \t]*(\r\n|\n|\r)", re.MULTILINE)
_ELEMENT = re.compile(r"^element[ \t]+(\S+)[ \t]+(\S+)", re.MULTILINE)
_MOST_HEADER = 100_000  # bytes


def read_ply(data: bytes, source: str, most_faces: int) -> RawMesh:
    """Returns the mesh of a PLY file, text or binary; polygons are cut into triangles.

    Args:
        data: content of the file.
        source: its name, for messages.
        most_faces: number of polygons beyond which nothing is read.

    Raises:
        UserError: there are too many faces, the file is cut off or longer than its header
            tells, or holds no triangles.
    """
    header, body = _split(data, source)
    text = bool(re.search(r"^format[ \t]+ascii", header, re.MULTILINE))
    if text:
        # blank lines between rows mean nothing
        rows = [row for row in re.split(rb"\r\n|\n|\r", body) if row.strip()]
        body = b"\n".join([*rows, b""])
    count = _count_rows(header, len(body), source, most_faces)
    if text and len(rows) > count:
        raise _too_long(source)
    # a buffer that its reader may close would not tell where reading ended
    stream = io.BytesIO(header.encode("ascii") + body)
    try:
        content = PlyData.read(stream, mmap=False)
    except (PlyParseError, ValueError, OverflowError, MemoryError) as error:
        raise UserError(source, "", f"cannot be read as PLY: {error}") from None
    if not text and stream.tell() < len(header) + len(body):
        raise _too_long(source)
    return _mesh(content, source)


def _split(data: bytes, source: str) -> tuple[str, bytes]:
    """Returns the header with plain line ends, and the rest."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    end = _END.search(data[:_MOST_HEADER])
    if data[:3] != b"ply" or end is None:
        raise UserError(source, "", "has no PLY header (ply … end_header), expected a PLY file")
    # comments alone may hold other characters, and mean nothing
    header = data[: end.end()].decode("ascii", errors="replace").replace("\ufffd", "?")
    header = header.replace("\r\n", "\n").replace("\r", "\n")
    return header, data[end.end() :]


def _count_rows(header: str, size: int, source: str, most_faces: int) -> int:
    """Returns how many rows the header tells of, none of which takes less than a byte."""
    total = 0
    for name, count in _ELEMENT.findall(header):
        if not re.fullmatch(r"\d{1,18}", count):
            raise UserError(
                source, f"element {name}", f"{count[:40]!r} rows, expected a whole number"
            )
        if int(count) > size:
            raise UserError(
                source,
                f"element {name}",
                f"the header counts {count} rows, more than the file holds (is it cut off?)",
            )
        if name == "face" and int(count) > most_faces:
            raise too_many(source, most_faces)
        total += int(count)
    return total


def _too_long(source: str) -> UserError:
    return UserError(source, "", "holds more than its header counts, expected a PLY file")


def _mesh(content: PlyData, source: str) -> RawMesh:
    elements = {element.name: element for element in content.elements}
    if "vertex" not in elements or not {"x", "y", "z"} <= set(_properties(elements["vertex"])):
        raise UserError(source, "element vertex", "lacks x, y, z, expected a PLY file of nodes")
    vertex = elements["vertex"]
    position = np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    if "face" not in elements:
        if "tristrips" in elements:
            raise UserError(source, "element tristrips", "strips are not read, expected faces")
        return RawMesh.of(source, position, np.empty((0, 3), dtype=np.int64))
    face = elements["face"]
    name = next((name for name in _LIST_NAMES if name in _properties(face)), None)
    if name is None:
        raise UserError(source, "element face", f"lacks a list {' or '.join(_LIST_NAMES)}")
    polygons = [np.atleast_1d(corners).tolist() for corners in face[name]]
    _check_polygons(polygons, len(position), source)
    faces, _ = triangulated(position, polygons) if polygons else (_no_faces(), None)
    return RawMesh.of(source, position, faces)


def _no_faces() -> IndexArray:
    return np.empty((0, 3), dtype=np.int64)


def _properties(element: PlyElement) -> list[str]:
    return [prop.name for prop in element.properties]


def _check_polygons(polygons: list[list[int]], count: int, source: str) -> None:
    for k, corners in enumerate(polygons):
        if len(corners) < 3:
            raise UserError(source, f"face {k}", f"has {len(corners)} corners, expected 3 at least")
        if min(corners) < 0 or max(corners) >= count:
            raise UserError(
                source,
                f"face {k}",
                f"names nodes {min(corners)} to {max(corners)}, expected 0 to {count - 1}",
            )
