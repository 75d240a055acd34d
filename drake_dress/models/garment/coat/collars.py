"""What is sewn to a coat's neckline and front edges: collar, lapels, shawl or hood.

A lapel rests folded outward and stands off the front by an angle, so that the layers do not touch.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.coat.builder import Builder
from drake_dress.models.garment.coat.curves import arc, coons, cubic, resample
from drake_dress.models.garment.coat.panels import Body
from drake_dress.models.garment.coat.parameters import CoatParameters
from drake_dress.models.garment.coat.shape import Counts, hood_height, lapel_width

_COLLAR_LEAN = np.deg2rad(8.0)  # of the collar outward from the vertical
_FOLD = np.deg2rad(50.0)  # of a lapel above the front that it is folded back on
# Width of a lapel at its lower end, over the largest, and the share of its length over which it
# widens.
_NARROW, _WIDENS = 0.6, 0.7
# Slope of a lapel's upper end, and the share of its length over which it turns down to that.
_NOTCH, _NOTCH_LENGTH = 0.6, 0.35
_SMOOTH = 0.04  # m along a fold, over which the directions of a strip are averaged
_SHAWL_TURN = 0.5  # share of a shawl's front, below the neck, over which it begins to stand up
_HOOD_LEAN = np.deg2rad(28.0)  # of a hood backward: it is off the head, ready to be put on


def add_collar(half: Builder, p: CoatParameters, body: Body, c: Counts) -> None:
    """Adds the collar that the measures ask for."""
    neckline = body.neckline(c)
    edge = np.concatenate([body.lower[c.lower - c.lapel : -1, 0], body.front[:, 0]])
    if p.collar in ("stand", "lapel"):
        _add_strip(half, neckline, _standing(half, neckline), p.collar_height, c.collar)
    if p.collar == "lapel":
        width = _lapel_widths(half.position[edge], lapel_width(p))
        rise = _notched(_folded(half, body, c), half.position[edge])
        _add_strip(half, edge, rise, width, c.across)
    elif p.collar == "shawl":
        _add_shawl(half, p, body, c, edge, neckline)
    elif p.collar == "hood":
        _add_hood(half, p, neckline, c)


def _add_strip(
    half: Builder, fold: IntArray, rise: FloatArray, width: float | FloatArray, rows: int
) -> None:
    """Adds a strip of cloth that is sewn to nodes and extends along a direction at each."""
    start = half.position[fold]
    v = np.linspace(0.0, width, rows + 1)[1:].reshape(rows, -1, 1)
    half.grid(np.vstack([fold[None], half.add(start + v * rise)]))


def _standing(half: Builder, neckline: IntArray) -> FloatArray:
    """Returns unit directions of a collar that stands on the neckline."""
    start = half.position[neckline]
    middle = np.array([0.5 * (start[0, 0] + start[-1, 0]), 0.0])
    outward = (start[:, :2] - middle) / np.linalg.norm(start[:, :2] - middle, axis=1)[:, None]
    return np.column_stack(
        [np.sin(_COLLAR_LEAN) * outward, np.full(len(start), np.cos(_COLLAR_LEAN))]
    )


def _folded(half: Builder, body: Body, c: Counts) -> FloatArray:
    """Returns unit directions of a lapel at the nodes of the front edge, folded back on the front.

    They are perpendicular to the edge, and between the front's normal and the way into the front.
    """
    x = half.position
    columns = np.vstack([body.lower[c.lower - c.lapel : -1, :2], body.front[:, :2]])
    edge, inner = x[columns[:, 0]], x[columns[:, 1]]
    along = _unit(np.gradient(edge, axis=0))
    inward = inner - edge
    inward = _unit(inward - np.sum(inward * along, axis=1)[:, None] * along)
    outward = np.cross(inward, along)
    return _smooth(np.cos(_FOLD) * inward + np.sin(_FOLD) * outward, edge)


def _notched(rise: FloatArray, edge: FloatArray) -> FloatArray:
    """Returns a lapel's directions, which lean down toward its upper end, away from the collar."""
    along = arc(edge)
    near = np.clip(1.0 - (along[-1] - along) / (_NOTCH_LENGTH * along[-1]), 0.0, 1.0)
    return _unit(rise - _NOTCH * near[:, None] * _unit(np.gradient(edge, axis=0)))


def _lapel_widths(edge: FloatArray, width: float) -> FloatArray:
    """Returns a lapel's width at the nodes of its fold, from below up."""
    along = arc(edge) / arc(edge)[-1]
    return np.asarray(width * (_NARROW + (1.0 - _NARROW) * np.minimum(along / _WIDENS, 1.0)))


def _add_shawl(
    half: Builder, p: CoatParameters, body: Body, c: Counts, edge: IntArray, neckline: IntArray
) -> None:
    """Adds one strip along front edge and neckline, which is folded in front and stands behind."""
    front, back = _folded(half, body, c), _standing(half, neckline)
    along = arc(half.position[edge])
    turn = np.clip(1.0 - (along[-1] - along) / (_SHAWL_TURN * along[-1]), 0.0, 1.0)[:, None]
    rise = np.vstack([_unit((1.0 - turn) * front + turn * back[0]), back[1:]])
    before = _lapel_widths(half.position[edge], lapel_width(p))
    behind = np.linspace(before[-1], p.collar_height, len(neckline))[1:]
    fold = np.concatenate([edge, neckline[1:]])
    # with the right half's directions, so that the middle of the back stays in the middle
    flip = np.array([1.0, -1.0, 1.0])
    both = np.concatenate([rise, rise[-2::-1] * flip])
    x = half.position[fold]
    rise = _smooth(both, np.concatenate([x, x[-2::-1] * flip]))[: len(fold)]
    rise[-1, 1] = 0.0
    _add_strip(half, fold, rise, np.concatenate([before, behind]), c.across)


def _add_hood(half: Builder, p: CoatParameters, neckline: IntArray, c: Counts) -> None:
    """Adds half of a hood, whose seam runs over the crown from the forehead to the nape.

    It leans backward, as a hood that is off the head. Its front edge rises from the first node of
    the neckline, its middle from the last.
    """
    start, height = half.position[neckline], hood_height(p)
    upward, aside = height * np.array([0.0, 0.0, 1.0]), height * np.array([0.0, 1.0, 0.0])
    rise = height * np.array([-np.sin(_HOOD_LEAN), 0.0, np.cos(_HOOD_LEAN)])
    back = height * np.array([-np.cos(_HOOD_LEAN), 0.0, -np.sin(_HOOD_LEAN)])
    corner, nape = start[0], start[-1]
    # Shares of the height that leave no narrow triangles and keep the hood off the shoulders.
    forehead = 0.5 * (corner + nape) * [1.0, 0.0, 1.0] + 1.01 * rise
    crown = nape + 0.72 * rise + 0.38 * back
    face = cubic(corner, corner + 0.5 * upward + 0.32 * aside, forehead + 0.51 * aside, forehead)
    behind = cubic(
        nape,
        nape + 0.2 * upward + 0.09 * back,
        crown - 0.43 * rise - 0.15 * back,
        crown,
    )
    seam = cubic(forehead, forehead + 0.48 * back, crown + 0.22 * rise, crown)
    patch = coons(
        start,
        resample(seam, len(start) - 1),
        resample(face, c.hood),
        resample(behind, c.hood),
    )
    u = np.linspace(0.0, np.pi, patch.shape[1])
    v = np.linspace(0.0, np.pi, patch.shape[0])
    patch += 0.13 * np.sin(v)[:, None, None] * np.sin(u)[None, :, None] * aside
    patch[-1, :, 1] = 0.0
    patch[:, -1, 1] = 0.0
    half.grid(np.vstack([neckline[None], half.add(patch[1:])]))


def _smooth(directions: FloatArray, fold: FloatArray) -> FloatArray:
    """Returns unit directions, averaged along a fold, so that no corner of it spreads the cloth."""
    apart = (arc(fold)[:, None] - arc(fold)) / _SMOOTH
    return _unit(np.exp(-0.5 * apart**2) @ directions)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])
