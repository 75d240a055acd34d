"""The state of a sleeve: centre and orientation of its armhole, with derivatives.

The paper uses six keypoints and the smallest component of their PCA. This module uses the whole
loop. The centre is that of the polygon as a curve, so that it does not depend on the spacing of the
nodes (six keypoints are an option). The orientation is the loop's area vector ½ Σ x_i × x_{i+1}.
For a flat loop it has the direction of the PCA axis. It has a definite sign, and is smooth with a
closed-form derivative. The PCA axis has no sign, and jumps where two components are equal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numba as nb
import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import AtRest, GarmentMesh
from drake_dress.models.sides import SIDES

Center = Literal["arc_length", "keypoints"]

_KEYPOINTS = 6  # per armhole, as in the paper's tracking section
# Least |cosine| between an armhole's area vector and the vector from its cuff for a definite sign.
_LEAST_COSINE = 0.05


@dataclass(frozen=True)
class SleeveState:
    """Armhole centre `p_c` (3,), m, and unit orientation `v_c` (3,), from cuff to armhole.

    `v_c` is the direction in which the sleeve is drawn up the arm, like the arm's direction D(s).
    """

    p_c: FloatArray
    v_c: FloatArray


def loop_orientation(garment: AtRest, side: str) -> float:
    """Returns ±1, such that the signed area vector of the armhole points from cuff to armhole.

    Raises:
        UserError: `side` is neither left nor right, or the armhole at rest lies edge-on to the
            vector from its cuff, so that the sign is undefined.
    """
    if side not in SIDES:
        raise UserError("garment", "side", f"is {side!r}, expected one of {', '.join(SIDES)}")
    armhole = garment.rest_position[garment.loops[f"{side}_armhole"]]
    cuff = garment.rest_position[garment.loops[f"{side}_cuff"]]
    toward = _curve_center(armhole) - _curve_center(cuff)
    area = _area_vector(armhole)
    product = float(area @ toward)
    if abs(product) <= _LEAST_COSINE * float(np.linalg.norm(area) * np.linalg.norm(toward)):
        raise UserError(
            "garment",
            f"loops.{side}_armhole",
            "lies edge-on to the way from its cuff at rest, expected an opening that faces it",
        )
    return 1.0 if product > 0.0 else -1.0


def sleeve_state(
    x: FloatArray,
    loop: npt.NDArray[np.integer],
    sign: float,
    center: Center = "arc_length",
) -> SleeveState:
    """Returns the sleeve state of the nodes `x` (n,3), m.

    A loop that is crumpled to zero area has no orientation: v_c is then shorter than a unit vector.

    Args:
        x: (n,3) positions.
        loop: (k,) nodes of the armhole in order.
        sign: orientation sign of the loop, see `loop_orientation`.
        center: centre of the whole loop, weighted by arc length, or mean of six keypoints at equal
            arc length from the loop's first node on (paper, section on tracking).
    """
    points = x[loop]
    area = sign * _area_vector(points)
    p_c = _curve_center(points) if center == "arc_length" else _keypoints(points).mean(axis=0)
    return SleeveState(p_c, area / _size(area))


def sleeve_state_vjp(
    x: FloatArray,
    loop: npt.NDArray[np.integer],
    sign: float,
    p_bar: FloatArray,
    v_bar: FloatArray,
    center: Center = "arc_length",
) -> FloatArray:
    """Returns (k,3) the derivative of p̄·p_c + v̄·v_c with respect to the loop's nodes.

    The derivative is exact, including the change of the arc lengths. Arguments as of
    `sleeve_state`; p_bar, v_bar: (3,).
    """
    points = x[loop]
    area = sign * _area_vector(points)
    size = _size(area)
    v_c = area / size
    area_bar = sign * (v_bar - (v_bar @ v_c) * v_c) / size
    # area = ½ Σ x_i × x_{i+1}: its derivative along dx_i is ½ dx_i × (x_{i+1} − x_{i−1})
    chord = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    of_center = _curve_center_vjp if center == "arc_length" else _keypoint_mean_vjp
    result: FloatArray = of_center(points, p_bar) + 0.5 * np.cross(chord, area_bar)
    return result


@dataclass(frozen=True)
class Entry:
    """The place where an arm enters the garment, as a weighted mean of nodes.

    Attributes:
        nodes: (k,); weights: (k,), sum 1.
    """

    nodes: npt.NDArray[np.integer]
    weights: FloatArray


def find_entry(mesh: GarmentMesh, reach: float = 0.15) -> Entry:
    """Returns the entry of a coat: its outer rim (front edges, neck) midway between the armholes.

    Args:
        mesh: its boundary consists of both cuffs and one rim.
        reach: length, m, over which the weight of rim nodes decays.
    """
    x = mesh.rest_position
    middle = 0.5 * sum(x[mesh.loops[f"{side}_armhole"]].mean(axis=0) for side in ("left", "right"))
    half = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(half, axis=0, return_counts=True)
    rim = np.setdiff1d(
        np.unique(edges[count == 1]),
        np.concatenate([mesh.loops["left_cuff"], mesh.loops["right_cuff"]]),
    )
    weight = np.exp(-np.sum((x[rim] - middle) ** 2, axis=1) / reach**2)
    keep = weight > 1e-3 * weight.max()
    return Entry(rim[keep], weight[keep] / weight[keep].sum())


def entry_direction(x: FloatArray, p_c: FloatArray, entry: Entry) -> FloatArray:
    """Returns the unit vector (3,) from an armhole's centre to the garment's entry."""
    way = entry.weights @ x[entry.nodes] - p_c
    unit: FloatArray = way / max(float(np.linalg.norm(way)), 1e-12)
    return unit


def entry_direction_vjp(
    x: FloatArray, p_c: FloatArray, entry: Entry, w_bar: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the derivative of w̄·entry_direction: (k,3) by the entry's nodes, (3,) by p_c."""
    way = entry.weights @ x[entry.nodes] - p_c
    length = max(float(np.linalg.norm(way)), 1e-12)
    w = way / length
    back = (w_bar - (w_bar @ w) * w) / length
    return entry.weights[:, None] * back, -back


# Both run hundreds of times a second; `np.roll` took forty times as long.
@nb.njit(cache=True)
def _area_vector(points: FloatArray) -> FloatArray:
    """Returns ½ Σ x_i × x_{i+1} of the loop's nodes (k,3)."""
    area = np.zeros(3)
    for i in range(points.shape[0]):
        a, b = points[i - 1], points[i]
        area[0] += 0.5 * (a[1] * b[2] - a[2] * b[1])
        area[1] += 0.5 * (a[2] * b[0] - a[0] * b[2])
        area[2] += 0.5 * (a[0] * b[1] - a[1] * b[0])
    return area


@nb.njit(cache=True)
def _curve_center(points: FloatArray) -> FloatArray:
    """Returns Σ ℓ_i m_i / Σ ℓ_i over edges with lengths ℓ and midpoints m."""
    center = np.zeros(3)
    total = 0.0
    for i in range(points.shape[0]):
        a, b = points[i - 1], points[i]
        length = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
        length = max(length, 1e-12)
        total += length
        for c in range(3):
            center[c] += 0.5 * length * (a[c] + b[c])
    return center / total


def _size(area: FloatArray) -> float:
    return max(math.sqrt(area @ area), 1e-12)


def _edges(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns unit directions (k,3) and lengths (k,), m, of the edges i → i+1."""
    edge = np.roll(points, -1, axis=0) - points
    length = np.maximum(np.linalg.norm(edge, axis=1), 1e-12)
    return edge / length[:, None], length


def _curve_center_vjp(points: FloatArray, p_bar: FloatArray) -> FloatArray:
    direction, length = _edges(points)
    middle = 0.5 * (points + np.roll(points, -1, axis=0))
    center = length @ middle / length.sum()
    middle_bar = (length / length.sum())[:, None] * p_bar
    length_bar = (middle - center) @ p_bar / length.sum()
    return 0.5 * (middle_bar + np.roll(middle_bar, 1, axis=0)) + _length_vjp(direction, length_bar)


def _locate_keypoints(length: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Returns the edge (6,) of each keypoint, and the share (6,) of the edge before it."""
    ends = np.cumsum(length)
    at = ends[-1] * np.arange(_KEYPOINTS) / _KEYPOINTS
    edge = np.minimum(np.searchsorted(ends, at, side="right"), len(length) - 1)
    return edge, (at - (ends - length)[edge]) / length[edge]


def _keypoints(points: FloatArray) -> FloatArray:
    direction, length = _edges(points)
    edge, part = _locate_keypoints(length)
    keypoints: FloatArray = points[edge] + (part * length[edge])[:, None] * direction[edge]
    return keypoints


def _keypoint_mean_vjp(points: FloatArray, p_bar: FloatArray) -> FloatArray:
    direction, length = _edges(points)
    edge, part = _locate_keypoints(length)
    points_bar = np.zeros_like(points)
    length_bar = np.zeros_like(length)
    for number, (i, tau) in enumerate(zip(edge, part, strict=True)):
        # keypoint = (1 − τ) x_i + τ x_{i+1}, τ ℓ_i = L·number/6 − Σ_{j<i} ℓ_j
        share = p_bar / _KEYPOINTS
        points_bar[i] += (1.0 - tau) * share
        points_bar[(i + 1) % len(points)] += tau * share
        slide = float(share @ direction[i])
        length_bar += slide * number / _KEYPOINTS
        length_bar[:i] -= slide
        length_bar[i] -= slide * tau
    return points_bar + _length_vjp(direction, length_bar)


def _length_vjp(direction: FloatArray, length_bar: FloatArray) -> FloatArray:
    """Returns (k,3) the derivative of Σ ℓ̄_i ℓ_i with respect to the nodes."""
    pull = length_bar[:, None] * direction
    result: FloatArray = np.roll(pull, 1, axis=0) - pull
    return result
