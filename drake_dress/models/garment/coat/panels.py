"""The panels of a coat's left half: body, front, back and sleeve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.coat.builder import Builder
from drake_dress.models.garment.coat.curves import arc, coons
from drake_dress.models.garment.coat.parameters import CoatParameters
from drake_dress.models.garment.coat.shape import Counts, Shape
from drake_dress.models.garment.mesh import loop_length

_SLEEVE_SLOPE = 58.0  # deg below the horizontal
# Half width of a slit at the hem and at its upper end, m: its edges are not in contact.
_VENT_GAP, _VENT_NARROW = 0.006, 0.0025


@dataclass(frozen=True)
class Body:
    """Nodes of the body's grids, each with rows from below up and columns from front to back."""

    lower: IntArray
    front: IntArray
    back: IntArray

    def armhole(self, c: Counts) -> IntArray:
        """Returns the loop from the shoulder tip down the front and up the back."""
        ring = self.lower[-1]
        below = ring[c.front + 1 : c.front + c.gap + 1]
        return np.concatenate([self.front[::-1, -1], below, self.back[1:-1, 0]])

    def neckline(self, c: Counts) -> IntArray:
        """Returns the nodes from the front edge's upper end to the middle of the closed side."""
        return np.concatenate([self.front[-1, : c.front_neck + 1], self.back[-1, c.seam + 1 :]])


def add_body(half: Builder, p: CoatParameters, shape: Shape, c: Counts) -> Body:
    """Adds the body below the underarm, and the front and back above it."""
    lower = _add_lower(half, p, shape, c)
    ring = lower[-1]
    front = np.empty((c.upper + 1, c.front + 1), dtype=np.int32)
    front[0] = ring[: c.front + 1]
    patch = coons(
        shape.ring[: c.front + 1],
        np.concatenate([shape.front_neck[:-1], shape.seam]),
        shape.front_edge,
        shape.front_armhole,
    )
    front[1:] = half.add(patch[1:])
    half.grid(front)

    back = np.empty((c.upper + 1, c.back + 1), dtype=np.int32)
    back[0] = ring[c.front + c.gap :]
    patch = coons(
        shape.ring[c.front + c.gap :],
        np.concatenate([shape.seam[:0:-1], shape.back_neck[::-1]]),
        shape.back_armhole,
        shape.back_middle,
    )
    back[1:-1] = half.add(patch[1:-1])
    back[-1, : c.seam + 1] = front[-1, : c.front_neck - 1 if c.front_neck else None : -1]
    back[-1, c.seam + 1 :] = half.add(patch[-1, c.seam + 1 :])
    half.grid(back)
    return Body(lower, front, back)


def _add_lower(half: Builder, p: CoatParameters, shape: Shape, c: Counts) -> IntArray:
    """Adds the body below the underarm and returns its nodes."""
    grid = np.repeat(shape.ring[None], c.lower + 1, axis=0)
    v = np.linspace(0.0, 1.0, c.lower + 1)[:, None]
    if shape.hem is not None:
        grid = (1 - v[..., None]) * shape.hem + v[..., None] * shape.ring
    grid[:, :, 2] = (1 - v) * -p.body_length + v * shape.ring[:, 2]
    # all columns of the back make room for the slit, so that none is squeezed
    parted = np.linspace(_VENT_GAP, _VENT_NARROW, c.vent + 1)[: c.vent]
    grid[: c.vent, -c.back - 1 :, 1] += parted[:, None] * np.linspace(0.0, 1.0, c.back + 1)
    nodes = half.add(grid)
    half.grid(nodes)
    return nodes


def add_sleeve(half: Builder, p: CoatParameters, armhole: IntArray, c: Counts) -> IntArray:
    """Adds the tube from the armhole to the cuff and returns the cuff's nodes."""
    start = half.position[armhole]
    slope = np.deg2rad(_SLEEVE_SLOPE if p.sleeve_slope_deg is None else p.sleeve_slope_deg)
    axis = np.array([0.0, np.cos(slope), -np.sin(slope)])
    up = np.array([0.0, np.sin(slope), np.cos(slope)])
    along = arc(np.concatenate([start, start[:1]]))
    angle = 2.0 * np.pi * (along[:-1] / along[-1])[:, None]
    circle = np.cos(angle) * up + np.sin(angle) * np.array([1.0, 0.0, 0.0])
    radius = p.cuff_girth / loop_length(circle, np.arange(len(circle)))
    end = start[0] + p.sleeve_length * axis + radius * (circle - up)
    v = np.linspace(0.0, 1.0, c.sleeve + 1)[1:, None, None]
    tube = (1 - v) * start + v * end
    if p.elbow_girth is not None:
        tube = _with_elbow(tube, v, p.elbow_girth, 0.5 * (start + end))
    nodes = np.vstack([armhole[None], half.add(tube)])
    half.grid(np.column_stack([nodes, nodes[:, 0]]))
    return nodes[-1]


def _with_elbow(tube: FloatArray, v: FloatArray, girth: float, middle: FloatArray) -> FloatArray:
    """Returns sections of a sleeve, widened about their centres to a girth halfway along it.

    Args:
        tube: (rows,k,3) sections, m.
        v: (rows,1,1) place of each along the sleeve, 0 to 1.
        girth: wanted halfway, m.
        middle: (k,3) the section halfway, m.
    """
    ratio = girth / loop_length(middle, np.arange(len(middle)))
    center = tube.mean(axis=1, keepdims=True)
    return np.asarray(center + (1.0 + (ratio - 1.0) * np.sin(np.pi * v)) * (tube - center))
