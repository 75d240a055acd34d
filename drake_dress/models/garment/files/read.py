"""Reads a mesh file by its extension, within limits of size."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.garment.files.gltf import read_gltf
from drake_dress.models.garment.files.obj import read_obj
from drake_dress.models.garment.files.pattern import read_pattern
from drake_dress.models.garment.files.ply import read_ply
from drake_dress.models.garment.files.raw import RawMesh, too_many
from drake_dress.models.garment.files.stl import read_stl

EXTENSIONS = (".obj", ".ply", ".stl", ".gltf", ".glb", ".json")
# Other formats that garments come in, and how to turn them.
_OTHERS = {
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), "a USD stage"),
    **dict.fromkeys((".fbx", ".dae", ".blend", ".abc", ".3ds"), "a scene of another program"),
    **dict.fromkeys((".zprj", ".zpac"), "a project of CLO or Marvelous Designer"),
}
# A scan of a garment has some 100,000. This many take about half a minute to read and simplify.
MOST_TRIANGLES = 200_000
_LARGEST = 1e9  # coordinate in any unit: no garment is larger, and huge numbers overflow if squared
_MOST_BYTES = 200 * 10**6


def read_mesh(path: Path, progress: Callable[[float], None] = lambda _share: None) -> RawMesh:
    """Returns the triangles of an OBJ, PLY, STL or glTF file, or of a sewing pattern.

    Args:
        path: the file.
        progress: called with the share that is done while a pattern takes its shape.

    Raises:
        UserError: the file is absent, unreadable, too large, not of its format, or without
            triangles; or a coordinate is not finite.
    """
    source = str(path)
    data = _content(path)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # numpy warns of damaged numbers, which are checked below
        if path.suffix.lower() == ".obj":
            mesh = read_obj(data, source, MOST_TRIANGLES)
        elif path.suffix.lower() == ".ply":
            mesh = read_ply(data, source, MOST_TRIANGLES)
        elif path.suffix.lower() == ".stl":
            mesh = read_stl(data, source, MOST_TRIANGLES)
        elif path.suffix.lower() == ".json":
            mesh = read_pattern(data, source, MOST_TRIANGLES, progress)
        else:
            mesh = read_gltf(data, path, MOST_TRIANGLES)
    if len(mesh.faces) == 0:
        raise UserError(source, "faces", "the mesh is empty, expected at least one triangle")
    if len(mesh.faces) > MOST_TRIANGLES:
        raise too_many(source, MOST_TRIANGLES)
    bad = np.flatnonzero(~(np.abs(mesh.position) < _LARGEST).all(axis=1))
    if len(bad):
        raise UserError(
            source,
            "nodes",
            f"{len(bad)} of {len(mesh.position)} hold NaN, infinity or numbers beyond "
            f"{_LARGEST:g}, the first is {mesh.node(bad[0])}",
        )
    return mesh


def _content(path: Path) -> bytes:
    source = str(path)
    if path.suffix.lower() not in EXTENSIONS:
        kind = _OTHERS.get(path.suffix.lower())
        told = (
            f"unknown format {path.suffix!r}" if kind is None else f"is {kind}, which is not read"
        )
        how = "" if kind is None else "; export it as glTF or OBJ, with Blender for instance"
        raise UserError(source, "", f"{told}, expected {', '.join(EXTENSIONS)}{how}")
    try:
        if not path.is_file():
            raise UserError(source, "", "no such file, expected a triangle mesh")
        size = path.stat().st_size
        if size == 0:
            raise UserError(source, "", "the file is empty, expected a triangle mesh")
        if size > _MOST_BYTES:
            raise UserError(
                source,
                "",
                f"has {size / 1e6:,.0f} MB, expected at most {_MOST_BYTES / 1e6:.0f} MB",
            )
        return path.read_bytes()
    except OSError as error:
        raise UserError(source, "", f"cannot be read: {error.strerror}") from error
