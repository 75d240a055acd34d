"""The garment of a scenario."""

from __future__ import annotations

import sys
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path

from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.coat import coat_parameters
from drake_dress.diagrams.shown_when_slow import ShownWhenSlow
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import make_coat
from drake_dress.models.garment.front import Opening, front_of
from drake_dress.models.garment.hold import held_at_edges
from drake_dress.models.garment.load import Progress, WholeGarment, read_garment
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.mesh_options import MeshOptions

_MOST_KEPT = 4  # mesh files kept in memory
_kept: OrderedDict[tuple[object, ...], WholeGarment] = OrderedDict()


def build_garment(garment: schema.Garment, spacing: float, base: Path) -> GarmentMesh:
    """Returns the garment meshed at `spacing`, m.

    Recently used mesh files are cached: an unchanged file is read and checked once, for all
    spacings.

    Args:
        garment: pattern or mesh file.
        spacing: wanted edge length, m.
        base: directory that a mesh file's name is relative to.

    Raises:
        UserError: measures contradict each other, or the file cannot be used.
    """
    if garment.mesh is not None:
        with ShownWhenSlow(garment.mesh.file) as progress:
            whole, is_new = _read_once(base / garment.mesh.file, garment.mesh, progress)
            mesh = whole.at_spacing(spacing, progress)
        _tell_notes(garment.mesh.file, whole, is_new)
    else:
        mesh = make_coat(coat_parameters(garment.coat), spacing, source="garment.coat")
    return as_held(mesh, garment)


def as_held(mesh: GarmentMesh, garment: schema.Garment) -> GarmentMesh:
    """Returns a garment, built with its own default grasp, held where the scenario says.

    Raises:
        UserError: it cannot be held there.
    """
    if garment.hold == "shoulders":
        return mesh
    source = "garment.coat" if garment.mesh is None else garment.mesh.file
    return held_at_edges(mesh, garment.hold_depth, source)


def read_whole(mesh: schema.Mesh, base: Path) -> WholeGarment:
    """Returns a garment at the resolution of its file; cached as by `build_garment`.

    Args:
        mesh: the file and its keys.
        base: directory that the file's name is relative to.

    Raises:
        UserError: the file cannot be used.
    """
    with ShownWhenSlow(mesh.file) as progress:
        whole, is_new = _read_once(base / mesh.file, mesh, progress)
    _tell_notes(mesh.file, whole, is_new)
    return whole


def _tell_notes(file: str, whole: WholeGarment, is_new: bool) -> None:
    """Tells on stderr what was mended in a file, when it is read for the first time."""
    for note in whole.notes if is_new else ():
        print(f"{file}: {note}", file=sys.stderr)


def build_garment_like(
    garment: schema.Garment, nominal: schema.Garment, spacing: float, base: Path
) -> GarmentMesh:
    """Returns a garment on the nodes that the nominal garment has at `spacing`, m.

    A variation draws garments of different sizes, and meshing each by itself would give different
    numbers of nodes. Meshes from this function all have the nodes of the nominal garment, each at
    the same place of the pattern.

    Args:
        garment: pattern or mesh file, drawn from `nominal` by a variation.
        nominal: the same pattern or file before the draw.
        spacing: wanted edge length of the nominal garment, m.
        base: directory that a mesh file's name is relative to.

    Raises:
        UserError: measures contradict each other, or the file cannot be used.
    """
    if garment.mesh is not None and nominal.mesh is not None:
        mesh = build_garment(nominal, spacing, base)
        return mesh.scaled(garment.mesh.scale / nominal.mesh.scale)
    like = coat_parameters(nominal.coat)
    mesh = make_coat(coat_parameters(garment.coat), spacing, source="garment.coat", like=like)
    if garment.hold == "shoulders":
        return mesh
    like_it = build_garment(nominal, spacing, base)
    return replace(mesh, grasp=like_it.grasp, hold=like_it.hold)


def check_opening(mesh: GarmentMesh, side: str, source: str) -> None:
    """Checks that an open garment opens toward the person.

    Args:
        mesh: the garment.
        side: where it is: `behind` the person or in `front`.
        source: the scenario, for the message.

    Raises:
        UserError: it does not.
    """
    toward: dict[Opening, str] = {"front": "behind", "back": "front"}
    opening = front_of(mesh)
    if opening == "closed" or toward[opening] == side:
        return
    raise UserError(
        source,
        "station.side",
        f"is {side}, but the garment opens at the {opening}, expected {toward[opening]} (or change "
        "garment.mesh.facing or garment.coat.opens)",
    )


def _read_once(path: Path, mesh: schema.Mesh, progress: Progress) -> tuple[WholeGarment, bool]:
    """Returns the garment of a file, and whether the file was read now."""
    key = _identity(path, mesh)
    if key is not None and key in _kept:
        _kept.move_to_end(key)
        return _kept[key], False
    whole = read_garment(
        path,
        MeshOptions(
            unit=mesh.unit,
            scale=mesh.scale,
            up=mesh.up,
            facing=mesh.facing,
            weld=mesh.weld,
            front=mesh.front,
            rest=mesh.rest,
            take=tuple(mesh.take),
            leave_out=tuple(mesh.leave_out),
            loops=mesh.loops,
            grasp=mesh.grasp,
        ),
        progress,
    )
    if key is not None:
        _kept[key] = whole
        while len(_kept) > _MOST_KEPT:
            _kept.popitem(last=False)
    return whole, True


def _identity(path: Path, mesh: schema.Mesh) -> tuple[object, ...] | None:
    """Returns a key that changes with the file and its options; None if there is no file."""
    try:
        state = path.stat()
    except (OSError, ValueError):
        return None
    return (str(path), state.st_ino, state.st_mtime_ns, state.st_size, repr(mesh))
