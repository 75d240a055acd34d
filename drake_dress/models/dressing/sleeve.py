"""The state of a sleeve: centre and orientation of its armhole, with derivatives.

The paper takes six keypoints and the smallest component of their PCA. Here all loop nodes count:
the centre is their mean, and the orientation is the loop's area vector, which is smooth where the
PCA flips and is what a flat loop's PCA gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.garment.mesh import GarmentMesh

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SleeveState:
    """Armhole centre `p_c` (3,), m, and unit orientation `v_c` (3,), from cuff to armhole."""

    p_c: FloatArray
    v_c: FloatArray


def loop_orientation(mesh: GarmentMesh, side: str) -> float:
    """Returns ±1, such that the signed area vector of the armhole points from cuff to armhole."""
    armhole = mesh.rest_position[mesh.loops[f"{side}_armhole"]]
    cuff = mesh.rest_position[mesh.loops[f"{side}_cuff"]]
    toward = armhole.mean(axis=0) - cuff.mean(axis=0)
    return 1.0 if float(_area_vector(armhole) @ toward) > 0.0 else -1.0


def sleeve_state(x: FloatArray, loop: npt.NDArray[np.integer], sign: float) -> SleeveState:
    """Returns the sleeve state of the nodes `x` (n,3), m.

    Args:
        x: (n,3) positions.
        loop: (k,) nodes of the armhole in order.
        sign: of the loop, see `loop_orientation`.
    """
    points = x[loop]
    area = sign * _area_vector(points)
    return SleeveState(points.mean(axis=0), area / max(float(np.linalg.norm(area)), 1e-12))


def sleeve_state_vjp(
    x: FloatArray,
    loop: npt.NDArray[np.integer],
    sign: float,
    p_bar: FloatArray,
    v_bar: FloatArray,
) -> FloatArray:
    """Returns (k,3) the derivative of p̄·p_c + v̄·v_c with respect to the loop's nodes."""
    points = x[loop]
    area = sign * _area_vector(points)
    size = max(float(np.linalg.norm(area)), 1e-12)
    v_c = area / size
    area_bar = sign * (v_bar - (v_bar @ v_c) * v_c) / size
    # area = ½ Σ x_i × x_{i+1}: its derivative along dx_i is ½ dx_i × (x_{i+1} − x_{i−1})
    chord = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    result: FloatArray = p_bar / len(loop) + 0.5 * np.cross(chord, area_bar)
    return result


@dataclass(frozen=True)
class Entry:
    """Where an arm comes into the garment, as a weighted mean of nodes.

    Attributes:
        nodes: (k,); weights: (k,), sum 1.
    """

    nodes: npt.NDArray[np.integer]
    weights: FloatArray


def find_entry(mesh: GarmentMesh, reach: float = 0.15) -> Entry:
    """Returns the entry of a coat: its outer rim (front edges, neck) near between the armholes.

    Args:
        mesh: its boundary is made of both cuffs and one rim.
        reach: length, m, over which rim nodes count less and less.
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
    """Returns the derivative of w̄·entry_direction: (k,3) of the entry's nodes, (3,) of p_c."""
    way = entry.weights @ x[entry.nodes] - p_c
    length = max(float(np.linalg.norm(way)), 1e-12)
    w = way / length
    back = (w_bar - (w_bar @ w) * w) / length
    return entry.weights[:, None] * back, -back


def _area_vector(points: FloatArray) -> FloatArray:
    area: FloatArray = 0.5 * np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    return area
