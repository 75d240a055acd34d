"""Reports a garment that is in several parts, with the keys that would leave one."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from drake_dress.errors import UserError
from drake_dress.models.garment.chosen import by_measure, chosen
from drake_dress.models.garment.edges import components
from drake_dress.models.garment.files.raw import RawMesh, place
from drake_dress.models.garment.merge import gap_between, seams_sewn
from drake_dress.models.garment.mesh import face_areas

_TOLD = 3  # parts that a message describes one by one
# Seam gaps and part sizes that are tried before a message advises one, m.
_GAPS = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3)
_SIZES = (0.01, 0.02, 0.05, 0.1)


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
        f"{_advice(mesh, label, order[0])}",
    )


def _advice(mesh: RawMesh, label: np.ndarray, first: int) -> str:
    """Returns the keys that would leave one part; each is first tried on the mesh."""
    advice = []
    for gap in _GAPS:
        sewn = seams_sewn(mesh, gap)
        if int(components(sewn.faces, len(sewn.position)).max()) == 0:
            advice.append(f"garment.mesh.weld: {gap:g} joins them")
            break
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
