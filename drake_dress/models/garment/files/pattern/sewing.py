"""Joins the panels of a pattern along its stitches."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.files.pattern.specification import Panel, Pattern
from drake_dress.models.garment.files.pattern.triangles import triangulated

# Grid steps over the wanted spacing, tried until every panel can be cut into triangles.
_STEPS = (1.0, 0.75, 0.55, 0.4, 0.3)
# How far a panel bulges, over the distance from its border, and at most, m: two panels that lie on
# each other must know which is the outer one.
_BULGE, _MOST_BULGE = 0.5, 0.05


@dataclass(frozen=True)
class SewnPattern:
    """Panels joined along their stitches.

    Attributes:
        position: (n,3) where the panels' placement puts the nodes, bulged outward, m. Nodes of a
            seam are between its sides.
        faces: (F,3) node indices.
        corners: (F,3,2) corners of each triangle in the plane of its panel: its rest shape, m.
        panel: (F,) index of each triangle's panel.
    """

    position: FloatArray
    faces: IndexArray
    corners: FloatArray
    panel: IndexArray


@dataclass(frozen=True)
class _Cut:
    """A panel as triangles; `edge_nodes` are the nodes along each edge, from start to end."""

    points: FloatArray
    faces: IndexArray
    edge_nodes: list[IndexArray]
    turned: bool


def sewn(pattern: Pattern, spacing: float) -> SewnPattern:
    """Returns the pattern cut into triangles of about `spacing`, m, and sewn.

    Raises:
        UserError: a panel's border crosses itself, or it is too narrow for triangles; a stitch
            joins two corners of a triangle; or the stitches leave a panel apart from the others.
    """
    narrow = ""
    for step in _STEPS:
        cuts = _cut_all(pattern, step * spacing)
        if isinstance(cuts, list):
            return _joined(pattern, cuts)
        narrow = cuts.name
    raise UserError(
        pattern.source,
        f"panels.{narrow}",
        "cannot be cut into triangles, expected a border that does not cross or touch itself",
    )


def _cut_all(pattern: Pattern, step: float) -> list[_Cut] | Panel:
    """Returns all panels as triangles, or the first for which the step is too large."""
    counts = _counts(pattern, step)
    cuts = []
    for panel, along in zip(pattern.panels, counts, strict=True):
        made = _cut(panel, along, step)
        if made is None:
            return panel
        cuts.append(made)
    return cuts


def _counts(pattern: Pattern, step: float) -> list[list[int]]:
    """Returns the pieces of every edge: as many on both sides of a seam."""
    lengths = [[curve.length for curve in panel.curves] for panel in pattern.panels]
    for stitch in pattern.stitches:
        (p, e), (q, f) = stitch.first, stitch.second
        lengths[p][e] = lengths[q][f] = 0.5 * (lengths[p][e] + lengths[q][f])
    return [[max(1, round(length / step)) for length in row] for row in lengths]


def _cut(panel: Panel, counts: list[int], step: float) -> _Cut | None:
    border = np.vstack(
        [curve.sampled(n)[:-1] for curve, n in zip(panel.curves, counts, strict=True)]
    )
    size = len(border)
    starts = np.concatenate([[0], np.cumsum(counts)])
    edge_nodes = [np.arange(a, b + 1) % size for a, b in pairwise(starts)]
    if size < 3:
        return None
    x, y = border.T
    turned = float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) < 0.0
    if not turned:
        made = triangulated(border, step)
        return None if made is None else _Cut(*made, edge_nodes, turned)
    # triangles are made counter-clockwise and then follow the panel's own way around
    made = triangulated(border[::-1], step)
    if made is None:
        return None
    points, faces = made
    own = np.arange(len(points))
    own[:size] = own[:size][::-1]
    return _Cut(points[own], own[faces], edge_nodes, turned)


def _joined(pattern: Pattern, cuts: list[_Cut]) -> SewnPattern:
    offsets = np.concatenate([[0], np.cumsum([len(cut.points) for cut in cuts])])
    total = int(offsets[-1])
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for stitch in pattern.stitches:
        (p, e), (q, f) = stitch.first, stitch.second
        one, other = cuts[p].edge_nodes[e], cuts[q].edge_nodes[f]
        other = other if stitch.same_way else other[::-1]
        pairs.append(np.column_stack([one + offsets[p], other + offsets[q]]))
    joined = np.vstack(pairs)
    links = coo_array((np.ones(len(joined)), joined.T), shape=(total, total))
    count, node = connected_components(links, directed=False)
    node = node.astype(np.int64)
    faces = np.vstack([cut.faces + offset for cut, offset in zip(cuts, offsets, strict=False)])
    corners = np.vstack([cut.points[cut.faces] for cut in cuts])
    panel = np.repeat(np.arange(len(cuts)), [len(cut.faces) for cut in cuts])
    sewn_faces = node[faces]
    _check_faces(pattern, sewn_faces, panel)
    placed = _placed(pattern, cuts)
    position = np.zeros((count, 3))
    np.add.at(position, node, placed)
    position /= np.bincount(node)[:, None]
    return SewnPattern(position, sewn_faces, corners, panel)


def _check_faces(pattern: Pattern, faces: IndexArray, panel: IndexArray) -> None:
    flat = np.flatnonzero((faces == np.roll(faces, 1, axis=1)).any(axis=1))
    if len(flat):
        name = pattern.panels[panel[flat[0]]].name
        raise UserError(
            pattern.source,
            f"panels.{name}",
            "has two corners of a triangle sewn together, expected stitches between edges that do "
            "not lie side by side",
        )


def _placed(pattern: Pattern, cuts: list[_Cut]) -> FloatArray:
    """Returns all nodes where their panels are placed, bulged away from the garment's middle."""
    flat, normals, depths = [], [], []
    for panel, cut in zip(pattern.panels, cuts, strict=True):
        place = panel.placed(cut.points)
        normal = panel.rotation[:, 2] * (-1.0 if cut.turned else 1.0)
        border = np.unique(np.concatenate(cut.edge_nodes))
        flat.append(place)
        normals.append(np.tile(normal, (len(place), 1)))
        depths.append(cKDTree(cut.points[border]).query(cut.points)[0])
    position, normal, depth = np.vstack(flat), np.vstack(normals), np.concatenate(depths)
    outward = np.sign(float((normal * (position - position.mean(axis=0))).sum())) or 1.0
    bulge = np.minimum(_BULGE * depth, _MOST_BULGE)
    return np.asarray(position + outward * bulge[:, None] * normal)
