"""Loads a user's own garment: a file of triangles becomes a labelled mesh, or a reason why not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from drake_dress.errors import UserError
from drake_dress.models.garment.mesh import (
    LOOP_NAMES,
    REGION_NAMES,
    SIDES,
    FloatArray,
    GarmentMesh,
    IntArray,
    check_loop,
    check_manifold,
    check_positions,
)
from drake_dress.models.garment.openings import beyond, find_armhole, find_cuffs, ordered
from drake_dress.models.garment.simplify import to_spacing

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
EXTENSIONS = (".obj", ".ply", ".stl")
DIAGONAL_RANGE = (0.5, 3.0)  # of a garment's bounding box, m
SPACING_RANGE = (0.005, 0.1)  # m

_MERGE = 1e-7  # nodes nearer than this by the size of the mesh are one
_GRASP_COUNT = 10  # nodes per gripper, where none are named
_GRASP_INSET = 0.035  # from the shoulder tip toward the neck, m


def load_garment(
    path: str | Path,
    *,
    unit: str,
    spacing: float | None = None,
    loops: Mapping[str, Sequence[int]] | None = None,
    grasp: Mapping[str, Sequence[int]] | None = None,
) -> GarmentMesh:
    """Returns the garment of an OBJ, PLY or STL file, in the pose of `GarmentMesh`.

    The file shows the garment facing +x, its left at +y, z up, with the sleeves sideways; it is
    moved so that the origin is the midpoint between the highest nodes of the armholes. Duplicate
    nodes are merged, nodes of no face dropped, and faces turned outward if all point inward.

    Args:
        path: of the file.
        unit: of its coordinates, `m`, `cm` or `mm`.
        spacing: wanted mean edge length, m; None keeps the mesh as it is.
        loops: nodes of the file, counted from 0, in order around each opening of `LOOP_NAMES`;
            those not named are looked for (see `openings`). In an STL, which lists a node once
            per triangle, any of the copies may be named.
        grasp: nodes of the file that the `left` and `right` gripper hold; by default the ten
            nodes nearest to a point 3.5 cm inward of the armhole's highest node.

    Raises:
        UserError: in one line what cannot be used: the file, its format or unit, an empty,
            non-finite or non-manifold mesh, loops that are absent or not closed, wrong indices.
    """
    source = str(path)
    factor = _check_arguments(source, unit, spacing, loops, grasp)
    raw, triangles = _read(Path(path))
    check_positions(raw, source)
    raw = raw * factor
    _check_size(raw, triangles, unit, source)
    position, faces, became = _merged(raw, triangles)
    check_manifold(faces, len(position), source)
    faces = _outward(position, faces)

    named = {
        name: _mapped(nodes, became, source, f"loops.{name}")
        for name, nodes in (loops or {}).items()
    }
    held = {
        side: _mapped(nodes, became, source, f"grasp.{side}")
        for side, nodes in (grasp or {}).items()
    }
    for name, loop in named.items():
        check_loop(loop, faces, len(position), source, f"loops.{name}")
    if not all(f"{side}_cuff" in named for side in SIDES):
        named = {**find_cuffs(position, faces, source), **named}
    for side in SIDES:
        name = f"{side}_armhole"
        if name not in named:
            named[name] = find_armhole(position, faces, named[f"{side}_cuff"], source, name)
    # checked before the mesh is thinned, so that a message names what the user gave
    _labelled(position, faces, named, held).validate(source)
    if spacing is not None:
        names = list(named)
        position, faces, chains, merged = to_spacing(
            position, faces, [named[name] for name in names], spacing
        )
        named = dict(zip(names, chains, strict=True))
        held = {side: np.unique(merged[nodes]) for side, nodes in held.items()}
        check_manifold(faces, len(position), source)
    mesh = _labelled(position, faces, named, held)
    mesh.validate(source)
    return mesh


def _check_arguments(
    source: str,
    unit: str,
    spacing: float | None,
    loops: Mapping[str, Sequence[int]] | None,
    grasp: Mapping[str, Sequence[int]] | None,
) -> float:
    if unit not in UNITS:
        raise UserError(source, "unit", f"is {unit!r}, expected one of {', '.join(UNITS)}")
    low, high = SPACING_RANGE
    if spacing is not None and not low <= spacing <= high:
        raise UserError(source, "spacing", f"is {spacing} m, expected {low} to {high} m")
    for key, given, known in (("loops", loops, LOOP_NAMES), ("grasp", grasp, SIDES)):
        for name in given or {}:
            if name not in known:
                raise UserError(source, f"{key}.{name}", f"unknown, expected {', '.join(known)}")
    return UNITS[unit]


def _read(path: Path) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    source = str(path)
    if path.suffix.lower() not in EXTENSIONS:
        raise UserError(
            source, "", f"unknown format {path.suffix!r}, expected {', '.join(EXTENSIONS)}"
        )
    if not path.is_file():
        raise UserError(source, "", "no such file, expected a triangle mesh")
    if path.stat().st_size == 0:
        raise UserError(source, "", "the file is empty, expected a triangle mesh")
    try:
        mesh = trimesh.load(
            path, process=False, force="mesh", maintain_order=True, group_material=False
        )
    # an OBJ in no plain encoding: trimesh looks for an optional package that guesses it
    except ImportError as error:
        raise UserError(source, "", "is not text, expected an OBJ in UTF-8") from error
    # trimesh's readers raise whatever their parsing stumbles on
    except Exception as error:  # noqa: BLE001
        reason = str(error) or type(error).__name__
        raise UserError(source, "", f"cannot be read as {path.suffix[1:]}: {reason}") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise UserError(source, "faces", "the mesh is empty, expected at least one triangle")
    position = np.array(mesh.vertices, dtype=np.float64)
    faces = np.array(mesh.faces, dtype=np.int64)
    if faces.min() < 0 or faces.max() >= len(position):
        raise UserError(
            source,
            "faces",
            f"node indices reach from {faces.min()} to {faces.max()}, expected 0 to "
            f"{len(position) - 1}",
        )
    return position, faces


def _check_size(position: FloatArray, faces: npt.NDArray[np.int64], unit: str, source: str) -> None:
    used = position[np.unique(faces)]
    diagonal = float(np.linalg.norm(np.ptp(used, axis=0)))
    low, high = DIAGONAL_RANGE
    if not low <= diagonal <= high:
        better = [
            name for name, factor in UNITS.items() if low <= diagonal * factor / UNITS[unit] <= high
        ]
        hint = f"; with {better[0]} it would fit" if better else ""
        raise UserError(
            source,
            "unit",
            f"in {unit} the garment's bounding box has a diagonal of {diagonal:.3g} m, expected "
            f"{low} to {high} m (wrong unit?){hint}",
        )


def _merged(
    position: FloatArray, faces: npt.NDArray[np.int64]
) -> tuple[FloatArray, IntArray, npt.NDArray[np.int64]]:
    """Merges nodes at the same place and drops unused ones; -1 stands for a dropped node."""
    cell = np.round(position / (_MERGE * np.ptp(position, axis=0).max())).astype(np.int64)
    _, first, group = np.unique(cell, axis=0, return_index=True, return_inverse=True)
    faces = group.reshape(-1)[faces]
    # faces that merging has closed up: seams of zero width
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    faces = faces[~flat]
    used = np.unique(faces)
    used = used[np.argsort(first[used])]  # in the file's order
    new = np.full(len(first), -1)
    new[used] = np.arange(len(used))
    return position[first[used]], new[faces].astype(np.int32), new[group.reshape(-1)]


def _outward(position: FloatArray, faces: IntArray) -> IntArray:
    a, b, c = (position[faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    center = np.average((a + b + c) / 3, axis=0, weights=np.linalg.norm(area, axis=1) + 1e-15)
    if float((area * ((a + b + c) / 3 - center)).sum()) < 0.0:
        return np.ascontiguousarray(faces[:, ::-1])
    return faces


def _mapped(nodes: Sequence[int], became: npt.NDArray[np.int64], source: str, key: str) -> IntArray:
    given = np.asarray(nodes)
    if given.ndim != 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise UserError(source, key, "expected a list of node indices (whole numbers)")
    if given.min() < 0 or given.max() >= len(became):
        raise UserError(
            source,
            key,
            f"node indices reach from {given.min()} to {given.max()}, expected 0 to "
            f"{len(became) - 1}",
        )
    mapped = became[given]
    if mapped.min() < 0:
        raise UserError(source, key, f"node {given[np.argmin(mapped)]} belongs to no face")
    return mapped.astype(np.int32)


def _labelled(
    position: FloatArray,
    faces: IntArray,
    loops: Mapping[str, IntArray],
    grasp: Mapping[str, IntArray],
) -> GarmentMesh:
    """Names the regions and grasp patches and moves the origin between the shoulder tips."""
    named = {name: ordered(position, loops[name]) for name in LOOP_NAMES}
    region = np.zeros(len(position), dtype=np.int8)
    for side in SIDES:
        sleeve = beyond(faces, len(position), named[f"{side}_armhole"], named[f"{side}_cuff"])
        region[sleeve] = REGION_NAMES.index(f"{side}_sleeve")
    tips = np.stack([position[named[f"{side}_armhole"][0]] for side in SIDES])
    inward = (tips[::-1] - tips) / max(float(np.linalg.norm(tips[0] - tips[1])), 1e-9)
    held = dict(grasp)
    for k, side in enumerate(SIDES):
        if side not in held:
            far = np.linalg.norm(position - (tips[k] + _GRASP_INSET * inward[k]), axis=1)
            held[side] = np.argsort(far, kind="stable")[:_GRASP_COUNT].astype(np.int32)
    return GarmentMesh(position - tips.mean(axis=0), faces, named, held, region)
