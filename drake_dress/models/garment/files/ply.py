"""Reads PLY files, text or binary, into triangles."""

from __future__ import annotations

import re

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import IndexArray
from drake_dress.models.garment.files.ply_rows import (
    Element,
    Rows,
    read_binary,
    read_header,
    read_text,
)
from drake_dress.models.garment.files.polygons import triangulated
from drake_dress.models.garment.files.raw import RawMesh, too_many

_LIST_NAMES = ("vertex_indices", "vertex_index")
# Names of texture coordinates of nodes, as different programs write them.
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_END = re.compile(rb"^end_header[ \t]*(\r\n|\n|\r)", re.MULTILINE)
_MOST_HEADER = 100_000  # bytes


def read_ply(data: bytes, source: str, most_faces: int) -> RawMesh:
    """Returns the mesh of a PLY file, text or binary; polygons are cut into triangles.

    Args:
        data: content of the file.
        source: its name, for messages.
        most_faces: number of polygons above which the file is refused.

    Raises:
        UserError: there are too many faces, the file is cut off or longer than its header states,
            or its header, nodes or faces are invalid.
    """
    header, body = _split(data, source)
    order, elements = read_header(header, source)
    for element in elements:
        # no row takes less than a byte
        if element.count > len(body):
            raise UserError(
                source,
                f"element {element.name}",
                f"the header counts {element.count} rows, more than the file holds (is it cut "
                "off?)",
            )
        if element.name == "face" and element.count > most_faces:
            raise too_many(source, most_faces)
    if order:
        rows = read_binary(body, order, elements, source)
    else:
        rows = read_text(body, elements, source)
    return _mesh({element.name: element for element in elements}, rows, source)


def _split(data: bytes, source: str) -> tuple[str, bytes]:
    """Returns the header with plain line ends, and the rest."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    end = _END.search(data[:_MOST_HEADER])
    if data[:3] != b"ply" or end is None:
        raise UserError(source, "", "has no PLY header (ply … end_header), expected a PLY file")
    # only comments may hold other characters, and they are ignored
    header = data[: end.end()].decode("ascii", errors="replace").replace("\ufffd", "?")
    header = header.replace("\r\n", "\n").replace("\r", "\n")
    return header, data[end.end() :]


def _mesh(elements: dict[str, Element], rows: dict[str, Rows], source: str) -> RawMesh:
    if "vertex" not in elements or not {"x", "y", "z"} <= set(elements["vertex"].names):
        raise UserError(source, "element vertex", "lacks x, y, z, expected a PLY file of nodes")
    vertex = rows["vertex"]
    position = np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    if "face" not in elements:
        if "tristrips" in elements:
            raise UserError(source, "element tristrips", "strips are not read, expected faces")
        return RawMesh.of(source, position, np.empty((0, 3), dtype=np.int64))
    lists = [p.name for p in elements["face"].properties if p.counted and p.dtype[0] != "f"]
    name = next((name for name in _LIST_NAMES if name in lists), None)
    if name is None:
        raise UserError(source, "element face", f"lacks a list {' or '.join(_LIST_NAMES)}")
    polygons: list[list[int]] = rows["face"][name]
    _check_polygons(polygons, len(position), source)
    faces, _ = triangulated(position, polygons) if polygons else (_no_faces(), None)
    pair = next((pair for pair in _UV_NAMES if set(pair) <= set(elements["vertex"].names)), None)
    if pair is None:
        return RawMesh.of(source, position, faces)
    uv = np.stack([np.asarray(vertex[name], dtype=np.float64) for name in pair], axis=1)
    return RawMesh.of(source, position, faces, uv=uv[faces])


def _no_faces() -> IndexArray:
    return np.empty((0, 3), dtype=np.int64)


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
