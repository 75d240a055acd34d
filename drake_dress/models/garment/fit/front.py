"""How a garment opens, told from its border: down the front, down the back, or over the head.

A garment that is put on like a coat has one border loop that contains both the collar and the hem:
it runs down both edges of the opening. A garment that is pulled over the head has one loop for the
neck and another for the hem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import IntArray
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.front import Opening
from drake_dress.models.garment.mesh import REGION_NAMES, GarmentMesh
from drake_dress.models.sides import SIDES

# Shares of the distance between underarm and shoulder, and between hem and underarm: a loop that
# reaches higher than the first contains the collar, one that reaches lower than the second the hem.
_COLLAR, _HEM = 0.5, 0.25


@dataclass(frozen=True)
class Openings:
    """The openings of a garment besides armholes and cuffs.

    Attributes:
        opening: where the garment opens from collar to hem, or `closed`.
        loops: nodes in order around each opening, by name: `rim` for the one from collar to hem,
            or `neck` and `hem`; others are `opening_1`, `opening_2`, ….
    """

    opening: Opening
    loops: dict[str, IntArray]


def find_openings(mesh: GarmentMesh) -> Openings:
    """Returns the openings of a garment besides armholes and cuffs."""
    z = mesh.rest_position[:, 2]
    cuffs = np.concatenate([mesh.loops[f"{side}_cuff"] for side in SIDES])
    loops = [loop for loop in boundary_loops(mesh.faces) if not np.isin(loop, cuffs).any()]
    collar, hem = _collar_and_hem(mesh)
    rims = [loop for loop in loops if z[loop].max() >= collar and z[loop].min() <= hem]
    named: dict[str, IntArray] = {}
    if rims:
        named["rim"] = rims[0]  # the longest
    else:
        upper = [loop for loop in loops if z[loop].max() >= collar]
        lower = [loop for loop in loops if z[loop].min() <= hem]
        if upper:
            named["neck"] = max(upper, key=lambda loop: float(z[loop].max()))
        if lower:
            named["hem"] = lower[0]
    known = [id(loop) for loop in named.values()]
    others = [loop for loop in loops if id(loop) not in known]
    named |= {f"opening_{k}": loop for k, loop in enumerate(others, 1)}
    return Openings(_opening(mesh, named.get("rim"), hem), named)


def underarm(mesh: GarmentMesh) -> float:
    """Returns the height of the lower end of the armholes, m."""
    return min(float(mesh.rest_position[mesh.loops[f"{side}_armhole"], 2].min()) for side in SIDES)


def _collar_and_hem(mesh: GarmentMesh) -> tuple[float, float]:
    """Returns the heights above which a loop has the collar, and below which it has the hem."""
    z, low = mesh.rest_position[:, 2], underarm(mesh)
    tip = min(float(z[mesh.loops[f"{side}_armhole"]].max()) for side in SIDES)
    end = float(z[mesh.region == REGION_NAMES.index("body")].min())
    return low + _COLLAR * (tip - low), end + _HEM * (low - end)


def _opening(mesh: GarmentMesh, rim: IntArray | None, hem: float) -> Opening:
    if rim is None:
        return "closed"
    x, body = mesh.rest_position, mesh.region == REGION_NAMES.index("body")
    low, high = sorted((hem, underarm(mesh)))
    edges = rim[(x[rim, 2] >= low) & (x[rim, 2] <= high)]
    band = body & (x[:, 2] >= low) & (x[:, 2] <= high)
    if len(edges) == 0 or not band.any():
        edges, band = rim, body
    middle = 0.5 * float(x[band, 0].min() + x[band, 0].max())
    return "front" if float(x[edges, 0].mean()) >= middle else "back"
