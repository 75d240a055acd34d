"""Girths of trunk, head and legs, by horizontal cuts and cuts perpendicular to the bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.cuts import Cut, cut
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.sides import SIDES

_ARMS = ("upper_arm", "forearm", "palm", "fingers", "thumb")
_UP = np.array([0.0, 0.0, 1.0])
# Heights as shares of the way from hips to shoulders: the chest at its widest, the waist at the
# navel, the hips at their widest. ANSUR II measures chest and waist at shares of 0.7 and 0.3.
_CHEST, _RIBS, _WAIST, _HIPS = (0.62, 0.8), 0.6, 0.32, (-0.2, 0.15)
_CUTS = 10


@dataclass(frozen=True)
class TrunkGirths:
    """Girths, widths and depths of the trunk, radii of neck, head and legs; m.

    Attributes:
        chest: girth, width and depth at the widest of the chest.
        ribs: girth, width and depth below the armpits.
        waist: girth, width and depth at the navel.
        hips: girth, width and depth at the widest of the hips.
        neck: radius of the circle of the neck's least girth; the radii below likewise.
        head: of the head's greatest girth.
        thigh: of the thigh's greatest girth below the crotch.
        knee: at the knee.
        calf: of the calf's greatest girth.
        ankle: of the least girth above the ankle.
        crotch_height: height above the floor where the legs part.
    """

    chest: tuple[float, float, float]
    ribs: tuple[float, float, float]
    waist: tuple[float, float, float]
    hips: tuple[float, float, float]
    neck: float
    head: float
    thigh: float
    knee: float
    calf: float
    ankle: float
    crotch_height: float


def trunk_girths(skin: Skin) -> TrunkGirths:
    """Returns the girths of trunk, head and legs; those of the legs are means of both sides.

    Raises:
        ValueError: a plane misses the skin.
    """
    crotch = _crotch_height(skin)
    hip, shoulder = (_height(skin, name) for name in ("hip", "shoulder"))
    faces = skin.faces_without(_ARMS)

    def at(share: float) -> Cut:
        return _level(skin, faces, hip + share * (shoulder - hip))

    chest = max((at(s) for s in np.linspace(*_CHEST, _CUTS)), key=lambda c: c.girth)
    hips = max((at(s) for s in np.linspace(*_HIPS, _CUTS)), key=lambda c: c.girth)
    thigh, knee, calf, ankle = np.mean([_leg(skin, side, crotch) for side in SIDES], axis=0)
    return TrunkGirths(
        chest=_sizes(chest),
        ribs=_sizes(at(_RIBS)),
        waist=_sizes(at(_WAIST)),
        hips=_sizes(hips),
        neck=_neck(skin),
        head=_head(skin),
        thigh=float(thigh),
        knee=float(knee),
        calf=float(calf),
        ankle=float(ankle),
        crotch_height=crotch,
    )


def _sizes(level: Cut) -> tuple[float, float, float]:
    depth, width = level.extents
    return level.girth, float(width), float(depth)


def _height(skin: Skin, joint: str) -> float:
    return float(np.mean([skin.joints[f"{side}_{joint}"][2] for side in SIDES]))


def _level(skin: Skin, faces: IndexArray, height: float) -> Cut:
    return cut(skin.vertices, faces, height * _UP, _UP)


def _crotch_height(skin: Skin) -> float:
    """Returns the lowest height at which a cut is one piece, m: there is skin between the legs.

    The cut's outline then crosses the plane midway between the legs.
    """
    faces = skin.faces_without(_ARMS)
    middle = 0.5 * sum(skin.joints[f"{side}_hip"][1] for side in SIDES)
    between = skin.vertices[:, 1] - middle
    sign = between[faces] > 0.0
    across = faces[sign.any(axis=1) & ~sign.all(axis=1)]
    return float(skin.vertices[across][..., 2].max(axis=1).min())


def _neck(skin: Skin) -> float:
    start, end = skin.joints["neck"], skin.joints["head"]
    direction = (end - start) / np.linalg.norm(end - start)
    faces = skin.faces_of(("neck", "head", "trunk"))
    places = (start + s * (end - start) for s in np.linspace(0.3, 0.9, _CUTS))
    return min(cut(skin.vertices, faces, p, direction).radius for p in places)


def _head(skin: Skin) -> float:
    faces = skin.faces_of(("head",))
    top = skin.vertices[:, 2].max()
    bottom = skin.joints["head"][2]
    heights = bottom + np.linspace(0.2, 0.65, _CUTS) * (top - bottom)
    return max(_level(skin, faces, float(z)).radius for z in heights)


def _leg(skin: Skin, side: str, crotch: float) -> FloatArray:
    """Returns radii (4,) of thigh, knee, calf and ankle of a side, m."""
    hip, knee, ankle = (skin.joints[f"{side}_{n}"] for n in ("hip", "knee", "ankle"))
    faces = skin.faces_of(("trunk", "thigh", "shin", "foot"), "left" if side == "left" else "right")

    def girths(start: FloatArray, end: FloatArray, shares: FloatArray) -> list[float]:
        direction = (end - start) / np.linalg.norm(end - start)
        places = (start + s * (end - start) for s in shares)
        return [cut(skin.vertices, faces, p, direction).radius for p in places]

    # below the crotch by more than the plane is inclined
    first = (hip[2] - crotch) / (hip[2] - knee[2]) + 0.08
    return np.array(
        [
            max(girths(hip, knee, np.linspace(first, 0.8, _CUTS))),
            girths(hip, knee, np.array([1.0]))[0],
            max(girths(knee, ankle, np.linspace(0.1, 0.6, _CUTS))),
            min(girths(knee, ankle, np.linspace(0.6, 0.95, _CUTS))),
        ]
    )
