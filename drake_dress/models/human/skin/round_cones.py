"""How well round cones along the arms fit a skin.

A round cone is the hull of two spheres. The cones of an arm have the radii of its girths, so a tape
around skin and cone is as long; what is left are the departures of a limb from a circle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.skin.arm_girths import ArmGirths, arm_girths
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.sides import SIDES, Side

# Share of the way from shoulder to elbow above which the skin of an arm is also that of the trunk.
_FREE = 0.3


@dataclass(frozen=True)
class Fit:
    """Distances of the skin of free arms, from below the armpit to the wrist, from their cones, m.

    Attributes:
        mean: mean absolute distance.
        greatest: greatest absolute distance.
        bias: mean distance; positive where the skin is outside.
    """

    mean: float
    greatest: float
    bias: float


def fit_round_cones(skin: Skin, tapered: bool = True) -> Fit:
    """Returns how well the arms' round cones fit a skin.

    Args:
        skin: the skin.
        tapered: with five radii from shoulder to wrist; otherwise with one radius for the upper arm
            and one for the forearm, which are capsules.

    Raises:
        ValueError: a plane that measures a girth misses the skin.
    """
    distances = np.concatenate([_distances(skin, side, tapered) for side in SIDES])
    size = np.abs(distances)
    return Fit(float(size.mean()), float(size.max()), float(distances.mean()))


def cone_distance(
    points: FloatArray, start: FloatArray, end: FloatArray, radii: tuple[float, float]
) -> FloatArray:
    """Returns the signed distance (n,) of points from a round cone, m; negative inside.

    Args:
        points: (n,3), m.
        start: centre (3,) of the first sphere.
        end: centre (3,) of the second sphere.
        radii: of the spheres, m; neither sphere lies inside the other.
    """
    axis = end - start
    length = float(np.linalg.norm(axis))
    direction = axis / length
    sine = (radii[0] - radii[1]) / length
    cosine = np.sqrt(1.0 - sine * sine)
    relative = points - start
    along = relative @ direction
    off = np.linalg.norm(relative - along[:, None] * direction, axis=1)
    # the foot on the axis of the line that meets the cone at a right angle
    foot = np.clip(along - off * sine / cosine, 0.0, length)
    radius = radii[0] + (radii[1] - radii[0]) * foot / length
    return np.asarray(np.hypot(along - foot, off) - radius)


def _distances(skin: Skin, side: Side, tapered: bool) -> FloatArray:
    shoulder, elbow, wrist = (
        skin.joints[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist")
    )
    chosen = np.isin(skin.parts, [PARTS.index("upper_arm"), PARTS.index("forearm")])
    chosen &= skin.sides == (1 if side == "left" else -1)
    points = skin.vertices[chosen]
    upper = elbow - shoulder
    points = points[(points - shoulder) @ upper > _FREE * (upper @ upper)]
    chain = _chain(arm_girths(skin, side), (shoulder, elbow, wrist), tapered)
    each = [cone_distance(points, a, b, radii) for a, b, radii in chain]
    return np.asarray(np.min(each, axis=0))


def _chain(
    g: ArmGirths, joints: tuple[FloatArray, FloatArray, FloatArray], tapered: bool
) -> list[tuple[FloatArray, FloatArray, tuple[float, float]]]:
    """Returns ends and radii of the cones of an arm."""
    shoulder, elbow, wrist = joints
    if not tapered:
        return [
            (shoulder, elbow, (g.upper_arm, g.upper_arm)),
            (elbow, wrist, (g.forearm, g.forearm)),
        ]
    upper = shoulder + g.upper_arm_place * (elbow - shoulder)
    fore = elbow + g.forearm_place * (wrist - elbow)
    places = [shoulder, upper, elbow, fore, wrist]
    radii = [g.shoulder, g.upper_arm, g.elbow, g.forearm, g.wrist]
    return [
        (places[i], places[i + 1], (radii[i], radii[i + 1]))
        for i in range(len(places) - 1)
        if np.linalg.norm(places[i + 1] - places[i]) > abs(radii[i + 1] - radii[i])
    ]
