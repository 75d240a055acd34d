"""Leaves out parts of a file, and reports a garment that is in several parts."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.garment.edges import components
from drake_dress.models.garment.files.raw import MaskArray, RawMesh, place
from drake_dress.models.garment.merge import gap_between, seams_sewn
from drake_dress.models.garment.mesh import face_areas

_SIZE = re.compile(r"<\s*(\d+\.?\d*|\.\d+)\s*(m|cm|mm)?")
_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, None: 1.0}
_TOLD = 3  # parts that a message describes one by one
_NAMES_TOLD = 12
# Seam gaps and part sizes that are tried before a message advises one, m.
_GAPS = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3)
_SIZES = (0.01, 0.02, 0.05, 0.1)


def sizes_of(leave_out: Sequence[str], source: str) -> list[float]:
    """Returns the sizes among entries of `leave_out`, such as `<0.05 m`, in m.

    Raises:
        UserError: an entry begins with "<" and is not a size.
    """
    sizes = []
    for k, entry in enumerate(leave_out):
        if entry.startswith("<"):
            match = _SIZE.fullmatch(entry.strip())
            if match is None or float(match[1]) <= 0.0:
                raise UserError(
                    source,
                    f"leave_out[{k}]",
                    f"is {entry!r}, expected a name, or a size such as '<0.05 m'",
                )
            sizes.append(float(match[1]) * _METRES[match[2]])
    return sizes


def without_named(mesh: RawMesh, leave_out: Sequence[str]) -> RawMesh:
    """Returns the mesh without the objects and groups that `leave_out` names.

    Raises:
        UserError: the file has no such name, or nothing is left.
    """
    names = list(dict.fromkeys(name for part in mesh.part_names for name in part))
    dropped = np.zeros(len(mesh.part_names), dtype=bool)
    for k, entry in enumerate(leave_out):
        if entry.startswith("<"):
            continue
        if entry not in names:
            raise UserError(
                mesh.source,
                f"leave_out[{k}]",
                f"names {entry!r}, which the file lacks, expected {_offer(entry, names)}",
            )
        dropped |= [entry in part for part in mesh.part_names]
    if not dropped.any():
        return mesh
    return _left(mesh, ~dropped[mesh.face_part])


def without_small(mesh: RawMesh, size: float) -> RawMesh:
    """Returns the mesh without connected parts whose longest extent is below `size`, m.

    Raises:
        UserError: nothing is left.
    """
    label = components(mesh.faces, len(mesh.position))
    low, high = (np.full((label.max() + 1, 3), start) for start in (np.inf, -np.inf))
    np.minimum.at(low, label, mesh.position)
    np.maximum.at(high, label, mesh.position)
    keep = (high - low).max(axis=1) >= size
    return mesh if keep.all() else _left(mesh, keep[label[mesh.faces[:, 0]]])


def check_one_part(mesh: RawMesh) -> None:
    """Checks that the mesh is connected.

    Raises:
        UserError: it is in several parts. The message gives their sizes and places, and the keys
            that would leave one part.
    """
    label = components(mesh.faces, len(mesh.position))
    count = int(label.max()) + 1
    if count == 1:
        return
    area = np.bincount(
        label[mesh.faces[:, 0]], face_areas(mesh.position, mesh.faces), minlength=count
    )
    order = np.argsort(-area, kind="stable")
    main = mesh.position[label == order[0]]
    told = [
        f"{len(main)} nodes {_size(main)}{place(main.mean(axis=0))}{_name(mesh, label, order[0])}"
    ]
    for part in order[1 : 1 + _TOLD]:
        nodes = mesh.position[label == part]
        told.append(
            f"{len(nodes)} nodes {_size(nodes)}{place(nodes.mean(axis=0))}, "
            f"{_length(gap_between(nodes, main))} from the first{_name(mesh, label, part)}"
        )
    more = f"; and {count - 1 - _TOLD} more" if count > 1 + _TOLD else ""
    raise UserError(
        mesh.source,
        "faces",
        f"the mesh falls into {count} separate parts, expected one: {'; '.join(told)}{more}; "
        f"{_advice(mesh)}",
    )


def _left(mesh: RawMesh, keep: MaskArray) -> RawMesh:
    if not keep.any():
        raise UserError(mesh.source, "leave_out", "leaves nothing of the mesh, expected a garment")
    return mesh.only(keep)


def _offer(entry: str, names: Sequence[str]) -> str:
    if not names:
        return "sizes such as '<0.05 m' alone: it has no named objects or groups"
    near = difflib.get_close_matches(entry, names, n=1)
    listed = ", ".join(names[:_NAMES_TOLD]) + (", …" if len(names) > _NAMES_TOLD else "")
    return f"{near[0]!r} perhaps; it has {listed}" if near else f"one of {listed}"


def _advice(mesh: RawMesh) -> str:
    """Returns the keys that would leave one part; each is first tried on the mesh."""
    advice = []
    for gap in _GAPS:
        sewn = seams_sewn(mesh, gap)
        if int(components(sewn.faces, len(sewn.position)).max()) == 0:
            advice.append(f"garment.mesh.weld: {gap:g} joins them")
            break
    for size in _SIZES:
        small = without_small(mesh, size)
        if int(components(small.faces, len(small.position)).max()) == 0:
            advice.append(f"garment.mesh.leave_out: ['<{size:g} m'] leaves the first alone")
            break
    return " and ".join(advice) or (
        "leave parts out with garment.mesh.leave_out, or join seams with garment.mesh.weld"
    )


def _name(mesh: RawMesh, label: np.ndarray, part: int) -> str:
    face = int(np.argmax(label[mesh.faces[:, 0]] == part))
    names = mesh.part_names[mesh.face_part[face]]
    return f" ({names[0]})" if names else ""


def _size(nodes: np.ndarray) -> str:
    return f"{_length(float(np.ptp(nodes, axis=0).max()))} wide"


def _length(metres: float) -> str:
    if metres < 1e-3:
        return f"{1e3 * metres:.2g} mm"
    return f"{1e2 * metres:.1f} cm" if metres < 1.0 else f"{metres:.2f} m"
