"""Reports a garment that is in several parts, with their kind and the keys that would leave one.

Parts are panels that are not sewn, layers that lie on each other, or a garment with other things.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from drake_dress.errors import UserError
from drake_dress.models.garment.chosen import by_measure, chosen
from drake_dress.models.garment.edges import components, unique_edges
from drake_dress.models.garment.files.raw import RawMesh, place
from drake_dress.models.garment.layers import THICKEST, other_layer
from drake_dress.models.garment.merge import gap_between, seams_sewn
from drake_dress.models.garment.mesh import face_areas

_TOLD = 3  # parts that a message describes one by one
# Seam gaps and part sizes that are tried before a message advises one, m.
_GAPS = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3, 1e-2, 2e-2)
_SIZES = (0.01, 0.02, 0.05, 0.1)
# Least share of the area that a panel or a layer has; smaller parts are buttons and pockets.
_LARGE = 0.03
_DOUBLE = 0.5  # share of the area that has another layer, above which two parts are layers
_FLAT = 0.01  # thickness over width of panels that lie in one plane


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
    _check_kind(mesh, label, area)
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
        f"{_advice(mesh, label, order[0])}",
    )


def _check_kind(mesh: RawMesh, label: np.ndarray, area: np.ndarray) -> None:
    """Raises UserError if the large parts are panels that are not sewn, or layers."""
    large = np.flatnonzero(area > _LARGE * area.sum())
    if len(large) < 2:
        return
    panels = [int(part) for part in large if _is_disk(mesh, label, int(part))]
    first = int(large[np.argmax(area[large])])
    if first in panels and len(panels) > 1:
        raise UserError(mesh.source, "faces", _of_panels(mesh, label, large.tolist()))
    of_face = label[mesh.faces[:, 0]]
    two = np.sort(large[np.argsort(-area[large], kind="stable")][:2])
    both = np.isin(of_face, two)
    share, gap = other_layer(mesh.position, mesh.faces[both], of_face[both])
    if share > _DOUBLE:
        taken = _where(mesh, label, first)
        raise UserError(
            mesh.source,
            "faces",
            f"the garment has two layers, such as a lining, {_length(gap)} apart over "
            f"{100 * share:.0f} % of them: {_told(mesh, label, two[0])} and "
            f"{_told(mesh, label, two[1])}, expected one layer; garment.mesh.take: ['{taken}'] "
            "takes one",
        )


def _is_disk(mesh: RawMesh, label: np.ndarray, part: int) -> bool:
    """Returns whether a part has one border and no handle, as a panel has."""
    faces = mesh.faces[label[mesh.faces[:, 0]] == part]
    return len(np.unique(faces)) - len(unique_edges(faces)) + len(faces) == 1


def _of_panels(mesh: RawMesh, label: np.ndarray, panels: Sequence[int]) -> str:
    """Returns the message on parts that are panels."""
    told = "; ".join(_told(mesh, label, part) for part in panels[:2])
    nodes = mesh.position[np.isin(label, panels)]
    extent = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
    if extent[2] < _FLAT * extent[0]:
        return (
            f"these are {len(panels)} flat pattern pieces in one plane, not a garment: {told}; "
            "expected it sewn and draped (export it so from the program that made it)"
        )
    gap = _gap_that_joins(mesh)
    advice = (
        f"expected them sewn; garment.mesh.weld: {gap:g} joins them"
        if gap is not None
        else f"their edges do not match within {100 * THICKEST:g} cm, so weld cannot join them, "
        "expected them sewn (in the program that made them)"
    )
    return f"the garment is {len(panels)} panels that are not sewn: {told}; {advice}"


def _told(mesh: RawMesh, label: np.ndarray, part: int) -> str:
    nodes = mesh.position[label == part]
    return f"{_size(nodes)}{place(nodes.mean(axis=0))}{_name(mesh, label, part)}"


def _gap_that_joins(mesh: RawMesh) -> float | None:
    """Returns the least distance of `weld` that leaves one part; None if there is none."""
    for gap in _GAPS:
        sewn = seams_sewn(mesh, gap)
        if int(components(sewn.faces, len(sewn.position)).max()) == 0:
            return gap
    return None


def _advice(mesh: RawMesh, label: np.ndarray, first: int) -> str:
    """Returns the keys that would leave one part; each is first tried on the mesh."""
    advice = []
    gap = _gap_that_joins(mesh)
    if gap is not None:
        advice.append(f"garment.mesh.weld: {gap:g} joins them")
    for size in _SIZES:
        entry = f"<{size:g} m"
        small = by_measure(mesh, (), chosen([entry], "leave_out", mesh.source))
        if int(components(small.faces, len(small.position)).max()) == 0:
            advice.append(f"garment.mesh.leave_out: ['{entry}'] leaves the first alone")
            break
    else:
        advice.append(f"garment.mesh.take: ['{_where(mesh, label, first)}'] takes the first alone")
    return " and ".join(advice)


def _where(mesh: RawMesh, label: np.ndarray, part: int) -> str:
    """Returns an entry of `take` for a part: its name if it is alone in that, else a place."""
    of_face = label[mesh.faces[:, 0]] == part
    named = {name for k in np.unique(mesh.face_part[of_face]) for name in mesh.part_names[k]}
    others = {name for k in np.unique(mesh.face_part[~of_face]) for name in mesh.part_names[k]}
    alone = sorted(named - others)
    if alone and len(np.unique(mesh.face_part[of_face])) == 1:
        return alone[0]
    nodes = mesh.position[label == part]
    away = KDTree(mesh.position[label != part]).query(nodes)[0]
    return f"near{place(nodes[np.argmax(away)]).removeprefix(' at')}"


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
