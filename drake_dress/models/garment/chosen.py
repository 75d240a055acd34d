"""Chooses the parts of a file that are the garment: what is taken, without what is left out.

An entry is the name of an object or group; a size of connected parts, such as `<0.05 m` or
`>0.5 m`; or a place such as `near (0.1, 0, 1.2) m` in the file's axes, which means the connected
part nearest to it.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.edges import components
from drake_dress.models.garment.files.raw import MaskArray, RawMesh
from drake_dress.models.garment.files.text import NUMBER, TRIPLE

_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, None: 1.0}
_SIZE = re.compile(rf"([<>])\s*({NUMBER})\s*(m|cm|mm)?")
_PLACE = re.compile(rf"near\s*{TRIPLE}\s*(m|cm|mm)?")
_NAMES_TOLD = 12


@dataclass(frozen=True)
class Chosen:
    """An entry of `take` or `leave_out`.

    Attributes:
        key: the entry's key in the scenario.
        text: the entry.
        sign: `<` or `>` for a size, else empty.
        size: m.
        point: (3,) of a place, m; None for others.
    """

    key: str
    text: str
    sign: str = ""
    size: float = 0.0
    point: tuple[float, ...] | None = None

    @property
    def is_name(self) -> bool:
        """Whether it is the name of an object or group."""
        return not self.sign and self.point is None


def chosen(texts: Sequence[str], key: str, source: str) -> list[Chosen]:
    """Returns the entries of a list.

    Raises:
        UserError: an entry begins like a size or a place and is none.
    """
    entries = []
    for k, text in enumerate(texts):
        at = f"{key}[{k}]"
        size, point = _SIZE.fullmatch(text.strip()), _PLACE.fullmatch(text.strip())
        if size is not None and float(size[2]) > 0.0:
            entry = Chosen(at, text, size[1], float(size[2]) * _METRES[size[3]])
        elif point is not None:
            metres = _METRES[point[4]]
            entry = Chosen(
                at, text, point=tuple(metres * float(word) for word in point.group(1, 2, 3))
            )
        elif re.match(r"\s*([<>]|near\s*\()", text):
            raise UserError(
                source,
                at,
                f"is {text!r}, expected a name, a size such as '<0.05 m', or a place such as "
                "'near (0.1, 0, 1.2) m'",
            )
        else:
            entry = Chosen(at, text)
        entries.append(entry)
    return entries


def by_name(mesh: RawMesh, take: Sequence[Chosen], leave_out: Sequence[Chosen]) -> RawMesh:
    """Returns the mesh with the named parts alone, where only names are taken, or without them.

    Raises:
        UserError: the file has no such name, or nothing is left.
    """
    names = list(dict.fromkeys(name for part in mesh.part_names for name in part))
    for entry in (*take, *leave_out):
        if entry.is_name and entry.text not in names:
            raise UserError(
                mesh.source,
                entry.key,
                f"names {entry.text!r}, which the file lacks, expected {_offer(entry.text, names)}",
            )
    wanted = take if all(entry.is_name for entry in take) else ()
    return _kept(mesh, wanted, [entry for entry in leave_out if entry.is_name])


def by_measure(mesh: RawMesh, take: Sequence[Chosen], leave_out: Sequence[Chosen]) -> RawMesh:
    """Returns the mesh with the connected parts that sizes and places take, or without them.

    Args:
        mesh: in m, with its seams sewn.
        take: all entries; nothing changes if all are names.
        leave_out: all entries.

    Raises:
        UserError: nothing is left.
    """
    wanted = () if all(entry.is_name for entry in take) else take
    return _kept(mesh, wanted, [entry for entry in leave_out if not entry.is_name])


def _kept(mesh: RawMesh, take: Sequence[Chosen], leave_out: Sequence[Chosen]) -> RawMesh:
    keep = np.full(len(mesh.faces), not take)
    for entry in take:
        keep |= _faces_of(mesh, entry)
    key = "take" if not keep.any() else "leave_out"
    for entry in leave_out:
        keep &= ~_faces_of(mesh, entry)
    if not keep.any():
        raise UserError(mesh.source, key, "leaves nothing of the mesh, expected a garment")
    return mesh if keep.all() else mesh.only(keep)


def _faces_of(mesh: RawMesh, entry: Chosen) -> MaskArray:
    if entry.is_name:
        return np.array([entry.text in part for part in mesh.part_names])[mesh.face_part]
    label = components(mesh.faces, len(mesh.position))
    if entry.point is not None:
        used = np.unique(mesh.faces)
        off = np.linalg.norm(mesh.position[used] - np.array(entry.point), axis=1)
        part = np.arange(label.max() + 1) == label[used[np.argmin(off)]]
    else:
        size = _extents(mesh.position, label)
        part = size < entry.size if entry.sign == "<" else size > entry.size
    return np.asarray(part[label[mesh.faces[:, 0]]])


def _extents(position: FloatArray, label: np.ndarray) -> FloatArray:
    """Returns the longest extent of the nodes of each label, in the unit of `position`."""
    low, high = (np.full((label.max() + 1, 3), start) for start in (np.inf, -np.inf))
    np.minimum.at(low, label, position)
    np.maximum.at(high, label, position)
    return np.asarray((high - low).max(axis=1))


def _offer(entry: str, names: Sequence[str]) -> str:
    if not names:
        return "sizes such as '<0.05 m' or places alone: it has no named objects or groups"
    near = difflib.get_close_matches(entry, names, n=1)
    listed = ", ".join(names[:_NAMES_TOLD]) + (", …" if len(names) > _NAMES_TOLD else "")
    return f"{near[0]!r} perhaps; it has {listed}" if near else f"one of {listed}"
