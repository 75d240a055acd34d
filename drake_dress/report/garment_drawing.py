"""Drawings of a garment at rest from four sides, with its openings and the person."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from drake_dress.drawing import load_matplotlib, new_figure
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.fit import Loop
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import BodyMeasures, body_capsules, shoulder_joint
from drake_dress.models.sides import SIDES
from drake_dress.report.garment_look import GarmentLook

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CLOTH, _LINING, _SKIN = (0.56, 0.68, 0.82), (0.88, 0.74, 0.52), (0.92, 0.89, 0.86)
COLORS = {"armhole": "#0b7a5e", "cuff": "#b8453b", "other": "#6a3fa0", "grasp": "#1c2733"}
_AXES = "#66727f"
_ROOM = 0.06  # around what is drawn, m
_FOOT = 0.08  # more below it, for the arrows of the axes, m
_LIGHT = 0.55  # share of the brightness that does not depend on the direction
_WIDTH = 10.0  # of the drawing, inches
_HIDDEN = 0.03  # depth of an opening behind the origin at which it is drawn as hidden, m

# Ends and radius of a capsule, m.
_Limb = tuple[FloatArray, FloatArray, float]


class _View(NamedTuple):
    """A view: its title, the directions to the right and up, and the names of these axes."""

    title: str
    right: FloatArray
    up: FloatArray
    along: tuple[str, str]

    @property
    def toward(self) -> FloatArray:
        """Returns the direction toward the viewer."""
        return np.cross(self.right, self.up)

    def flat(self, points: FloatArray) -> FloatArray:
        """Returns points (…,3) as places (…,2) in the drawing, m."""
        return points @ np.stack([self.right, self.up], axis=1)


_X, _Y, _Z = np.eye(3)
_VIEWS = (
    _View("front", _Y, _Z, ("y, left", "z, up")),
    _View("back", -_Y, _Z, ("right", "z, up")),
    _View("left side", -_X, _Z, ("back", "z, up")),
    _View("from above", _Y, -_X, ("y, left", "back")),
)


def draw_garment(look: GarmentLook) -> Figure:
    """Returns four drawings of a garment at one scale."""
    load_matplotlib()
    limbs = _person(look.body, look.mesh)
    low, high = _box(look, limbs)
    width, height = high[1] - low[1], high[2] - low[2]
    depth = high[0] - low[0]
    scale = _WIDTH / (2.0 * width)  # inches a metre
    figure = new_figure(
        _WIDTH, scale * (height + max(height, depth)) + 0.8, dpi=130, layout="constrained"
    )
    rows = figure.subplots(2, 2, height_ratios=(height, max(height, depth)))
    for ax, view in zip(rows.ravel(), _VIEWS, strict=True):
        for limb in limbs:
            _draw_limb(ax, view, limb)
        _draw_cloth(ax, view, look.mesh)
        _draw_openings(ax, view, look)
        ends = view.flat(np.stack([low, high]))
        middle = ends.mean(axis=0)
        half = 0.5 * np.abs(ends[1] - ends[0])
        across = 0.5 * width
        ax.set_xlim(middle[0] - across, middle[0] + across)
        ax.set_ylim(middle[1] - half[1], middle[1] + half[1])
        ax.set_aspect("equal")
        ax.axis("off")
        ax.set_title(view.title, fontsize=11)
        _draw_axes(ax, view)
    return figure


def _box(look: GarmentLook, limbs: Sequence[_Limb]) -> tuple[FloatArray, FloatArray]:
    """Returns the corners of a box around garment and hands, m; the legs are cut off."""
    hands = np.stack([b for _, b, radius in limbs[-len(SIDES) * 3 :]])
    points = np.concatenate([look.mesh.rest_position, hands])
    low, high = points.min(axis=0), points.max(axis=0)
    aside = max(high[1], -low[1])
    low[1], high[1] = -aside, aside
    low[2] -= _FOOT
    return low - _ROOM, high + _ROOM


def _draw_cloth(ax: Axes, view: _View, mesh: GarmentMesh) -> None:
    """Draws the faces from the farthest to the nearest; the inside is as a lining."""
    from matplotlib.collections import PolyCollection

    corners = mesh.rest_position[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-15)
    facing = normal @ view.toward
    light = (_LIGHT + (1.0 - _LIGHT) * np.abs(facing))[:, None]
    color = np.where(facing[:, None] >= 0.0, np.array(_CLOTH), np.array(_LINING)) * light
    order = np.argsort(corners.mean(axis=1) @ view.toward, kind="stable")
    # as a picture inside the drawing: thousands of polygons would be slow to show
    shown = PolyCollection(
        list(view.flat(corners[order])),
        facecolors=color[order],
        edgecolors=color[order],
        linewidths=0.4,
        rasterized=True,
    )
    ax.add_collection(shown)


def _draw_openings(ax: Axes, view: _View, look: GarmentLook) -> None:
    """Draws and names the openings and what the grippers hold."""
    is_plan, is_side = view.up is not _Z, abs(view.right[0]) > 0.5
    for loop in look.sizes.loops:
        kind = next((kind for kind in ("armhole", "cuff") if loop.name.endswith(kind)), "other")
        line = view.flat(np.concatenate([loop.points, loop.points[:1]]))
        behind = float((loop.points @ view.toward).mean()) < -_HIDDEN
        style: dict[str, Any] = {"linestyle": ":", "linewidth": 1.2} if behind else {}
        ax.plot(*line.T, **({"linewidth": 2.0} | style), color=COLORS[kind])
        # from the side, only what is on the near side; from above, names would cover everything
        if not is_plan and not (is_side and not loop.name.startswith("left")):
            _name(ax, view, loop, kind)
    for side in SIDES:
        held = look.mesh.rest_position[look.mesh.grasp[side]]
        ax.plot(*view.flat(held).T, ".", color=COLORS["grasp"], markersize=3.5)
        if view.title == "front":
            _tell(ax, "held", view.flat(held.mean(axis=0)), (0.0, 15.0), COLORS["grasp"])


def _name(ax: Axes, view: _View, loop: Loop, kind: str) -> None:
    at = view.flat(loop.center)
    if kind == "other":
        lowest = loop.points[:, 2].argmin()
        at = np.array([at[0], view.flat(loop.points[lowest])[1]])
    aside = float(np.sign(at[0])) if kind != "other" and abs(at[0]) > 0.05 else 0.0
    offset = {"armhole": (38.0 * aside, 34.0), "cuff": (0.0, -24.0), "other": (0.0, 14.0)}[kind]
    text = f"{loop.name.replace('_', ' ')}\n{100.0 * loop.girth:.0f} cm"
    _tell(ax, text, at, offset, COLORS[kind])


def _tell(ax: Axes, text: str, at: FloatArray, offset: tuple[float, float], color: str) -> None:
    ax.annotate(
        text,
        (float(at[0]), float(at[1])),
        xytext=offset,
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=8,
        color=color,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0},
    )


def _draw_axes(ax: Axes, view: _View) -> None:
    """Draws arrows along the two axes of the drawing in its corner."""
    for way, name in zip(((34.0, 0.0), (0.0, 34.0)), view.along, strict=True):
        ax.annotate(
            name,
            (0.01, 0.02),
            xycoords="axes fraction",
            xytext=way,
            textcoords="offset points",
            fontsize=8,
            color=_AXES,
            ha="left" if way[0] else "center",
            va="center" if way[0] else "bottom",
            arrowprops={"arrowstyle": "<-", "color": _AXES, "shrinkA": 0.0, "shrinkB": 0.0},
        )


def _draw_limb(ax: Axes, view: _View, limb: _Limb) -> None:
    from matplotlib.patches import Polygon

    a, b, radius = limb
    ends = view.flat(np.stack([a, b]))
    angle = np.linspace(0.0, 2.0 * np.pi, 48)
    rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    first = (rim @ (ends[1] - ends[0]) <= 0.0)[:, None]
    outline = np.where(first, ends[0] + rim, ends[1] + rim)
    ax.add_patch(Polygon(outline, facecolor=_SKIN, edgecolor="none", zorder=0))


def _person(body: BodyMeasures, mesh: GarmentMesh) -> list[_Limb]:
    """Returns the person in the garment's frame, the arms stretched along the sleeves."""
    joints = [shoulder_joint(body, "standing", side) for side in SIDES]
    # the tops of the shoulders carry the garment's shoulder tips
    down = np.array([0.0, 0.0, joints[0][2] + body.upper_arm_radius])
    limbs = [
        (c.a_B - down, c.b_B - down, c.radius)
        for c in body_capsules(body, "standing")
        if c.body == "torso"
    ]
    x, loops = mesh.rest_position, mesh.loops
    for joint, side in zip(joints, SIDES, strict=True):
        shoulder = joint - down
        way = x[loops[f"{side}_cuff"]].mean(axis=0) - x[loops[f"{side}_armhole"]].mean(axis=0)
        way /= max(float(np.linalg.norm(way)), 1e-9)
        elbow = shoulder + body.upper_arm_length * way
        hand = elbow + body.forearm_length * way
        limbs += [
            (shoulder, elbow, body.upper_arm_radius),
            (elbow, hand, body.forearm_radius),
            (hand, hand, body.hand_radius),
        ]
    return limbs
