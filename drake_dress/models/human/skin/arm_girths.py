"""Girths along an arm and of the hand, by cuts perpendicular to the bones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.cuts import Cut, cut, girth_with_circle, plane_axes
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.sides import Side

_ARM = ("upper_arm", "forearm", "palm")
# Shares of a bone's length where its widest or narrowest place is looked for: the upper arm below
# the armpit, the forearm's muscles, the wrist above the hand.
_WIDEST_UPPER, _WIDEST_FORE, _WRIST = (0.35, 0.8), (0.05, 0.45), (0.85, 1.03)
_KNUCKLES = (0.85, 1.05)  # of the way from wrist to middle knuckle
_CUTS = 12


@dataclass(frozen=True)
class ArmGirths:
    """Radii of circles with the girths of an arm, m, and volumes, m³.

    Attributes:
        shoulder: mean distance of the skin of the arm from the shoulder joint.
        upper_arm: at its widest below the armpit.
        upper_arm_place: where that is, as share of the way from shoulder to elbow.
        elbow: in the plane that halves the angle of the elbow.
        forearm: at its widest.
        forearm_place: where that is, as share of the way from elbow to wrist.
        wrist: at its narrowest.
        palm: of the hand at the knuckles without the thumb.
        hand: there, with the thumb laid into the palm, as it goes through a cuff.
        upper_arm_volume: from shoulder to elbow, m³.
        forearm_volume: from elbow to the finger tips, m³.
    """

    shoulder: float
    upper_arm: float
    upper_arm_place: float
    elbow: float
    forearm: float
    forearm_place: float
    wrist: float
    palm: float
    hand: float
    upper_arm_volume: float
    forearm_volume: float


def arm_girths(skin: Skin, side: Side) -> ArmGirths:
    """Returns the girths of an arm.

    Raises:
        ValueError: a plane misses the arm's skin.
    """
    shoulder, elbow, wrist, knuckle = (
        skin.joints[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist", "knuckle_middle")
    )
    faces = skin.faces_of(_ARM, side)
    upper = _Bone(skin, faces, shoulder, elbow)
    fore = _Bone(skin, faces, elbow, wrist)
    upper_place, widest_upper = upper.widest(_WIDEST_UPPER)
    fore_place, widest_fore = fore.widest(_WIDEST_FORE)
    halving = upper.direction + fore.direction
    palm, hand = _hand_girths(skin, side, wrist, knuckle)
    hand_faces = skin.faces_of(("forearm", "palm", "fingers"), side)
    return ArmGirths(
        shoulder=cut(skin.vertices, faces, shoulder, upper.direction).mean_distance,
        upper_arm=widest_upper.radius,
        upper_arm_place=upper_place,
        elbow=cut(skin.vertices, faces, elbow, halving / np.linalg.norm(halving)).radius,
        forearm=widest_fore.radius,
        forearm_place=fore_place,
        wrist=min(c.radius for _, c in fore.cuts(np.linspace(*_WRIST, _CUTS))),
        palm=palm / (2.0 * np.pi),
        hand=hand / (2.0 * np.pi),
        upper_arm_volume=upper.volume(),
        forearm_volume=fore.volume() + _enclosed_by_hulls(skin, hand_faces, wrist, knuckle),
    )


class _Bone:
    """Cuts of one side's arm perpendicular to a bone."""

    def __init__(self, skin: Skin, faces: IndexArray, start: FloatArray, end: FloatArray) -> None:
        self._skin, self._faces, self._start, self._end = skin, faces, start, end
        self._length = float(np.linalg.norm(end - start))
        self.direction = (end - start) / self._length

    def cuts(self, places: Iterable[float]) -> list[tuple[float, Cut]]:
        """Returns shares of the bone's length and the cuts there."""
        return [
            (float(s), cut(self._skin.vertices, self._faces, self.at(s), self.direction))
            for s in places
        ]

    def at(self, share: float) -> FloatArray:
        """Returns the point at a share of the length (3,), m."""
        return np.asarray(self._start + share * (self._end - self._start))

    def widest(self, between: tuple[float, float]) -> tuple[float, Cut]:
        """Returns the place of the greatest girth, as share of the length, and the cut there."""
        return max(self.cuts(np.linspace(*between, _CUTS)), key=lambda c: c[1].girth)

    def volume(self) -> float:
        """Returns the volume inside tapes along the bone, m³.

        Next to the shoulder the arm is cut with the trunk; there the first free cut counts.
        """
        areas = [c.area for _, c in self.cuts(np.linspace(_WIDEST_UPPER[0], 1.0, _CUTS))]
        first = _WIDEST_UPPER[0]
        free = float(np.trapezoid(areas, dx=(1.0 - first) / (_CUTS - 1)))
        return (free + first * areas[0]) * self._length


def _hand_girths(
    skin: Skin, side: Side, wrist: FloatArray, knuckle: FloatArray
) -> tuple[float, float]:
    """Returns the hand's girth at the knuckles, without and with the thumb in the palm, m.

    Where a scan's thumb is next to the hand, it cannot be told from it, and both girths are that of
    the hand with its thumb.
    """
    direction = (knuckle - wrist) / np.linalg.norm(knuckle - wrist)
    faces = skin.faces_of(("palm", "fingers"), side)
    thumb = skin.faces_of(("thumb",), side)

    def at(share: float) -> Cut:
        return cut(skin.vertices, faces, wrist + share * (knuckle - wrist), direction)

    places = np.linspace(*_KNUCKLES, _CUTS)
    if len(thumb):
        outline = max(map(at, places), key=lambda c: c.girth)
        circle = _Circle(_thumb_radius(skin, thumb), _to_thumb(skin, side, direction))
    else:
        pieces = max((at(place).pieces() for place in places), key=lambda p: p[0].girth)
        outline = pieces[0]
        if len(pieces) == 1:
            return outline.girth, outline.girth
        circle = _Circle(pieces[1].radius, pieces[1].hull.mean(axis=0) - outline.hull.mean(axis=0))
    return outline.girth, girth_with_circle(outline, circle.centre(outline), circle.radius)


@dataclass(frozen=True)
class _Circle:
    """The thumb in the plane of the knuckles: its radius, m, and where it comes from (2,)."""

    radius: float
    aside: FloatArray

    def centre(self, outline: Cut) -> FloatArray:
        """Returns its centre (2,), m, when it touches the middle of the palm.

        The palm is the flat side of the outline to which the thumb points.
        """
        middle = outline.hull.mean(axis=0)
        across = np.linalg.svd(outline.hull - middle)[2][1]
        if across @ self.aside < 0.0:
            across = -across
        reach = float(np.max((outline.hull - middle) @ across))
        return np.asarray(middle + (reach + self.radius) * across)


def _thumb_radius(skin: Skin, faces: IndexArray) -> float:
    """Returns the radius of the thumb at its middle, m."""
    points = skin.vertices[np.unique(faces)]
    middle = points.mean(axis=0)
    along = np.linalg.svd(points - middle)[2][0]
    return cut(skin.vertices, faces, middle, along).radius


def _to_thumb(skin: Skin, side: Side, direction: FloatArray) -> FloatArray:
    """Returns the way (2,) from the middle knuckle to the thumb in the plane of the knuckles."""
    thumb, knuckle = (skin.joints[f"{side}_{name}"] for name in ("thumb", "knuckle_middle"))
    return np.asarray(plane_axes(direction) @ (thumb - knuckle))


def _enclosed_by_hulls(
    skin: Skin, faces: IndexArray, wrist: FloatArray, knuckle: FloatArray
) -> float:
    """Returns the volume inside tapes from the wrist to the finger tips, m³."""
    length = float(np.linalg.norm(knuckle - wrist))
    direction = (knuckle - wrist) / length
    tip = float(np.max((skin.vertices[np.unique(faces)] - wrist) @ direction))
    places = np.linspace(0.05, 0.98, _CUTS) * tip
    areas = [cut(skin.vertices, faces, wrist + p * direction, direction).area for p in places]
    return float(np.trapezoid(areas, places))
