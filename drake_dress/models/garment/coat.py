"""A parametric open-front coat.

The left half is a few structured grids that share their border nodes, so that every seam is closed
by construction. The right half is its mirror image. The grids are

    lower    columns around the left half of the chest ellipse × rows from hem to underarm,
    front    from the underarm level up to the shoulder seam; its inner edge is the lapel,
    back     the same behind; it shares the nodes of the shoulder seam with the front,
    sleeve   a tube from the armhole loop (the columns under the arm between front and back,
             and the outer edges of both) to the cuff circle,
    collar   a strip that stands on the neckline of the back.

The spacing gives the numbers of columns and rows. The sizes are then solved on the polygons, so
that girths are met at any spacing and not only in the limit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import ceil
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths, loop_length

SPACING_RANGE = (0.01, 0.06)  # m


@dataclass(frozen=True)
class CoatParameters:
    """Measures of a coat.

    Attributes:
        body_length: height of the shoulder tips above the hem, m.
        chest: girth at the underarm, closed over the open front, m.
        shoulder_width: distance between the shoulder tips, m.
        sleeve_length: length from the shoulder tip to the cuff, along the top, m.
        armhole_girth: girth of an armhole, m.
        cuff_girth: girth of a cuff, m.
        collar_height: height of the collar, m.
        neck_width: distance between the inner ends of the shoulder seams, m.
        front_opening: gap between the front edges at the underarm, part of the chest girth, m.
        shoulder_slope: height of a shoulder seam's inner end above its outer end, m.
        grasp_fraction: place of the grasp along the shoulder seam, neck (0) to shoulder tip (1).
        grasp_radius: radius within which a gripper holds the cloth, m. With 0 it holds the whole
            seam.
    """

    body_length: float = 0.72
    chest: float = 1.16
    shoulder_width: float = 0.46
    sleeve_length: float = 0.56
    armhole_girth: float = 0.54
    cuff_girth: float = 0.32
    collar_height: float = 0.05
    neck_width: float = 0.17
    front_opening: float = 0.22
    shoulder_slope: float = 0.04
    grasp_fraction: float = 0.75
    grasp_radius: float = 0.035


COATS = {
    "overcoat": CoatParameters(
        body_length=0.98,
        chest=1.26,
        shoulder_width=0.49,
        sleeve_length=0.62,
        armhole_girth=0.60,
        cuff_girth=0.36,
        collar_height=0.07,
        neck_width=0.18,
    ),
    "jacket": CoatParameters(
        body_length=0.64,
        chest=1.10,
        shoulder_width=0.44,
        sleeve_length=0.57,
        armhole_girth=0.52,
        cuff_girth=0.30,
        collar_height=0.04,
    ),
}


def make_coat(
    parameters: CoatParameters,
    spacing: float,
    source: str = "coat",
    like: CoatParameters | None = None,
) -> GarmentMesh:
    """Returns an open-front coat in the canonical rest pose of `GarmentMesh`.

    The mesh is manifold, symmetric about y = 0 (except for the order of nodes), and oriented
    outward. Its boundaries are the two cuffs and the rim: hem, front edges and collar. Armhole and
    cuff loops begin at the shoulder tip and run along the front first; entry k of both is the same
    column of the sleeve.

    Args:
        parameters: measures of the coat.
        spacing: desired mean edge length, m; met to 25 %.
        source: file or name at the beginning of error messages.
        like: measures of another coat. The mesh then has the same nodes and loops as the other
            coat's mesh at this spacing, each at the same place of the pattern, so that nodal
            arrays of both can be compared. Only the other coat meets the spacing. The held nodes
            and the diagonals of the grids follow the coat's own measures.

    Raises:
        UserError: a measure or the spacing is out of range, or measures contradict each other.
    """
    _check(parameters, spacing, source)
    if like is None:
        return _at_spacing(parameters, spacing, source)[1]
    _check(like, spacing, source)
    counts, _ = _at_spacing(like, spacing, source)
    return _build(parameters, _shape(parameters, counts, source), counts, source)


def _at_spacing(p: CoatParameters, spacing: float, source: str) -> tuple[_Counts, GarmentMesh]:
    """Returns a coat's mesh, and the numbers of columns and rows that it was built with."""
    draft = _shape(p, None, source)
    for fill in _FILLS:
        counts = _count(p, draft, fill * spacing)
        mesh = _build(p, _shape(p, counts, source), counts, source)
        if edge_lengths(mesh.rest_position, mesh.faces).max() <= _LONGEST * spacing:
            break
    return counts, mesh


_RANGES = {
    "body_length": (0.4, 1.5),
    "chest": (0.7, 1.9),
    "shoulder_width": (0.28, 0.7),
    "sleeve_length": (0.2, 0.9),
    "armhole_girth": (0.36, 0.85),
    "cuff_girth": (0.18, 0.6),
    "collar_height": (0.02, 0.15),
    "neck_width": (0.1, 0.26),
    "front_opening": (0.01, 0.4),
    "shoulder_slope": (0.0, 0.08),
    "grasp_fraction": (0.0, 1.0),
    "grasp_radius": (0.0, 0.12),
}
_DEPTH_RATIO = 0.55  # depth over width of the chest ellipse, from body measures
_GAP_RATIO = 0.24  # fraction of the armhole girth below the arm, across the side of the body
_DIP_RATIO = 0.04  # dip of the middle of that part below its ends, over the armhole girth
_SLEEVE_SLOPE = np.deg2rad(58.0)  # of the sleeves below the horizontal
_FEWEST_HELD = 4  # nodes of a gripper: three may lie on a line, about which the cloth could turn
_COLLAR_LEAN = np.deg2rad(8.0)  # of the collar outward from the vertical
_FILLS = (1.0, 0.95, 0.9, 0.85, 0.8)  # grid step over spacing, tried in order
_LONGEST = 1.6  # longest edge over spacing
_MIRROR = np.array([1.0, -1.0, 1.0])


class _Counts(NamedTuple):
    """Columns and rows (intervals, not nodes) of the grids of the left half."""

    front: int
    gap: int
    back: int  # to the middle of the back
    seam: int
    upper: int
    lower: int
    sleeve: int
    collar: int


@dataclass(frozen=True)
class _Shape:
    """Curves of the left half: ring from front edge to mid-back, panel borders from below up."""

    depth: float  # of the underarm below the shoulder tip, m
    ring: FloatArray  # at underarm level
    front_edge: FloatArray
    front_armhole: FloatArray
    seam: FloatArray  # from the neck to the shoulder tip
    back_armhole: FloatArray
    back_middle: FloatArray
    back_neck: FloatArray  # from the middle to the neck


def _check(p: CoatParameters, spacing: float, source: str) -> None:
    for entry in fields(p):
        low, high = _RANGES[entry.name]
        value = getattr(p, entry.name)
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
            raise UserError(source, entry.name, f"is {value!r}, expected a number")
        if not low <= value <= high:
            unit = "" if entry.name == "grasp_fraction" else " m"
            raise UserError(source, entry.name, f"is {value}{unit}, expected {low} to {high}{unit}")
    low, high = SPACING_RANGE
    if not low <= spacing <= high:
        raise UserError(source, "spacing", f"is {spacing} m, expected {low} to {high} m")
    if not 0.4 * p.armhole_girth <= p.cuff_girth <= p.armhole_girth:
        raise UserError(
            source,
            "cuff_girth",
            f"is {p.cuff_girth} m, expected {0.4 * p.armhole_girth:.2f} to {p.armhole_girth} m "
            f"(0.4 to 1 times armhole_girth)",
        )
    if p.shoulder_width < p.neck_width + 0.12:
        raise UserError(
            source,
            "shoulder_width",
            f"is {p.shoulder_width} m, expected at least 0.12 m more than neck_width "
            f"({p.neck_width} m)",
        )
    breadth = p.chest / _unit_ellipse(_U)[1] * 2.0
    if not 0.7 * breadth <= p.shoulder_width <= 1.35 * breadth:
        raise UserError(
            source,
            "shoulder_width",
            f"is {p.shoulder_width} m, expected {0.7 * breadth:.2f} to {1.35 * breadth:.2f} m "
            f"for a chest of {p.chest} m",
        )


def _count(p: CoatParameters, shape: _Shape, step: float) -> _Counts:
    def count(*lengths: float, least: int) -> int:
        return max(least, round(float(np.mean(lengths)) / step))

    seam = count(_length(shape.seam), least=2)
    gap = _GAP_RATIO * p.armhole_girth
    quarter = 0.25 * p.chest - 0.5 * gap
    # the collar leans outward from the neckline, which is its shortest row
    back_neck = ceil(_length(shape.back_neck) / (1.05 * step))
    return _Counts(
        front=seam,  # the front panel ends at the shoulder seam; its inner edge is the lapel
        gap=count(gap, least=2),
        back=max(seam + back_neck, count(quarter, least=3)),
        seam=seam,
        upper=count(_length(shape.front_armhole), _length(shape.back_middle), least=3),
        lower=count(p.body_length - shape.depth, least=3),
        sleeve=count(p.sleeve_length, 0.8 * p.sleeve_length, least=4),
        collar=ceil(p.collar_height / (1.2 * step)),
    )


def _shape(p: CoatParameters, counts: _Counts | None, source: str) -> _Shape:
    """Solves the armhole's depth for its girth; without counts, on smooth curves."""
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
    return shape


def _armhole_girth(shape: _Shape) -> float:
    front, back = shape.front_armhole[0], shape.back_armhole[0]
    first = int(np.argmin(np.linalg.norm(shape.ring - front, axis=1)))
    last = int(np.argmin(np.linalg.norm(shape.ring - back, axis=1)))
    gap = _length(shape.ring[first : last + 1])
    return gap + _length(shape.front_armhole) + _length(shape.back_armhole)


def _shape_at(p: CoatParameters, counts: _Counts | None, depth: float) -> _Shape:
    c = counts or _Counts(60, 30, 60, 30, 60, 60, 60, 10)
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
    points, girth = _unit_ellipse(u)
    ring = np.column_stack([points * (p.chest / girth), np.full(len(u), -depth)])
    ring[-1, 1] = 0.0
    dip = np.sin(np.linspace(0.0, np.pi, c.gap + 1))
    ring[c.front : c.front + c.gap + 1, 2] -= _DIP_RATIO * p.armhole_girth * dip
    tip = np.array([0.0, 0.5 * p.shoulder_width, 0.0])
    neck = np.array([0.0, 0.5 * p.neck_width, p.shoulder_slope])
    front, back = ring[0], ring[-1]
    nape = np.array([-0.25 * p.neck_width, 0.0, p.shoulder_slope - 0.01])
    return _Shape(
        depth=depth,
        ring=ring,
        front_edge=_resample(_bend(front, neck), c.upper),
        front_armhole=_resample(_arch(ring[c.front], tip), c.upper),
        seam=neck + np.linspace(0.0, 1.0, c.seam + 1)[:, None] * (tip - neck),
        back_armhole=_resample(_arch(ring[c.front + c.gap], tip), c.upper),
        back_middle=_resample(_bend(back, nape), c.upper),
        back_neck=_resample(_scoop(nape, neck), c.back - c.seam),
    )


_U = np.linspace(0.0, 0.5, 200)


def _unit_ellipse(u: FloatArray) -> tuple[FloatArray, float]:
    """Returns points at arc fractions u of an ellipse of half width 1, and their polygon's girth.

    The mirror image is the polygon's other half.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 2001)
    curve = np.column_stack([_DEPTH_RATIO * np.cos(angle), np.sin(angle)])
    arc = _arc(curve)
    points = np.column_stack([np.interp(u * arc[-1], arc, curve[:, k]) for k in (0, 1)])
    return points, 2.0 * (_length(points) + float(points[0, 1]))


_T = np.linspace(0.0, 1.0, 100)[:, None]
_SIN, _COS = np.sin(0.5 * np.pi * _T), np.cos(0.5 * np.pi * _T)


def _arch(corner: FloatArray, tip: FloatArray) -> FloatArray:
    """Returns the armhole's edge: a quarter ellipse that starts upward and ends level."""
    curve = corner + (tip - corner) * _SIN
    curve[:, 0] = corner[0] * _COS[:, 0]
    return curve


def _scoop(middle: FloatArray, neck: FloatArray) -> FloatArray:
    """Returns the neckline: a blend of a V and a quarter ellipse.

    The ellipse alone would squeeze the columns of the panel.
    """
    bow = (neck - middle) * (1.0 - _COS)
    bow[:, 1] = (neck[1] - middle[1]) * _SIN[:, 0]
    return middle + 0.35 * bow + 0.65 * (neck - middle) * _T


def _bend(low: FloatArray, high: FloatArray) -> FloatArray:
    """Returns the inner edge of a panel: it starts upward and then leans toward the neck."""
    control = np.array([low[0], low[1], 0.5 * (low[2] + high[2])])
    return (1 - _T) ** 2 * low + 2 * _T * (1 - _T) * control + _T**2 * high


def _arc(curve: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])


def _length(curve: FloatArray) -> float:
    return float(_arc(curve)[-1])


def _resample(curve: FloatArray, count: int) -> FloatArray:
    arc = _arc(curve)
    at = np.linspace(0.0, arc[-1], count + 1)
    return np.column_stack([np.interp(at, arc, curve[:, k]) for k in range(3)])


def _coons(bottom: FloatArray, top: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Returns the Coons patch (rows + 1, columns + 1, 3) between four border curves."""
    v = np.linspace(0.0, 1.0, len(start))[:, None, None]
    u = np.linspace(0.0, 1.0, len(bottom))[None, :, None]
    between_rows = (1 - v) * bottom[None] + v * top[None]
    between_columns = (1 - u) * start[:, None] + u * end[:, None]
    corners = (1 - v) * ((1 - u) * bottom[0] + u * bottom[-1]) + v * (
        (1 - u) * top[0] + u * top[-1]
    )
    return np.asarray(between_rows + between_columns - corners)


@dataclass
class _Builder:
    """Collects nodes and faces; grids are joined where they use the same nodes."""

    points: list[FloatArray] = field(default_factory=list)
    faces: list[IntArray] = field(default_factory=list)
    count: int = 0

    def add(self, points: FloatArray) -> IntArray:
        """Returns the indices of new nodes, shaped as the points are."""
        new = np.arange(self.count, self.count + points.size // 3, dtype=np.int32)
        self.points.append(points.reshape(-1, 3))
        self.count += len(new)
        return new.reshape(points.shape[:-1])

    @property
    def position(self) -> FloatArray:
        return np.concatenate(self.points)

    def grid(self, nodes: IntArray) -> None:
        """Adds the triangles of a grid, oriented outward if rows go up and columns go left."""
        a, b = nodes[:-1, :-1].ravel(), nodes[:-1, 1:].ravel()
        d, c = nodes[1:, :-1].ravel(), nodes[1:, 1:].ravel()
        x = self.position
        first = np.linalg.norm(x[a] - x[c], axis=1)
        second = np.linalg.norm(x[b] - x[d], axis=1)
        odd = (np.indices((nodes.shape[0] - 1, nodes.shape[1] - 1)).sum(axis=0) % 2).ravel() == 1
        # the shorter diagonal; alternating if both are alike, so that the cloth prefers no bias
        along = np.where(np.abs(first - second) < 0.05 * (first + second), odd, first < second)
        self.faces.append(
            np.concatenate(
                [
                    np.stack([a, b, np.where(along, c, d)], axis=1),
                    np.stack([np.where(along, a, b), c, d], axis=1),
                ]
            )
        )


def _build(p: CoatParameters, shape: _Shape, c: _Counts, source: str) -> GarmentMesh:
    half = _Builder()
    ring = _lower(half, p, shape, c)
    front = np.empty((c.upper + 1, c.front + 1), dtype=np.int32)
    front[0] = ring[: c.front + 1]
    patch = _coons(
        shape.ring[: c.front + 1],
        shape.seam,
        shape.front_edge,
        shape.front_armhole,
    )
    front[1:] = half.add(patch[1:])
    half.grid(front)

    back = np.empty((c.upper + 1, c.back + 1), dtype=np.int32)
    back[0] = ring[c.front + c.gap :]
    patch = _coons(
        shape.ring[c.front + c.gap :],
        np.concatenate([shape.seam[:0:-1], shape.back_neck[::-1]]),
        shape.back_armhole,
        shape.back_middle,
    )
    back[1:-1] = half.add(patch[1:-1])
    back[-1, : c.seam + 1] = front[-1, ::-1]
    back[-1, c.seam + 1 :] = half.add(patch[-1, c.seam + 1 :])
    half.grid(back)
    body_count = half.count

    armhole = np.concatenate(
        [front[::-1, -1], ring[c.front + 1 : c.front + c.gap + 1], back[1:-1, 0]]
    )
    cuff = _sleeve(half, p, armhole, c)
    sleeve_end = half.count
    neckline = np.concatenate([front[-1, :1], back[-1, c.seam + 1 :]])
    _collar(half, p, neckline, c)

    region = np.zeros(half.count, dtype=np.int8)
    region[body_count:sleeve_end] = 1
    region[sleeve_end:] = 3
    hold = shape.seam[0] + p.grasp_fraction * (shape.seam[-1] - shape.seam[0])
    far = np.linalg.norm(half.position - hold, axis=1)
    count = max(_FEWEST_HELD, int(np.count_nonzero(far <= p.grasp_radius)))
    grasp = np.argsort(far, kind="stable")[:count].astype(np.int32)
    if p.grasp_radius == 0.0:
        grasp = front[-1]
    return _mirrored(half, armhole, cuff, grasp, region, source)


def _lower(half: _Builder, p: CoatParameters, shape: _Shape, c: _Counts) -> IntArray:
    """Adds the body below the underarm and returns the nodes of its top row."""
    grid = np.repeat(shape.ring[None], c.lower + 1, axis=0)
    v = np.linspace(0.0, 1.0, c.lower + 1)[:, None]
    grid[:, :, 2] = (1 - v) * -p.body_length + v * shape.ring[:, 2]
    nodes = half.add(grid)
    half.grid(nodes)
    return nodes[-1]


def _sleeve(half: _Builder, p: CoatParameters, armhole: IntArray, c: _Counts) -> IntArray:
    """Adds the tube from the armhole to the cuff and returns the cuff's nodes."""
    start = half.position[armhole]
    axis = np.array([0.0, np.cos(_SLEEVE_SLOPE), -np.sin(_SLEEVE_SLOPE)])
    up = np.array([0.0, np.sin(_SLEEVE_SLOPE), np.cos(_SLEEVE_SLOPE)])
    arc = _arc(np.concatenate([start, start[:1]]))
    angle = 2.0 * np.pi * (arc[:-1] / arc[-1])[:, None]
    circle = np.cos(angle) * up + np.sin(angle) * np.array([1.0, 0.0, 0.0])
    radius = p.cuff_girth / loop_length(circle, np.arange(len(circle)))
    end = start[0] + p.sleeve_length * axis + radius * (circle - up)
    v = np.linspace(0.0, 1.0, c.sleeve + 1)[1:, None, None]
    nodes = np.vstack([armhole[None], half.add((1 - v) * start + v * end)])
    half.grid(np.column_stack([nodes, nodes[:, 0]]))
    return nodes[-1]


def _collar(half: _Builder, p: CoatParameters, neckline: IntArray, c: _Counts) -> None:
    start = half.position[neckline]
    middle = np.array([0.5 * (start[0, 0] + start[-1, 0]), 0.0])
    outward = (start[:, :2] - middle) / np.linalg.norm(start[:, :2] - middle, axis=1)[:, None]
    rise = np.column_stack(
        [np.sin(_COLLAR_LEAN) * outward, np.full(len(start), np.cos(_COLLAR_LEAN))]
    )
    v = np.linspace(0.0, p.collar_height, c.collar + 1)[1:, None, None]
    half.grid(np.vstack([neckline[None], half.add(start + v * rise)]))


def _mirrored(
    half: _Builder,
    armhole: IntArray,
    cuff: IntArray,
    grasp: IntArray,
    region: npt.NDArray[np.int8],
    source: str,
) -> GarmentMesh:
    """Adds the right half, which shares the nodes in the middle of the back."""
    left = half.position
    aside = left[:, 1] > 0.0
    image = np.arange(len(left), dtype=np.int32)
    image[aside] = len(left) + np.arange(np.count_nonzero(aside), dtype=np.int32)
    faces = np.concatenate(half.faces)
    if np.isin(image[grasp], grasp).any():
        raise UserError(
            source,
            "grasp_radius",
            f"holds {len(grasp)} nodes: both grippers would hold the same",
        )
    right_region = region[aside]
    right_region[right_region == 1] = 2
    return GarmentMesh(
        rest_position=np.concatenate([left, left[aside] * _MIRROR]),
        faces=np.concatenate([faces, image[faces][:, ::-1]]).astype(np.int32),
        loops={
            "left_armhole": armhole,
            "left_cuff": cuff,
            "right_armhole": image[armhole],
            "right_cuff": image[cuff],
        },
        grasp={"left": grasp, "right": image[grasp]},
        region=np.concatenate([region, right_region]),
    )
