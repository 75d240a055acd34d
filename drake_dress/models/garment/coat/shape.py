"""The border curves of a coat's panels, and the numbers of columns and rows between them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat.curves import arch, bend, length, resample, scoop, unit_ellipse
from drake_dress.models.garment.coat.parameters import CoatParameters

_GAP_RATIO = 0.24  # fraction of the armhole girth below the arm, across the side of the body
_DIP_RATIO = 0.04  # dip of the middle of that part below its ends, over the armhole girth
_NAPE_DEPTH = 0.01  # m, of the closed side's neckline below the ends of the shoulder seams
_HOOD_HEIGHT = 0.3  # m
# Widest place of a neckline's end and how far it lies forward, over the neck's width.
_NECK_HALF, _NECK_FORWARD = 0.36, 0.42
# The shortest front edge above the underarm, over the armhole's depth: a lower neckline would cut
# into the armhole's panel.
_LEAST_EDGE = 0.3


class Counts(NamedTuple):
    """Columns and rows (intervals, not nodes) of the grids of the left half."""

    front: int
    gap: int
    back: int  # to the middle of the back
    seam: int
    upper: int
    lower: int
    sleeve: int
    collar: int
    front_neck: int  # columns of the front panel below the neckline
    lapel: int  # rows of the body below the underarm along which the lapel runs
    across: int  # rows of the lapel, from its fold to its edge
    vent: int  # rows of the slit
    hood: int


@dataclass(frozen=True)
class Shape:
    """Curves of the left half: ring from front edge to mid-back, panel borders from below up."""

    depth: float  # of the underarm below the shoulder tip, m
    ring: FloatArray  # at underarm level
    hem: FloatArray | None  # as the ring; None for a hem straight below it
    front_edge: FloatArray
    front_neck: FloatArray  # from the front edge to the neck; a single point where there is none
    front_armhole: FloatArray
    seam: FloatArray  # from the neck to the shoulder tip
    back_armhole: FloatArray
    back_middle: FloatArray
    back_neck: FloatArray  # from the middle to the neck


def lapel_width(p: CoatParameters) -> float:
    """Returns the largest width of a lapel, m."""
    return p.collar_height if p.lapel_width is None else p.lapel_width


def hood_height(p: CoatParameters) -> float:
    """Returns the height of a hood, m."""
    return _HOOD_HEIGHT if p.hood_height is None else p.hood_height


def count_cells(p: CoatParameters, shape: Shape, step: float) -> Counts:
    """Returns columns and rows whose edges are about `step`, m, long."""

    def count(*lengths: float, least: int) -> int:
        return max(least, round(float(np.mean(lengths)) / step))

    seam = count(length(shape.seam), least=2)
    gap = _GAP_RATIO * p.armhole_girth
    wide = p.chest if p.hem_girth is None else max(p.chest, 0.5 * (p.chest + p.hem_girth))
    quarter = 0.25 * wide - 0.5 * gap
    # the collar leans outward from the neckline, which is its shortest row
    back_neck = ceil(length(shape.back_neck) / (1.05 * step))
    front_neck = 0
    if p.neck_depth is not None:
        front_neck = ceil(length(shape.front_neck) / (1.05 * step))
    below = p.body_length - shape.depth
    lower = count(below, least=3)
    row = below / lower
    lapel = 0 if p.lapel_depth is None else round((p.lapel_depth - shape.depth) / row)
    vent = 0 if p.vent_length is None else round(p.vent_length / row)
    return Counts(
        # without a neckline the front panel ends at the shoulder seam; its inner edge is the lapel
        front=seam + front_neck,
        gap=count(gap, least=2),
        back=max(seam + back_neck, count(quarter, least=3)),
        seam=seam,
        upper=count(length(shape.front_armhole), length(shape.back_middle), least=3),
        lower=lower,
        sleeve=count(p.sleeve_length, 0.8 * p.sleeve_length, least=4),
        collar=ceil(p.collar_height / (1.2 * step)),
        front_neck=front_neck,
        lapel=min(max(lapel, 0), lower - 1),
        across=ceil(lapel_width(p) / (1.2 * step)),
        vent=min(max(vent, 1), lower - 1) if p.vent_length is not None else 0,
        hood=count(hood_height(p), 1.4 * hood_height(p), least=4),
    )


def solve_shape(p: CoatParameters, counts: Counts | None, source: str) -> Shape:
    """Solves the armhole's depth for its girth; without counts, on smooth curves.

    Raises:
        UserError: no depth gives the girth, or the armhole or the neckline would reach too low.
    """
    low, high = 0.25 * p.armhole_girth, 0.45 * p.armhole_girth
    if _armhole_girth(_shape_at(p, counts, low)) > p.armhole_girth:
        low = 0.1 * p.armhole_girth
    for _ in range(40):
        depth = 0.5 * (low + high)
        if _armhole_girth(_shape_at(p, counts, depth)) < p.armhole_girth:
            low = depth
        else:
            high = depth
    shape = _shape_at(p, counts, depth)
    if abs(_armhole_girth(shape) - p.armhole_girth) > 0.01 * p.armhole_girth:
        raise UserError(
            source,
            "armhole_girth",
            f"{p.armhole_girth} m cannot be met with shoulder_width {p.shoulder_width} m and "
            f"chest {p.chest} m",
        )
    if depth > 0.7 * p.body_length:
        raise UserError(
            source,
            "armhole_girth",
            f"is {p.armhole_girth} m: the armhole would reach {depth:.2f} m down, expected at "
            f"most 0.7 of body_length ({p.body_length} m)",
        )
    deepest = p.shoulder_slope + (1.0 - _LEAST_EDGE) * depth
    if p.neck_depth is not None and p.neck_depth > deepest:
        raise UserError(
            source,
            "neck_depth",
            f"is {p.neck_depth} m, expected at most {deepest:.2f} m for an armhole that reaches "
            f"{depth:.2f} m down",
        )
    return shape


def _armhole_girth(shape: Shape) -> float:
    front, back = shape.front_armhole[0], shape.back_armhole[0]
    first = int(np.argmin(np.linalg.norm(shape.ring - front, axis=1)))
    last = int(np.argmin(np.linalg.norm(shape.ring - back, axis=1)))
    gap = length(shape.ring[first : last + 1])
    return gap + length(shape.front_armhole) + length(shape.back_armhole)


def _shape_at(p: CoatParameters, counts: Counts | None, depth: float) -> Shape:
    c = counts or Counts(60, 30, 60, 30, 60, 60, 60, 10, 20, 0, 0, 0, 0)
    half_gap, opening = (
        0.5 * _GAP_RATIO * p.armhole_girth / p.chest,
        0.5 * p.front_opening / p.chest,
    )
    u = np.concatenate(
        [
            np.linspace(opening, 0.25 - half_gap, c.front + 1),
            np.linspace(0.25 - half_gap, 0.25 + half_gap, c.gap + 1)[1:],
            np.linspace(0.25 + half_gap, 0.5, c.back + 1)[1:],
        ]
    )
    points, girth = unit_ellipse(u)
    ring = np.column_stack([points * (p.chest / girth), np.full(len(u), -depth)])
    ring[-1, 1] = 0.0
    dip = np.sin(np.linspace(0.0, np.pi, c.gap + 1))
    ring[c.front : c.front + c.gap + 1, 2] -= _DIP_RATIO * p.armhole_girth * dip
    tip = np.array([0.0, 0.5 * p.shoulder_width, 0.0])
    neck = np.array([0.0, 0.5 * p.neck_width, p.shoulder_slope])
    front, back = ring[0], ring[-1]
    nape_depth = _NAPE_DEPTH if p.nape_depth is None else p.nape_depth
    nape = np.array([-0.25 * p.neck_width, 0.0, p.shoulder_slope - nape_depth])
    top, front_neck = _front_neck(p, neck, c.front_neck)
    return Shape(
        depth=depth,
        ring=ring,
        hem=_hem(p, u, opening),
        front_edge=resample(bend(front, top), c.upper),
        front_neck=front_neck,
        front_armhole=resample(arch(ring[c.front], tip), c.upper),
        seam=neck + np.linspace(0.0, 1.0, c.seam + 1)[:, None] * (tip - neck),
        back_armhole=resample(arch(ring[c.front + c.gap], tip), c.upper),
        back_middle=resample(bend(back, nape), c.upper),
        back_neck=resample(scoop(nape, neck), c.back - c.seam),
    )


def _front_neck(p: CoatParameters, neck: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Returns the upper end of the front edge, and the neckline from there to the neck."""
    if p.neck_depth is None:
        return neck, neck[None]
    top = np.array(
        [
            _NECK_FORWARD * p.neck_width,
            min(0.5 * p.front_opening, _NECK_HALF * p.neck_width),
            p.shoulder_slope - p.neck_depth,
        ]
    )
    return top, resample(scoop(top, neck), count)


def _hem(p: CoatParameters, u: FloatArray, opening: float) -> FloatArray | None:
    """Returns the hem below each column of the ring, None if it is straight below.

    Args:
        p: measures.
        u: fraction of the chest girth at which each column is, from the middle of the front.
        opening: the same fraction of the front edge.
    """
    if p.hem_girth is None and p.hem_opening is None:
        return None
    hem_girth = p.chest if p.hem_girth is None else p.hem_girth
    edge = opening if p.hem_opening is None else 0.5 * p.hem_opening / hem_girth
    points, girth = unit_ellipse(edge + (u - opening) / (0.5 - opening) * (0.5 - edge))
    hem = np.column_stack([points * (hem_girth / girth), np.full(len(u), -p.body_length)])
    hem[-1, 1] = 0.0
    return hem
