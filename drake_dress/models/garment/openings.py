"""Finds the cuffs and armholes of an unlabelled garment.

Cuffs are the boundary loops farthest to either side. The armhole is where the sleeve stops being a
tube. A vertical plane is moved inward from the cuff, first a plane y = const for sleeves that point
sideways, then x = const for sleeves that point forward or backward out of a flat body. While it
cuts the sleeve alone, the cut grows slowly; at the underarm it opens along the side of the body, or
the sleeve widens like a funnel into the flat body. The armhole is the shortest pair of edge paths,
one on either side, that joins the lowest and the highest node of the last tube cut and stays close
to it.

This needs sleeves that stand away from the body. Otherwise the loops must be named.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from drake_dress.errors import UserError
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray, IntArray
from drake_dress.models.garment.edges import border_edges, boundary_loops, unique_edges
from drake_dress.models.garment.files.raw import place
from drake_dress.models.garment.mesh import loop_length
from drake_dress.models.sides import SIDES

CUFF_GIRTH = (0.1, 0.8)  # m
# Least distance of a cuff from the middle of the garment, in widths of the garment: a gown that is
# spread flat is 1.3 m wide, and its sleeves are 0.4 m apart.
_ASIDE = 0.12
_STEP = 0.005  # between cuts, m
_GROWTH = 0.12  # largest growth of a tube's girth between cuts; the side of a body gives more
_SEARCH = 0.45  # fraction of the distance between the cuffs that is searched for an armhole
# A sleeve also ends where the cut grows in height faster than this per distance inward, over so
# many cuts: the side of an inflated body is reached smoothly, and so is a flat body by sleeves that
# stand out of it. The most tapered sleeves of coats, cut aslant, have 1.
_STEEP, _OVER = 1.7, 2

# Heights, in shares of the garment's, above and below which it has openings for head and hem.
_UPPER, _LOWER = 0.6, 0.4
_SHOULDERS = 0.8  # above it are the tops of armholes


@dataclass(frozen=True)
class Hanging:
    """A garment that is turned upright.

    Attributes:
        source: file put in front of messages.
        position: (n,3), m, in the canonical rest pose.
        faces: (F,3) of a manifold.
        in_file: (n,3), m, in the axes of the file, for messages.
    """

    source: str
    position: FloatArray
    faces: IntArray
    in_file: FloatArray

    def place(self, nodes: npt.NDArray[np.integer]) -> str:
        """Returns the middle of some nodes for messages, in the axes of the file."""
        return place(self.in_file[nodes].mean(axis=0))

    def told(self, loop: npt.NDArray[np.integer]) -> str:
        """Returns the girth and the place of an opening for messages."""
        return f"{loop_length(self.position, loop):.2f} m around{self.place(loop)}"


def find_cuffs(hanging: Hanging, named: Container[str] = ()) -> dict[str, IntArray]:
    """Returns the boundary loops `left_cuff` (+y) and `right_cuff` (−y).

    Args:
        hanging: the garment.
        named: names of loops that need not be found.

    Raises:
        UserError: there are no two small boundary loops, one at either side.
    """
    y = hanging.position[:, 1]
    aside = _ASIDE * float(np.ptp(y))
    middle = 0.5 * float(y.min() + y.max())
    every = boundary_loops(hanging.faces)
    girth = np.array([loop_length(hanging.position, loop) for loop in every])
    offset = np.array([float(y[loop].mean()) - middle for loop in every])
    small = (girth >= CUFF_GIRTH[0]) & (girth <= CUFF_GIRTH[1])
    found = {}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        there = np.flatnonzero(small & (sign * offset >= aside))
        if len(there):
            found[f"{side}_cuff"] = every[there[np.argmax(sign * offset[there])]]
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        if f"{side}_cuff" not in found and f"{side}_cuff" not in named:
            beside = np.flatnonzero((sign * offset >= aside) & (girth < 2.0 * CUFF_GIRTH[1]))
            raise _no_cuff(hanging, side, found, every, [every[k] for k in beside])
    return found


def _no_cuff(
    hanging: Hanging,
    side: str,
    found: Mapping[str, IntArray],
    every: Sequence[IntArray],
    beside: Sequence[IntArray],
) -> UserError:
    """Returns the error for a side without a cuff, which `beside` may have other openings."""
    name, at = f"{side}_cuff", next(iter(found.values()), None)
    if beside:
        low, high = CUFF_GIRTH
        message = (
            f"the opening at the {side} is {hanging.told(beside[0])}, expected a cuff of {low} to "
            f"{high} m (are unit and scale right?), or {by_key(name)}"
        )
    elif at is not None:
        message = (
            f"there is a cuff at one side only, {hanging.told(at)}: is the {side} sleeve missing "
            f"or closed? expected two open sleeves, or {by_key(name)}"
        )
    else:
        shortest = min(every, key=lambda loop: loop_length(hanging.position, loop), default=None)
        told = "" if shortest is None else f"; the smallest is {hanging.told(shortest)}"
        name = ""
        message = (
            f"no cuffs found at left and right among {len(every)} boundary loops{told} (are up and "
            "facing right, and the sleeves open? vests and capes have none), expected two "
            "sleeves, or garment.mesh.loops"
        )
    return UserError(hanging.source, f"loops.{name}".rstrip("."), message)


def by_key(name: str) -> str:
    """Returns the key that names an opening, for messages."""
    return f"garment.mesh.loops.{name}: near (x, y, z) m"


def check_neck_and_hem(hanging: Hanging, loops: Mapping[str, IntArray]) -> None:
    """Checks that a garment has openings above and below, besides its cuffs.

    Args:
        hanging: the garment.
        loops: with both cuffs.

    Raises:
        UserError: it has not, as trousers have not.
    """
    border = np.unique(border_edges(hanging.faces, len(hanging.position)))
    border = np.setdiff1d(border, np.concatenate([loops[f"{side}_cuff"] for side in SIDES]))
    z = hanging.position[:, 2]
    height = (z[border] - z.min()) / max(float(np.ptp(z)), 1e-9)
    upper, lower = bool((height > _UPPER).any()), bool((height < _LOWER).any())
    if upper and lower:
        return
    missing = "for the head" if lower else "at the hem" if upper else "for head and hem"
    left, right = (hanging.place(loops[f"{side}_cuff"]) for side in SIDES)
    raise UserError(
        hanging.source,
        "loops",
        f"there is no opening {missing} besides two{left} and{right}: are these trousers? "
        "expected a garment with two sleeves",
    )


def find_armhole(hanging: Hanging, cuff: npt.NDArray[np.integer], name: str) -> IntArray:
    """Returns the loop of nodes where the sleeve that ends in `cuff` joins the body.

    Args:
        hanging: the garment.
        cuff: nodes of the cuff.
        name: name of the armhole, for the message.

    Raises:
        UserError: no armhole is found.
    """
    x, faces = hanging.position, hanging.faces
    edges = unique_edges(faces)
    for way in _ways(x, cuff):
        cut = _last_tube_cut(x, way, faces, edges, cuff)
        loop = None if cut is None else _loop_near(x, way, edges, cut)
        if loop is not None and _cuts_off(edges, len(x), loop, cuff):
            return loop
    z = x[:, 2]
    is_high = float(x[cuff, 2].max() - z.min()) > _SHOULDERS * float(np.ptp(z))
    vest = " (is it a vest?)" if is_high else ""
    raise UserError(
        hanging.source,
        f"loops.{name}",
        f"not found: no sleeve stands out from the body clearly enough at the opening "
        f"{hanging.told(cuff)}{vest}, expected one, or {by_key(name)}",
    )


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


@dataclass(frozen=True)
class _Way:
    """A direction in which a sleeve may stand out from the body.

    Attributes:
        out: (n,) how far each node is that way, m.
        across: (n,) the other horizontal coordinate, m.
    """

    out: FloatArray
    across: FloatArray


def _ways(x: FloatArray, cuff: npt.NDArray[np.integer]) -> Iterator[_Way]:
    """Yields sideways, and then forward or backward."""
    y = x[:, 1] - 0.5 * float(x[:, 1].min() + x[:, 1].max())
    yield _Way(y if float(y[cuff].mean()) > 0.0 else -y, x[:, 0])
    ahead = x[:, 0] if float(x[cuff, 0].mean()) > float(np.median(x[:, 0])) else -x[:, 0]
    yield _Way(ahead - ahead.min(), x[:, 1])


def _last_tube_cut(
    x: FloatArray, way: _Way, faces: IntArray, edges: IntArray, cuff: npt.NDArray[np.integer]
) -> tuple[float, IndexArray] | None:
    """Returns the innermost plane that cuts the sleeve alone, and the nodes next to the cut."""
    out = way.out
    foreign = np.setdiff1d(np.unique(border_edges(faces, len(x))), cuff)
    last, sizes = None, list[tuple[float, float]]()
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
        girth, height = _cut_size(x, out, faces, part, outside, float(at))
        if sizes and (
            girth > (1.0 + _GROWTH) * sizes[-1][0]
            or height > sizes[-_OVER:][0][1] + _STEEP * _OVER * _STEP
        ):
            break
        sizes.append((girth, height))
        last = float(at), np.unique(leaving)
    return last


def _cut_size(
    x: FloatArray,
    out: FloatArray,
    faces: IntArray,
    part: BoolArray,
    outside: BoolArray,
    at: float,
) -> tuple[float, float]:
    """Returns the girth and the height of the cut of a part with a plane, m."""
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
    return float(np.nansum(pairs)), float(np.nanmax(corner[..., 2]) - np.nanmin(corner[..., 2]))


def _loop_near(
    x: FloatArray, way: _Way, edges: IntArray, cut: tuple[float, IndexArray]
) -> IntArray | None:
    at, nodes = cut
    low = nodes[np.argmin(x[nodes, 2])]
    high = nodes[np.argmax(x[nodes, 2])]
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    scale = float(np.median(length))
    away = np.abs(way.out[edges].mean(axis=1) - at) / scale
    weight = length * (1.0 + away**2)
    height = (x[:, 2] - x[low, 2]) / max(float(x[high, 2] - x[low, 2]), 1e-9)
    across = way.across
    ahead = across - (across[low] + height * (across[high] - across[low]))
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
