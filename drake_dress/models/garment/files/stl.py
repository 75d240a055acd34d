"""Reads STL files, binary and text.

A binary file may begin with "solid" as text files do, so its length decides: 84 bytes and 50 for
each triangle that it counts.
"""

from __future__ import annotations

import struct

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.garment.files.raw import RawMesh, too_many
from drake_dress.models.garment.files.text import Numbers, decoded, lines_of

_HEADER, _COUNT, _TRIANGLE = 80, 4, 50  # bytes
_RECORD = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes, source: str, most_faces: int) -> RawMesh:
    """Returns the mesh of an STL file; each triangle has three nodes of its own.

    Args:
        data: content of the file.
        source: its name, for messages.
        most_faces: number of triangles beyond which reading ends.

    Raises:
        UserError: there are too many triangles, the file is cut off, counts other triangles
            than it holds, or a line cannot be read.
    """
    start = _HEADER + _COUNT
    if len(data) >= start:
        (count,) = struct.unpack_from("<I", data, _HEADER)
        if len(data) == start + _TRIANGLE * count:
            return _binary(data, source)
    text = data[:1000].lstrip(b"\xef\xbb\xbf \t\r\n")
    if (text[:5].lower() == b"solid" and b"\0" not in text) or 0 in data[1:4]:
        return _text(decoded(data, source), source, most_faces)
    if len(data) < start:
        raise UserError(source, "", f"{len(data)} bytes are too few for an STL file")
    held = (len(data) - start) / _TRIANGLE
    raise UserError(
        source,
        "",
        f"the header counts {count:,} triangles and the file holds {held:,.1f} "
        "(is it cut off?), expected an STL file",
    )


def _binary(data: bytes, source: str) -> RawMesh:
    record = np.frombuffer(data, dtype=_RECORD, offset=_HEADER + _COUNT)
    position = record["corner"].reshape(-1, 3).astype(np.float64)
    return RawMesh.of(source, position, np.arange(len(position)).reshape(-1, 3))


def _text(text: str, source: str, most_faces: int) -> RawMesh:
    numbers = Numbers(source)
    nodes: list[list[float]] = []
    node_line: list[int] = []
    face_line: list[int] = []
    face_part: list[int] = []
    names: list[tuple[str, ...]] = []
    open_solid = False
    corners = 0  # of the triangle that is open
    for line, content in enumerate(lines_of(text), start=1):
        words = content.split()
        keyword = words[0].lower() if words else ""
        if keyword == "vertex":
            if len(words) != 4:
                raise UserError(source, f"line {line}", "expected vertex x y z")
            nodes.append(numbers.read(words[1:], line))
            node_line.append(line)
            corners += 1
        elif keyword == "endfacet":
            if corners != 3:
                raise UserError(
                    source, f"line {line}", f"a triangle with {corners} corners, expected 3"
                )
            face_line.append(line)
            if len(face_line) > most_faces:
                raise too_many(source, most_faces)
            face_part.append(len(names) - 1)
            corners = 0
        elif keyword == "solid":
            if open_solid:
                raise UserError(source, f"line {line}", "a solid begins before the last has ended")
            open_solid = True
            names.append(tuple(filter(None, (" ".join(words[1:]),))))
        elif keyword == "endsolid":
            open_solid = False
        elif keyword not in ("", "facet", "outer", "endloop"):
            raise UserError(source, f"line {line}", f"{keyword[:40]!r} is no statement of STL")
    if open_solid or corners:
        raise UserError(source, "", "ends within a solid, expected endsolid (is it cut off?)")
    if len(nodes) != 3 * len(face_line):
        raise UserError(source, "", "holds corners outside of triangles, expected an STL file")
    position = np.array(nodes, dtype=np.float64).reshape(-1, 3)
    return RawMesh.of(
        source,
        position,
        np.arange(len(position)).reshape(-1, 3),
        face_part=np.array(face_part, dtype=np.int64),
        part_names=tuple(names) or ((),),
        node_line=np.array(node_line, dtype=np.int64),
        face_line=np.array(face_line, dtype=np.int64),
    )
