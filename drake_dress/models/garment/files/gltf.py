"""Reads glTF 2.0 files, `.gltf` and `.glb`, by trimesh.

trimesh passes over what it does not understand: it leaves zeros where positions are compressed,
sparse or missing, and skips triangle fans and lines. All of these are refused before it is asked.
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from trimesh.resolvers import FilePathResolver

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.files.raw import RawMesh, too_many

_MAGIC, _JSON, _HEADER = b"glTF", 0x4E4F534A, 20  # bytes
# Extensions that change where positions are found or what they mean.
_UNREADABLE = {
    "KHR_draco_mesh_compression": "Draco compression",
    "EXT_meshopt_compression": "meshopt compression",
    "KHR_meshopt_compression": "meshopt compression",
}
_TRIANGLES, _STRIP = 4, 5
_NUMBERS = {5120: "int8", 5121: "uint8", 5122: "int16", 5123: "uint16", 5126: "float32"}
_MODES = {0: "points", 1: "lines", 2: "line loops", 3: "line strips", 6: "triangle fans"}


def read_gltf(data: bytes, path: Path, most_faces: int) -> RawMesh:
    """Returns all triangles of a file's scene, each mesh where the scene's nodes place it.

    Nodes are counted in the order of the scene's meshes.

    Args:
        data: content of the file.
        path: the file; buffers of its own lie relative to it.
        most_faces: number of triangles above which the file is refused.

    Raises:
        UserError: the file is damaged, compressed, or holds what cannot be read.
    """
    source = str(path)
    header = _header(data, source)
    _check(header, source)
    try:
        scene = trimesh.load_scene(
            io.BytesIO(_plain(data, header)),
            file_type="glb" if data[:4] == _MAGIC else "gltf",
            resolver=FilePathResolver(source),
            process=False,
        )
    except Exception as error:
        # trimesh raises whatever NumPy, json or the file system raise, also a plain AssertionError
        told = str(error).partition("\n")[0] or type(error).__name__
        raise UserError(source, "", f"is no sound glTF file: {told}") from error
    positions: list[np.ndarray] = [np.empty((0, 3))]
    faces: list[np.ndarray] = [np.empty((0, 3), dtype=np.int64)]
    parts: list[np.ndarray] = [np.empty(0, dtype=np.int64)]
    textures: list[np.ndarray] = [np.empty((0, 3, 2))]
    names: list[tuple[str, ...]] = []
    count = 0
    for node in scene.graph.nodes_geometry:
        placed, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        own = np.asarray(mesh.faces, dtype=np.int64)
        if np.linalg.det(placed[:3, :3]) < 0.0:
            own = own[:, ::-1]
        if len(own) and not 0 <= own.min() <= own.max() < len(mesh.vertices):
            raise UserError(source, f"mesh {name!r}", "names vertices that it lacks")
        positions.append(np.asarray(mesh.vertices) @ placed[:3, :3].T + placed[:3, 3])
        faces.append(own + count)
        textures.append(_texture(mesh)[own])
        parts.append(np.full(len(own), len(names)))
        names.append(tuple(dict.fromkeys((str(node), str(name)))))
        count += len(mesh.vertices)
        if sum(map(len, faces)) > most_faces:
            raise too_many(source, most_faces)
    return RawMesh.of(
        source,
        np.concatenate(positions),
        np.concatenate(faces),
        face_part=np.concatenate(parts),
        part_names=tuple(names) or ((),),
        uv=np.concatenate(textures),
    )


def _texture(mesh: trimesh.Trimesh) -> FloatArray:
    """Returns (n,2) texture coordinates of a mesh's vertices; NaN if it has none."""
    uv = getattr(mesh.visual, "uv", None)
    if uv is None or np.shape(uv) != (len(mesh.vertices), 2):
        return np.full((len(mesh.vertices), 2), np.nan)
    return np.asarray(uv, dtype=np.float64)


def _plain(data: bytes, header: Mapping[str, Any]) -> bytes:
    """Returns the file with one material without images, since trimesh ties textures to these."""
    plain = {key: value for key, value in header.items() if key not in ("images", "textures")}
    plain["materials"] = [{}]
    plain["meshes"] = [
        {**mesh, "primitives": [{**primitive, "material": 0} for primitive in mesh["primitives"]]}
        for mesh in header.get("meshes", ())
    ]
    text = json.dumps(plain).encode()
    if data[:4] != _MAGIC:
        return text
    text += b" " * (-len(text) % 4)
    (first,) = struct.unpack_from("<I", data, 12)
    rest = data[_HEADER + first :]
    length = _HEADER + len(text) + len(rest)
    return struct.pack("<4s4I", _MAGIC, 2, length, len(text), _JSON) + text + rest


def _header(data: bytes, source: str) -> Mapping[str, Any]:
    text = data
    if data[:4] == _MAGIC:
        if len(data) < _HEADER:
            raise UserError(source, "", f"{len(data)} bytes are too few for a GLB file")
        version, length, first, kind = struct.unpack_from("<4I", data, 4)
        if version != 2:
            raise UserError(source, "", f"is glTF {version}, expected 2")
        if length > len(data) or kind != _JSON:
            raise UserError(
                source, "", f"is cut off: {len(data)} bytes of {length}, expected a GLB file"
            )
        text = data[_HEADER : _HEADER + first]
    try:
        header = json.loads(text.decode("utf-8-sig"))
    except ValueError as error:
        raise UserError(source, "", f"is no glTF file: {error}") from error
    except RecursionError as error:
        raise UserError(source, "", "is no glTF file: brackets in brackets") from error
    if not isinstance(header, dict):
        raise UserError(source, "", "is no glTF file, expected an object of JSON")
    return header


def _check(header: Mapping[str, Any], source: str) -> None:
    """Checks that trimesh reads all positions of the file.

    Raises:
        UserError: it would not. The message says what to export instead.
    """
    try:
        asked = [*header.get("extensionsUsed", ()), *header.get("extensionsRequired", ())]
        for name, told in _UNREADABLE.items():
            if name in asked:
                raise UserError(
                    source, "", f"has {told} ({name}), which is not read: export it without"
                )
        for name, attributes, mode in _primitives(header):
            key = f"mesh {name!r}"
            if mode not in (_TRIANGLES, _STRIP):
                told = _MODES.get(mode, f"mode {mode}")
                raise UserError(source, key, f"has {told}, expected triangles: export them alone")
            if "POSITION" not in attributes:
                raise UserError(source, key, "has no positions")
            place = header["accessors"][attributes["POSITION"]]
            if "sparse" in place or "bufferView" not in place:
                raise UserError(source, key, "has sparse or absent positions, which are not read")
            if place.get("normalized"):
                raise UserError(
                    source,
                    key,
                    f"has positions as fractions of {_NUMBERS.get(place['componentType'])}, which "
                    "are not read: export it without quantization",
                )
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise UserError(source, "", f"is no sound glTF file: {error!r}") from error


def _primitives(header: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, int], int]]:
    """Yields mesh name, attributes and mode of all primitives."""
    for k, mesh in enumerate(header.get("meshes", ())):
        for primitive in mesh["primitives"]:
            mode = primitive.get("mode", _TRIANGLES)
            yield str(mesh.get("name", k)), primitive["attributes"], mode
