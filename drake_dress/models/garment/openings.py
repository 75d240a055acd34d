"""Finds the cuffs and armholes of an unlabelled garment.

Cuffs are the boundary loops farthest to either side. The armhole is where the sleeve stops being a
tube. A vertical plane y = const is moved inward from the cuff. While it cuts the sleeve alone, the
girth of the cut grows slowly; at the underarm the cut opens along the side of the body. The
armhole is the shortest pair of edge paths, one along the front and one along the back, that joins
the lowest and the highest node of the last tube cut and stays close to it.

This needs sleeves that stand away from the body, as in the canonical pose. Otherwise the loops
must be named.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from drake_dress.errors import UserError
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray, IntArray
from drake_dress.models.garment.edges import boundary_loops, unique_edges
from drake_dress.models.garment.files.raw import place
from drake_dress.models.garment.mesh import loop_length
from drake_dress.models.sides import SIDES

CUFF_GIRTH = (0.1, 0.8)  # m
_STEP = 0.005  # between cuts, m
_GROWTH = 0.12  # largest growth of a tube's girth between cuts; the side of a body gives more
_SEARCH = 0.45  # fraction of the distance between the cuffs that is searched for an armhole

# Heights, in shares of the garment's, above and below which it has openings for head and hem.
_UPPER, _LOWER = 0.6, 0.4

_NAME_THEM = "expected loops named by node indices (left_armhole, left_cuff, right_…)"


def find_cuffs(position: FloatArray, faces: IntArray, source: str) -> dict[str, IntArray]:
    """Returns the boundary loops `left_cuff` (+y) and `right_cuff` (−y).

    Args:
        position: (n,3), m, in the canonical rest pose.
        faces: (F,3) of a manifold.
        source: file put in front of the message.

    Raises:
        UserError: there are no two small boundary loops, one at either side.
    """
    y = position[:, 1]
    middle, width = 0.5 * float(y.min() + y.max()), float(np.ptp(y))
    every = boundary_loops(faces)
    small = [q for q in every if CUFF_GIRTH[0] <= loop_length(position, q) <= CUFF_GIRTH[1]]
    offset = [float(position[q, 1].mean()) - middle for q in small]
    if not small or max(offset) < 0.25 * width or min(offset) > -0.25 * width:
        raise UserError(
            source,
            "loops",
            f"no cuffs found at the sides (+y, -y) among {len(every)} boundary loops "
            f"(are the sleeves open, and does the garment face +x with z up?): {_NAME_THEM}",
        )
    return {
        "left_cuff": small[int(np.argmax(offset))],
        "right_cuff": small[int(np.argmin(offset))],
    }


def check_neck_and_hem(
    position: FloatArray, faces: IntArray, loops: Mapping[str, IntArray], source: str
) -> None:
    """Checks that a garment has openings above and below, besides its cuffs.

    Args:
        position: (n,3), m, in the canonical rest pose.
        faces: (F,3) of a manifold.
        loops: with both cuffs.
        source: file put in front of the message.

    Raises:
        UserError: it has not, as trousers have not.
    """
    border = np.unique(np.concatenate(boundary_loops(faces)))
    border = np.setdiff1d(border, np.concatenate([loops[f"{side}_cuff"] for side in SIDES]))
    z = position[:, 2]
    height = (z[border] - z.min()) / max(float(np.ptp(z)), 1e-9)
    upper, lower = bool((height > _UPPER).any()), bool((height < _LOWER).any())
    if upper and lower:
        return
    missing = "for the head" if lower else "at the hem" if upper else "for head and hem"
    left, right = (place(position[loops[f"{side}_cuff"]].mean(axis=0)) for side in SIDES)
    raise UserError(
        source,
        "loops",
        f"there is no opening {missing} besides two{left} and{right}, with +x forward and +y to "
        "the left: are these trousers? expected a garment with two sleeves",
    )


def find_armhole(
    position: FloatArray, faces: IntArray, cuff: npt.NDArray[np.integer], source: str, name: str
) -> IntArray:
    """Returns the loop of nodes where the sleeve that ends in `cuff` joins the body.

    Args:
        position: (n,3), m, in the canonical rest pose.
        faces: (F,3) of a manifold.
        cuff: nodes of the cuff.
        source: file put in front of the message.
        name: name of the armhole, for the message.

    Raises:
        UserError: no armhole is found.
    """
    y = position[:, 1] - 0.5 * float(position[:, 1].min() + position[:, 1].max())
    out = y if float(y[cuff].mean()) > 0.0 else -y
    edges = unique_edges(faces)
    cut = _last_tube_cut(position, out, faces, edges, cuff)
    loop = None if cut is None else _loop_near(position, out, edges, cut)
    if loop is None or not _cuts_off(edges, len(position), loop, cuff):
        raise UserError(
            source,
            f"loops.{name}",
            f"not found: the sleeve does not stand out from the body clearly enough; {_NAME_THEM}",
        )
    return loop


def ordered(position: FloatArray, loop: npt.NDArray[np.integer]) -> IntArray:
    """Returns the loop, starting at its highest node and running along the front (+x) first."""
    loop = np.roll(loop, -int(np.argmax(position[loop, 2])))
    quarter = max(1, len(loop) // 4)
    if position[loop[quarter], 0] < position[loop[-quarter], 0]:
        loop = np.roll(loop[::-1], 1)
    return np.asarray(loop, dtype=np.int32)


def beyond(
    faces: IntArray, n: int, loop: npt.NDArray[np.integer], cuff: npt.NDArray[np.integer]
) -> BoolArray:
    """Returns (n,) which nodes lie on the cuff's side of a loop, without the loop itself."""
    return _reached(unique_edges(faces), n, loop, cuff)


def _last_tube_cut(
    x: FloatArray,
    out: FloatArray,
    faces: IntArray,
    edges: IntArray,
    cuff: npt.NDArray[np.integer],
) -> tuple[float, IndexArray] | None:
    """Returns the innermost plane that cuts the sleeve alone, and the nodes next to the cut."""
    border = np.unique(np.concatenate(boundary_loops(faces)))
    foreign = np.setdiff1d(border, cuff)
    last, before = None, 0.0
    for at in np.arange(float(out[cuff].min()) - _STEP, out.max() * (1.0 - 2 * _SEARCH), -_STEP):
        outside = out > at
        inner = edges[outside[edges].all(axis=1)]
        part = _component(inner, len(x), cuff[0])
        if not part[cuff].all() or part[foreign].any():
            break
        # edges that leave the sleeve at the cut
        leaving = edges[part[edges].any(axis=1) & ~outside[edges].all(axis=1)]
        if len(leaving) < 6:
            continue
        girth = _cut_girth(x, out, faces, part, outside, float(at))
        if last is not None and girth > (1.0 + _GROWTH) * before:
            break
        last, before = (float(at), np.unique(leaving)), girth
    return last


def _cut_girth(
    x: FloatArray,
    out: FloatArray,
    faces: IntArray,
    part: BoolArray,
    outside: BoolArray,
    at: float,
) -> float:
    count = outside[faces].sum(axis=1)
    crossed = faces[(count > 0) & (count < 3) & part[faces].any(axis=1)]
    points = []
    for k in range(3):
        a, b = crossed[:, k], crossed[:, (k + 1) % 3]
        crosses = outside[a] != outside[b]
        t = np.where(crosses, (at - out[a]) / np.where(crosses, out[b] - out[a], 1.0), np.nan)
        points.append(x[a] + t[:, None] * (x[b] - x[a]))
    corner = np.stack(points)
    pairs = np.linalg.norm(corner - np.roll(corner, 1, axis=0), axis=2)
    return float(np.nansum(pairs))


def _loop_near(
    x: FloatArray, out: FloatArray, edges: IntArray, cut: tuple[float, IndexArray]
) -> IntArray | None:
    at, nodes = cut
    low = nodes[np.argmin(x[nodes, 2])]
    high = nodes[np.argmax(x[nodes, 2])]
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    scale = float(np.median(length))
    away = np.abs(out[edges].mean(axis=1) - at) / scale
    weight = length * (1.0 + away**2)
    height = (x[:, 2] - x[low, 2]) / max(float(x[high, 2] - x[low, 2]), 1e-9)
    ahead = x[:, 0] - (x[low, 0] + height * (x[high, 0] - x[low, 0]))
    halves = []
    for side in (1.0, -1.0):
        allowed = side * ahead > 0.0 if side > 0 else ahead <= 0.0
        allowed[[low, high]] = True
        keep = allowed[edges].all(axis=1) & (away < 6.0)
        # an edge that joins the two ends directly would make an empty loop
        keep &= ~(np.isin(edges, [low, high]).all(axis=1))
        graph = csr_array((weight[keep], (edges[keep, 0], edges[keep, 1])), shape=(len(x), len(x)))
        _, previous = dijkstra(graph, directed=False, indices=high, return_predecessors=True)
        path = [int(low)]
        while path[-1] != high:
            if previous[path[-1]] < 0:
                return None
            path.append(int(previous[path[-1]]))
        halves.append(path)
    return np.array(halves[0][::-1] + halves[1][1:-1], dtype=np.int32)


def _cuts_off(edges: IntArray, n: int, loop: IntArray, cuff: npt.NDArray[np.integer]) -> bool:
    """Returns whether the loop separates the sleeve from the rest."""
    part = _reached(edges, n, loop, cuff)
    return bool(part[cuff[~np.isin(cuff, loop)]].all() and part.sum() < 0.4 * n)


def _reached(
    edges: IntArray, n: int, loop: npt.NDArray[np.integer], cuff: npt.NDArray[np.integer]
) -> BoolArray:
    blocked = np.zeros(n, dtype=bool)
    blocked[loop] = True
    free = cuff[~blocked[cuff]]
    if len(free) == 0:
        return np.zeros(n, dtype=bool)
    return _component(edges[~blocked[edges].any(axis=1)], n, free[0]) & ~blocked


def _component(edges: IntArray, n: int, node: int) -> BoolArray:
    graph = csr_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    return np.asarray(label == label[node])
