"""Reads STL files, binary and text.

A binary file may begin with "solid" like a text file, so its length decides: 84 bytes and 50 for
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
        most_faces: number of triangles above which a text file is refused.

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
    found = _Statements(source, most_faces)
    for line, content in enumerate(lines_of(text), start=1):
        words = content.split()
        keyword = words[0].lower() if words else ""
        if keyword == "vertex":
            found.add_corner(words, line)
        elif keyword == "endfacet":
            found.end_triangle(line)
        elif keyword == "solid":
            found.begin_solid(words, line)
        elif keyword == "endsolid":
            found.open_solid = False
        elif keyword not in ("", "facet", "outer", "endloop"):
            raise UserError(source, f"line {line}", f"{keyword[:40]!r} is no statement of STL")
    return found.mesh()


class _Statements:
    """Nodes and faces that the statements of a text have given so far."""

    def __init__(self, source: str, most_faces: int) -> None:
        self.source, self.most_faces = source, most_faces
        self.numbers = Numbers(source)
        self.nodes: list[list[float]] = []
        self.node_line: list[int] = []
        self.face_line: list[int] = []
        self.face_part: list[int] = []
        self.names: list[tuple[str, ...]] = []
        self.open_solid = False
        self.corners = 0  # of the open triangle

    def add_corner(self, words: list[str], line: int) -> None:
        if len(words) != 4:
            raise UserError(self.source, f"line {line}", "expected vertex x y z")
        self.nodes.append(self.numbers.read(words[1:], line))
        self.node_line.append(line)
        self.corners += 1

    def end_triangle(self, line: int) -> None:
        if self.corners != 3:
            told = f"a triangle with {self.corners} corners, expected 3"
            raise UserError(self.source, f"line {line}", told)
        self.face_line.append(line)
        if len(self.face_line) > self.most_faces:
            raise too_many(self.source, self.most_faces)
        self.face_part.append(len(self.names) - 1)
        self.corners = 0

    def begin_solid(self, words: list[str], line: int) -> None:
        if self.open_solid:
            told = "a solid begins before the last has ended"
            raise UserError(self.source, f"line {line}", told)
        self.open_solid = True
        self.names.append(tuple(filter(None, (" ".join(words[1:]),))))

    def mesh(self) -> RawMesh:
        """Returns the mesh; called at the end of the text."""
        source = self.source
        if self.open_solid or self.corners:
            raise UserError(source, "", "ends within a solid, expected endsolid (is it cut off?)")
        if len(self.nodes) != 3 * len(self.face_line):
            raise UserError(source, "", "holds corners outside of triangles, expected an STL file")
        position = np.array(self.nodes, dtype=np.float64).reshape(-1, 3)
        return RawMesh.of(
            source,
            position,
            np.arange(len(position)).reshape(-1, 3),
            face_part=np.array(self.face_part, dtype=np.int64),
            part_names=tuple(self.names) or ((),),
            node_line=np.array(self.node_line, dtype=np.int64),
            face_line=np.array(self.face_line, dtype=np.int64),
        )
