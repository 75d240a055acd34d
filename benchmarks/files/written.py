"""Writes surfaces as files the way that other programs do."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.fans import HalfEdges

# A surface and the name of its object or mesh.
Part = tuple[str, FloatArray, IntArray]


def obj(path: Path, parts: Sequence[Part], *, quads: bool = False, relative: bool = False) -> Path:
    """Writes an OBJ with an object for each part, as CR LF lines with normals.

    Args:
        path: the file.
        parts: in the file's unit and axes.
        quads: whether pairs of triangles are written as quads.
        relative: whether nodes are counted back from the last one.
    """
    lines, count = ["# made for a study", "vn 0 0 1"], 0
    for name, x, faces in parts:
        lines.append(f"o {name}")
        lines += [f"v {a:.6f} {b:.6f} {c:.6f}" for a, b, c in x.tolist()]
        shift = -len(x) if relative else count + 1
        count += len(x)
        for polygon in as_quads(faces) if quads else faces.tolist():
            lines.append("f " + " ".join(f"{node + shift}//1" for node in polygon))
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode())
    return path


def as_quads(faces: IntArray) -> list[list[int]]:
    """Returns polygons in which neighbouring triangles are joined in pairs, as far as they go."""
    edges = HalfEdges.of(faces.astype(np.int64), int(faces.max()) + 1)
    free = np.ones(len(faces), dtype=bool)
    polygons = []
    for one, other in edges.pairs():
        first, second = edges.face[one], edges.face[other]
        if not (free[first] and free[second]):
            continue
        free[[first, second]] = False
        a, b, c = _rotated(faces[first].tolist(), edges.ends[edges.edge[one]].tolist())
        last = next(node for node in faces[second].tolist() if node not in (a, b))
        polygons.append([a, last, b, c])
    return polygons + faces[free].tolist()


def _rotated(face: list[int], ends: list[int]) -> list[int]:
    """Returns a triangle that begins with the edge of two nodes."""
    return next(
        turned for turned in (face[k:] + face[:k] for k in range(3)) if set(turned[:2]) == set(ends)
    )


def stl(path: Path, x: FloatArray, faces: IntArray) -> Path:
    """Writes a binary STL, in which each triangle has nodes of its own."""
    record = np.zeros(len(faces), dtype=[("n", "<f4", 3), ("x", "<f4", (3, 3)), ("a", "<u2")])
    record["x"] = x[faces]
    path.write_bytes(b"solid by a scanner".ljust(80) + struct.pack("<I", len(faces)))
    with path.open("ab") as file:
        file.write(record.tobytes())
    return path


def ply(path: Path, x: FloatArray, faces: IntArray) -> Path:
    """Writes a binary PLY with the largest bytes first, and colours."""
    head = (
        f"ply\nformat binary_big_endian 1.0\ncomment scan\nelement vertex {len(x)}\n"
        "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    nodes = np.zeros(len(x), dtype=[("x", ">f4", 3), ("red", "u1")])
    nodes["x"] = x
    rows = np.zeros(len(faces), dtype=[("count", "u1"), ("node", ">i4", 3)])
    rows["count"], rows["node"] = 3, faces
    path.write_bytes(head.encode() + nodes.tobytes() + rows.tobytes())
    return path


def glb(path: Path, parts: Sequence[Part]) -> Path:
    """Writes a binary glTF with a mesh for each part."""
    scene = trimesh.Scene()
    for name, x, faces in parts:
        mesh = trimesh.Trimesh(x, faces, process=False)
        scene.add_geometry(mesh, node_name=name, geom_name=f"{name}_mesh")
    path.write_bytes(scene.export(file_type="glb"))
    return path


def draco(path: Path, parts: Sequence[Part]) -> Path:
    """Writes a glTF whose header says that its meshes are compressed by Draco."""
    data = glb(path, parts).read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    header = json.loads(data[20 : 20 + length])
    name = "KHR_draco_mesh_compression"
    header["extensionsUsed"] = header["extensionsRequired"] = [name]
    for mesh in header["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["extensions"] = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}
    for accessor in header["accessors"]:
        accessor.pop("bufferView", None)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    total = 20 + len(text) + len(rest)
    path.write_bytes(struct.pack("<4s4I", b"glTF", 2, total, len(text), 0x4E4F534A) + text + rest)
    return path
