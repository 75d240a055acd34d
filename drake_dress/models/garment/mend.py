"""Mends what keeps a garment's surface from being one oriented manifold, and says what it did.

Files from garment programs have triangles that are given twice, patches that are wound the other
way round, and small places where three sheets of cloth share an edge: collar stands, plackets,
pockets. At such an edge, the two faces that go on most smoothly between large sheets stay joined,
and the others are cut off. What then hangs on nothing is left out if it is small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.edges import components
from drake_dress.models.garment.fans import HalfEdges, split_fans
from drake_dress.models.garment.files.raw import MaskArray, RawMesh, place
from drake_dress.models.garment.mesh import face_areas

# Largest share of edges with more than two faces that is mended; above it the surface is double.
_MOST_EDGES = 0.02
# Largest share of the area that is left out as a scrap.
_SCRAP = 0.05


class Mended(NamedTuple):
    """A mesh whose edges have at most two faces, of one orientation, and what was done to it.

    Attributes:
        mesh: oriented manifold with boundary, perhaps in several parts.
        notes: a line for each kind of change.
    """

    mesh: RawMesh
    notes: tuple[str, ...]


def mended(mesh: RawMesh) -> Mended:
    """Returns the mesh with repeated faces dropped, sheets cut apart and faces turned.

    Args:
        mesh: in m, without duplicate nodes or faces that name a node twice.

    Raises:
        UserError: too many edges belong to more than two faces, a large part would be cut off, or
            the surface has one side only.
    """
    single, repeated = _each_once(mesh)
    cut, parted = _cut_apart(single)
    try:
        alike, turned = _turned_alike(cut)
    except UserError as error:
        if not parted:
            raise
        raise UserError(
            mesh.source,
            "faces",
            f"not manifold: {parted[0].partition(':')[0]}, and cutting there does not leave one "
            "layer of cloth, as expected",
        ) from error
    return Mended(alike, (*repeated, *parted, *turned))


def _each_once(mesh: RawMesh) -> tuple[RawMesh, list[str]]:
    _, first = np.unique(np.sort(mesh.faces, axis=1), axis=0, return_index=True)
    again = len(mesh.faces) - len(first)
    if not again:
        return mesh, []
    keep = np.zeros(len(mesh.faces), dtype=bool)
    keep[first] = True
    told = f"{again} triangles are given twice, the first is {mesh.face(int(np.argmin(keep)))}"
    return mesh.only(keep), [f"{told}: each is kept once"]


def _cut_apart(mesh: RawMesh) -> tuple[RawMesh, list[str]]:
    """Returns the mesh with at most two faces an edge and one fan a node; scrap is left out."""
    edges = HalfEdges.of(mesh.faces, len(mesh.position))
    many = edges.count > 2
    if many.sum() > max(_MOST_EDGES * len(many), 3.0):
        raise UserError(
            mesh.source,
            "faces",
            f"not manifold: {many.sum()} of {len(many)} edges belong to more than two faces, the "
            f"first joins {_ends(mesh, edges, int(np.argmax(many)))}; expected one layer of cloth",
        )
    result = split_fans(mesh, edges, edges.pairs())
    if many.any():
        area = face_areas(mesh.position, mesh.faces)
        sheet = components(result.faces, len(result.position))[result.faces[:, 0]]
        size = np.bincount(sheet, area)[sheet] / area.sum()
        smoothest = _smoothest(edges, mesh.position, mesh.faces, size)
        result = split_fans(mesh, edges, np.concatenate([edges.pairs(), smoothest]))
    added = len(result.position) - len(mesh.position)
    if not added:
        return mesh, []
    notes = []
    if many.any():
        first = _ends(mesh, edges, int(np.argmax(many)))
        notes.append(
            f"{many.sum()} edges belong to more than two faces, the first joins {first}: there the "
            "cloth that goes on most smoothly is kept together"
        )
    else:
        new = len(mesh.position)
        notes.append(
            f"at {added} nodes sheets only touch, the first is {result.node(new)}: they are parted"
        )
    keep, told = _without_scrap(mesh, result)
    return result.only(keep), [*notes, *told]


def _turned_alike(mesh: RawMesh) -> tuple[RawMesh, list[str]]:
    """Returns the mesh with all faces of each part oriented as most of its area is."""
    edges = HalfEdges.of(mesh.faces, len(mesh.position))
    one, other = edges.pairs().T
    against = edges.forward[one] == edges.forward[other]
    if not against.any():
        return mesh, []
    count = len(mesh.faces)
    first, second = edges.face[one], edges.face[other]
    # weights: 1 same orientation, 2 opposite
    graph = coo_array((1.0 + against, (first, second)), shape=(count, count)).tocsr()
    graph = graph + graph.T
    turn = np.zeros(count, dtype=bool)
    _, label = connected_components(graph, directed=False)
    area = face_areas(mesh.position, mesh.faces)
    for part in range(int(label.max()) + 1):
        start = int(np.argmax(label == part))
        order, before = breadth_first_order(graph, start, directed=False)
        parent = before[order[1:]]
        opposite = np.asarray(graph[order[1:], parent]).reshape(-1) == 2.0
        for face, above, other_way in zip(order[1:], parent, opposite, strict=True):
            turn[face] = turn[above] ^ other_way
        inside = label == part
        if area[inside & turn].sum() > 0.5 * area[inside].sum():
            turn[inside] = ~turn[inside]
    wrong = (turn[first] ^ turn[second]) != against
    if wrong.any():
        k = int(edges.edge[one[np.argmax(wrong)]])
        raise UserError(
            mesh.source,
            "faces",
            f"the surface has one side only, as a Möbius strip has: no orientation of the faces "
            f"fits, for instance at {_ends(mesh, edges, k)}",
        )
    faces = mesh.faces.copy()
    faces[turn] = faces[turn][:, ::-1]
    uv = None if mesh.uv is None else np.where(turn[:, None, None], mesh.uv[:, ::-1], mesh.uv)
    told = f"{turn.sum()} of {count} triangles are wound the other way round"
    return replace(mesh, faces=faces, uv=uv), [
        f"{told}, the first is {mesh.face(int(np.argmax(turn)))}: they are turned"
    ]


def _smoothest(edges: HalfEdges, x: FloatArray, faces: IndexArray, size: FloatArray) -> IndexArray:
    """Returns (q,2) the two half-edges that stay joined at each edge of more faces.

    Args:
        edges: of the faces.
        x: (n,3), m.
        faces: (F,3).
        size: (F,) share of the area that the sheet of each face has.
    """
    kept = []
    for k in np.flatnonzero(edges.count > 2):
        here = np.arange(edges.start[k], edges.start[k] + edges.count[k])
        a, b = x[edges.ends[k]]
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-300)
        corners = faces[edges.face[here]]
        third = x[corners[~np.isin(corners, edges.ends[k])]] - a
        away = third - np.outer(third @ along, along)
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
        first, second = np.triu_indices(len(here), 1)
        share = size[edges.face[here]]
        large = np.minimum(share[first], share[second]) > _SCRAP
        straight = -(away[first] * away[second]).sum(axis=1)
        best = int(np.argmax(straight + 2.0 * large))
        kept.append([here[first[best]], here[second[best]]])
    return np.array(kept, dtype=np.int64).reshape(-1, 2)


def _without_scrap(before: RawMesh, cut: RawMesh) -> tuple[MaskArray, Sequence[str]]:
    """Returns (F,) which faces to keep of what was cut off, and a note.

    Raises:
        UserError: what was cut off is large.
    """
    old = components(before.faces, len(before.position))[before.faces[:, 0]]
    new = components(cut.faces, len(cut.position))[cut.faces[:, 0]]
    area = face_areas(cut.position, cut.faces)
    size = np.bincount(new, area)
    whole = np.bincount(old, area)
    largest = np.zeros(len(whole))
    np.maximum.at(largest, old, size[new])
    off = size[new] < largest[old]
    share = size[new] / whole[old]
    if (off & (share > _SCRAP)).any():
        k = int(np.argmax(np.where(off, share, 0.0)))
        part = cut.position[np.unique(cut.faces[new == new[k]])]
        raise UserError(
            cut.source,
            "faces",
            f"not manifold: a part of {100 * share[k]:.0f} % of the cloth, "
            f"{100 * np.ptp(part, axis=0).max():.0f} cm wide{place(part.mean(axis=0))}, hangs on "
            "edges of more than two faces only; expected one layer of cloth (leave it out by "
            "garment.mesh.leave_out)",
        )
    if not off.any():
        return ~off, []
    scraps = np.unique(new[off])
    part = cut.position[np.unique(cut.faces[off])]
    return ~off, [
        f"{len(scraps)} parts that hung on them, {100 * area[off].sum() / area.sum():.1f} % of the "
        f"cloth{place(part.mean(axis=0))}, are left out"
    ]


def _ends(mesh: RawMesh, edges: HalfEdges, k: int) -> str:
    a, b = edges.ends[k]
    return f"{mesh.node(a)} and {mesh.node(b)}"
