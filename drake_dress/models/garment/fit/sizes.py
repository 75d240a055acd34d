"""The measures of a garment at rest, as a tailor takes them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pygeodesic.geodesic import PyGeodesicAlgorithmExact
from scipy.spatial import cKDTree

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.fit.front import find_openings, underarm
from drake_dress.models.garment.fit.section import cloth_around, front_gap
from drake_dress.models.garment.front import Opening
from drake_dress.models.garment.mesh import (
    LOOP_NAMES,
    REGION_NAMES,
    GarmentMesh,
    edge_lengths,
    face_areas,
    loop_length,
)
from drake_dress.models.sides import SIDES

# The chest is cut this far below the armholes, the hem this far above the lowest node of the body,
# both as shares of the height between. The hem of many garments is not level.
_BELOW_ARMHOLES, _ABOVE_HEM = 0.03, 0.2
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Loop:
    """An opening: its name, girth, m, centre (3,), m, and the nodes (k,3) around it in order, m."""

    name: str
    girth: float
    center: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class GarmentSizes:
    """Measures of a garment at rest; lengths in m, areas in m².

    Attributes:
        loops: armholes and cuffs, then all other openings.
        opening: where the garment opens from collar to hem, or `closed`.
        chest: length of the cloth around the body just below the armholes, without the gap.
        front_gap: distance between the two edges of the opening there; None if there are none.
        hem: length of the cloth around the body a little above the hem, without the gap.
        back_width: shortest distance between the armholes over the cloth.
        shoulder_width: distance between the shoulder tips.
        neck_width: distance between the edges of the opening at the height of the shoulder tips;
            None if it is closed or ends below.
        sleeve_length: from each shoulder tip to its cuff over the cloth, by side.
        body_length: from the shoulder tips down to the hem.
        extent: (3,) depth, width and height of the bounding box.
        area: of the cloth.
        asymmetry: mean distance of the mirrored nodes from the nearest nodes.
        edges: shortest, median and longest edge.
        node_count: number of nodes.
        triangle_count: number of triangles.
    """

    loops: tuple[Loop, ...]
    opening: Opening
    chest: float
    front_gap: float | None
    hem: float
    back_width: float
    shoulder_width: float
    neck_width: float | None
    sleeve_length: dict[str, float]
    body_length: float
    extent: FloatArray
    area: float
    asymmetry: float
    edges: tuple[float, float, float]
    node_count: int
    triangle_count: int

    def girth(self, name: str) -> float:
        """Returns the girth of the loop of this name, m."""
        return next(loop.girth for loop in self.loops if loop.name == name)


def garment_sizes(mesh: GarmentMesh, coarse: GarmentMesh | None = None) -> GarmentSizes:
    """Returns the measures of a garment.

    Args:
        mesh: the garment, in the pose of `GarmentMesh`.
        coarse: the same garment with fewer nodes, on which distances over the cloth are measured:
            exact geodesic distances on a hundred thousand triangles take minutes.
    """
    x, faces = mesh.rest_position, mesh.faces
    found = find_openings(mesh)
    loops = {name: mesh.loops[name] for name in LOOP_NAMES} | found.loops
    body = mesh.region == REGION_NAMES.index("body")
    low, hem = underarm(mesh), float(x[body, 2].min())
    at_chest = low - _BELOW_ARMHOLES * (low - hem)
    at_hem = hem + _ABOVE_HEM * (low - hem)
    # the sleeves hang beside the body
    trunk = faces[body[faces].all(axis=1)]
    tips = [x[mesh.loops[f"{side}_armhole"]] for side in SIDES]
    tips = [around[np.argmax(around[:, 2])] for around in tips]
    at_tips = 0.5 * float(tips[0][2] + tips[1][2])
    lengths = edge_lengths(x, faces)
    return GarmentSizes(
        loops=tuple(_loop(x, name, nodes) for name, nodes in loops.items()),
        opening=found.opening,
        chest=cloth_around(x, trunk, at_chest),
        front_gap=front_gap(x, faces, body, at_chest),
        hem=cloth_around(x, trunk, at_hem),
        back_width=_between_armholes(coarse or mesh),
        shoulder_width=float(np.linalg.norm(tips[0] - tips[1])),
        neck_width=front_gap(x, faces, ~_sleeves(mesh), at_tips),
        sleeve_length={side: _sleeve_length(coarse or mesh, side) for side in SIDES},
        body_length=at_tips - hem,
        extent=np.ptp(x, axis=0),
        area=float(face_areas(x, faces).sum()),
        asymmetry=float(cKDTree(x).query(x * _MIRROR)[0].mean()),
        edges=(float(lengths.min()), float(np.median(lengths)), float(lengths.max())),
        node_count=len(x),
        triangle_count=len(faces),
    )


def _loop(x: FloatArray, name: str, nodes: IntArray) -> Loop:
    return Loop(name, loop_length(x, nodes), x[nodes].mean(axis=0), x[nodes])


def _sleeves(mesh: GarmentMesh) -> np.ndarray:
    sleeves = [REGION_NAMES.index(f"{side}_sleeve") for side in SIDES]
    return np.isin(mesh.region, sleeves)


def _between_armholes(mesh: GarmentMesh) -> float:
    return _distance(mesh, mesh.loops["left_armhole"], mesh.loops["right_armhole"])


def _sleeve_length(mesh: GarmentMesh, side: str) -> float:
    armhole = mesh.loops[f"{side}_armhole"]
    tip = armhole[np.argmax(mesh.rest_position[armhole, 2])]
    return _distance(mesh, np.array([tip]), mesh.loops[f"{side}_cuff"])


def _distance(mesh: GarmentMesh, sources: IntArray, targets: IntArray) -> float:
    """Returns the shortest geodesic distance from nodes to nodes, m."""
    exact = PyGeodesicAlgorithmExact(
        np.asarray(mesh.rest_position, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32)
    )
    far, _ = exact.geodesicDistances(np.asarray(sources, np.int32), np.asarray(targets, np.int32))
    return float(far.min())
