"""A skin that nowhere stands out of the round cones which garments touch.

Breasts, buttocks and the slope from neck to shoulder are up to some centimetres outside of the
cones. Cloth that lies on the cones would be seen inside the skin, so pictures draw such places in.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.body import BodyMeasures, posed_capsules
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.posing import rest_pose
from drake_dress.models.human.skin.round_cones import cone_distance
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.sides import SIDES

# Parts that cloth lies on. Head, hands, shins and feet keep their shape: the cones of legs are
# straight below the hips, those of the skin are not. So thighs are drawn in less toward the knees.
_COVERED = ("trunk", "neck", "upper_arm", "forearm", "thigh")
_BELOW = 0.004  # m under the cones' surface: cloth is thin, and triangles are flat
_DELTA = 1e-5  # m, of the gradient's differences
_STEPS = 3  # where cones meet, the nearest one changes on the way


def within_cones(skin: Skin, body: BodyMeasures) -> Skin:
    """Returns a skin whose covered parts are inside the cones of a body.

    Args:
        skin: at rest, with about the lengths of the body.
        body: sizes of the person.
    """
    arms = {side: rest_pose(skin, side) for side in SIDES}
    cones = posed_capsules(body, "standing", arms)
    covered = np.isin(skin.parts, [PARTS.index(part) for part in _COVERED])
    points = skin.vertices[covered]
    for _ in range(_STEPS):
        distance = _distance(points, cones)
        gradient = np.stack(
            [_distance(points + _DELTA * axis, cones) - distance for axis in np.eye(3)], axis=1
        )
        gradient /= np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12)
        points = points - np.maximum(distance + _BELOW, 0.0)[:, None] * gradient
    vertices = skin.vertices.copy()
    share = np.where(skin.parts == PARTS.index("thigh"), _height_share(skin), 1.0)[covered]
    vertices[covered] += share[:, None] * (points - vertices[covered])
    return replace(skin, vertices=vertices)


def _height_share(skin: Skin) -> FloatArray:
    """Returns where vertices are between knees, 0, and hips, 1."""
    knee, hip = (skin.joints[f"left_{name}"][2] for name in ("knee", "hip"))
    return np.asarray(np.clip((skin.vertices[:, 2] - knee) / (hip - knee), 0.0, 1.0))


def _distance(points: FloatArray, cones: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """Returns the signed distance (n,) of points from the union of cones, m."""
    each = []
    for start, end, (first, last) in zip(*cones, strict=True):
        if np.linalg.norm(end - start) <= abs(first - last):  # one sphere holds the other
            center = start if first >= last else end
            each.append(np.linalg.norm(points - center, axis=1) - max(first, last))
        else:
            each.append(cone_distance(points, start, end, (first, last)))
    return np.asarray(np.min(each, axis=0))
