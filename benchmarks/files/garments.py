"""Garments with known openings: a trunk with two sleeves, cut open at all its ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.files.surface import kept, zero_level
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.edges import border_edges
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.mend import mended

_STEP = 0.03  # of the grid, m
_BLEND = 0.03  # width over which trunk and sleeve are blended, m
_IN_PLANE = 0.01  # largest distance of a cuff's edges from its plane, m
_WALL = 0.9  # share of the cuff's plane at which the sleeve's radius is the cuff's


@dataclass(frozen=True)
class Cut:
    """Measures of a garment, m and rad. It faces +x, left is +y, z is up, z = 0 at the shoulders.

    Attributes:
        half_width: of the trunk; half_depth: of the trunk, front to back.
        length: of the trunk below the shoulders.
        shoulder: distance of a sleeve's beginning from the middle.
        sleeve: length along its axis; slope: of the axis below the horizontal.
        upper: radius where the sleeve begins; cuff: radius at its end.
        neck: radius of the neck's opening.
        is_open: whether the front is open from neck to hem.
        hood: whether it has a hood, whose opening is in front.
    """

    half_width: float = 0.27
    half_depth: float = 0.14
    length: float = 0.72
    shoulder: float = 0.19
    sleeve: float = 0.52
    slope: float = 0.35
    upper: float = 0.095
    cuff: float = 0.055
    neck: float = 0.085
    is_open: bool = True
    hood: bool = False


@dataclass(frozen=True)
class Made:
    """A garment and what is true of it.

    Attributes:
        x: (n,3), m; faces: (F,3), counter-clockwise seen from outside.
        cuffs: middle (3,) of each cuff, m, by side.
        cuff_girths: of each cuff, as the mesh has it, m, by side.
        armholes: where each sleeve begins, (3,) m, by side.
        front: `front` if it is open, else `closed`.
    """

    x: FloatArray
    faces: IntArray
    cuffs: dict[str, FloatArray]
    cuff_girths: dict[str, float]
    armholes: dict[str, FloatArray]
    front: str


def drawn_cut(rng: np.random.Generator) -> Cut:
    """Returns measures between those of a short blouse and of a wide coat."""
    u = rng.uniform
    upper = u(0.08, 0.105)
    return Cut(
        half_width=u(0.24, 0.3),
        half_depth=u(0.12, 0.16),
        length=u(0.55, 0.95),
        shoulder=u(0.17, 0.2),
        sleeve=u(0.3, 0.58),
        slope=u(0.1, 0.6),
        upper=upper,
        cuff=u(0.05, 0.8 * upper),
        neck=u(0.075, 0.095),
    )


def sides(cut: Cut) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Returns where each sleeve's axis begins (3,), m, and its direction."""
    drop = cut.upper + 0.01
    return {
        side: (
            np.array([0.0, sign * cut.shoulder, -drop]),
            np.array([0.0, sign * np.cos(cut.slope), -np.sin(cut.slope)]),
        )
        for side, sign in (("left", 1.0), ("right", -1.0))
    }


def solid(cut: Cut, x: FloatArray) -> FloatArray:
    """Returns (k,) about the distance of points from the garment's surface, negative inside, m."""
    ellipse = np.hypot(x[:, 0] / cut.half_depth, x[:, 1] / cut.half_width)
    trunk = (ellipse - 1.0) * min(cut.half_depth, cut.half_width)
    trunk = np.maximum(trunk, x[:, 2] + 0.3 * np.abs(x[:, 1]) - 0.02)
    trunk = np.maximum(trunk, -cut.length - 0.1 - x[:, 2])
    if cut.hood:
        head = np.linalg.norm((x - [0.0, 0.0, 0.15]) / [1.0, 0.9, 1.2], axis=1) - 0.14
        trunk = _blended(trunk, head)
    for start, along in sides(cut).values():
        reach = (x - start) @ along
        off = np.linalg.norm(x - start - reach[:, None] * along, axis=1)
        share = np.clip(reach / (_WALL * cut.sleeve), 0.0, 1.0)
        sleeve = off - (cut.upper + share * (cut.cuff - cut.upper))
        sleeve = np.maximum(sleeve, np.maximum(-reach, reach - cut.sleeve - 0.05))
        trunk = _blended(trunk, sleeve)
    return trunk


def make(cut: Cut) -> Made:
    """Returns a garment of these measures."""
    reach = cut.shoulder + cut.sleeve + 0.12
    low = np.array([-0.25, -reach, -max(cut.length, cut.sleeve) - 0.25])
    high = np.array([0.25, reach, 0.4 if cut.hood else 0.1])
    x, faces = zero_level(lambda p: solid(cut, p), low, high, _STEP)
    for start, along in sides(cut).values():
        beyond = (x - start) @ along - cut.sleeve
        x, faces = kept(x, faces, -beyond)
    # the hem is lower at the left, so that a garment and its mirror image differ
    x, faces = kept(x, faces, np.maximum(x[:, 2] + cut.length + 0.1 * x[:, 1], near_sleeve(cut, x)))
    if cut.hood:
        hole = np.linalg.norm((x - [0.14, 0.0, 0.16]) / [1.0, 0.8, 1.0], axis=1) - 0.11
        x, faces = kept(x, faces, hole)
    else:
        hole = np.linalg.norm(x - [0.02, 0.0, 0.01], axis=1) - cut.neck
        x, faces = kept(x, faces, hole)
    if cut.is_open:
        strip = np.maximum(np.abs(x[:, 1] - 0.01) - 0.02, -x[:, 0])
        x, faces = kept(x, faces, strip)
    # borders that touch in a node are parted, as in any sound file
    sound = mended(RawMesh.of("made", x, faces.astype(np.int64))).mesh
    x, faces = sound.position, sound.faces.astype(np.int32)
    ends = {side: start + cut.sleeve * along for side, (start, along) in sides(cut).items()}
    begins = {side: start for side, (start, _) in sides(cut).items()}
    front = "front" if cut.is_open else "closed"
    girths = {side: _cuff_girth(cut, side, x, faces) for side in ends}
    return Made(x, faces, ends, girths, begins, front)


def _cuff_girth(cut: Cut, side: str, x: FloatArray, faces: IntArray) -> float:
    """Returns the length of all border edges in the plane of a cuff, m."""
    start, along = sides(cut)[side]
    ends = x[border_edges(faces, len(x))]
    offset = ends.mean(axis=1) - start - cut.sleeve * along
    flat = np.abs(offset @ along) < _IN_PLANE
    near = np.linalg.norm(offset, axis=1) < 2.0 * cut.upper
    return float(np.linalg.norm(ends[flat & near, 1] - ends[flat & near, 0], axis=1).sum())


def near_sleeve(cut: Cut, x: FloatArray) -> FloatArray:
    """Returns (k,) a positive value around the outer halves of the sleeves, which no hem cuts."""
    off = []
    for start, along in sides(cut).values():
        reach = np.clip((x - start) @ along, 0.3 * cut.sleeve, None)
        off.append(np.linalg.norm(x - start - reach[:, None] * along, axis=1))
    return np.asarray(1.5 * cut.upper - np.min(off, axis=0))


def trousers() -> tuple[FloatArray, IntArray]:
    """Returns two legs and a waist."""

    def field(x: FloatArray) -> FloatArray:
        legs = [np.hypot(x[:, 0], x[:, 1] - sign * (0.1 - 0.1 * x[:, 2])) - 0.1 for sign in (1, -1)]
        hips = np.hypot(x[:, 0] / 0.13, x[:, 1] / 0.2) * 0.13 - 0.13
        hips = np.maximum(hips, -0.12 - x[:, 2])
        both = np.maximum(_blended(*legs), np.maximum(x[:, 2] - 0.25, -1.1 - x[:, 2]))
        return np.maximum(_blended(both, hips), x[:, 2] - 0.25)

    low, high = np.array([-0.3, -0.45, -1.2]), np.array([0.3, 0.45, 0.4])
    x, faces = zero_level(field, low, high, _STEP)
    x, faces = kept(x, faces, 0.2 - x[:, 2])
    return kept(x, faces, x[:, 2] + 1.0)


def skirt() -> tuple[FloatArray, IntArray]:
    """Returns a cone that is open above and below, beneath a blazer."""

    def field(x: FloatArray) -> FloatArray:
        return np.hypot(x[:, 0] / 0.7, x[:, 1]) - (0.2 - 0.25 * (x[:, 2] + 0.9))

    low, high = np.array([-0.5, -0.6, -1.6]), np.array([0.5, 0.6, -0.9])
    return zero_level(field, low, high, _STEP)


def _blended(one: FloatArray, other: FloatArray) -> FloatArray:
    """Returns the smooth minimum (Quilez's polynomial)."""
    share = np.clip(_BLEND - np.abs(one - other), 0.0, None) / _BLEND
    return np.asarray(np.minimum(one, other) - 0.25 * _BLEND * share**2)
