"""Refuses openings that were detected and cannot be right.

The detection always takes the best candidates. This module judges them by what is known of every
garment with two sleeves: the armholes end well above the hip, sleeves have a length, and left and
right are alike. Openings that the user named are not judged.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import NamedTuple

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.mesh import loop_length
from drake_dress.models.garment.openings import Hanging, beyond, by_key
from drake_dress.models.sides import SIDES

# Largest depth of an armhole as a share of the body's height below its top. In coats it is 0.2 to
# 0.35, in short jackets with wide sleeves 0.6.
_DEEPEST = 0.7
# Girth of an armhole, m: a kimono's are 0.9 m.
_MOST_GIRTH = 1.1
# Least distance of a cuff from its armhole, m. Cap sleeves are 0.05 m long.
_LEAST_SLEEVE = 0.03
# Largest difference between left and right, as a share of the larger value, and absolute, m. Folds
# of draped garments made 0.08 of the girth; another opening taken for a cuff makes 0.4 or more.
_UNLIKE, _UNLIKE_BY = 0.25, 0.05


class _Sleeve(NamedTuple):
    """Measures of a sleeve, m."""

    armhole: float  # girth
    cuff: float  # girth
    length: float  # between the middles of armhole and cuff
    aside: float  # of the cuff from the middle of the body


def check_openings(
    hanging: Hanging, loops: Mapping[str, IntArray], named: Container[str] = ()
) -> None:
    """Checks detected openings against each other and against the garment.

    Args:
        hanging: the garment.
        loops: nodes around each opening of `LOOP_NAMES`.
        named: names of the loops that the user gave.

    Raises:
        UserError: an opening cannot be right. The message says which one, its size and place, and
            the key that names it.
    """
    body = np.ones(len(hanging.position), dtype=bool)
    for side in SIDES:
        body &= ~beyond(hanging.faces, len(body), loops[f"{side}_armhole"], loops[f"{side}_cuff"])
    for side in SIDES:
        if f"{side}_armhole" not in named:
            _check_armhole(hanging, loops, side, body)
    left, right = (_measured(hanging.position, loops, side, body) for side in SIDES)
    told = [
        ("armhole", "girths of the armholes", left.armhole, right.armhole),
        ("cuff", "girths of the cuffs", left.cuff, right.cuff),
        ("cuff", "distances of the cuffs from the middle of the body", left.aside, right.aside),
        ("armhole", "lengths of the sleeves", left.length, right.length),
    ]
    for end, what, mine, other in told:
        names = [f"{side}_{end}" for side in SIDES]
        if any(name in named for name in names):
            continue
        if abs(mine - other) > max(_UNLIKE * max(mine, other), _UNLIKE_BY):
            raise UserError(
                hanging.source,
                f"loops.{names[0]}",
                f"left and right are unlike: the {what} are {mine:.2f} and {other:.2f} m; the "
                f"left {end} found is {hanging.told(loops[names[0]])}, the right one "
                f"{hanging.told(loops[names[1]])}; expected like ones, or {by_key(names[0])}",
            )


def _check_armhole(
    hanging: Hanging, loops: Mapping[str, IntArray], side: str, body: np.ndarray
) -> None:
    name = f"{side}_armhole"
    x, loop, cuff = hanging.position, loops[name], loops[f"{side}_cuff"]
    low, high = float(x[loop, 2].min()), float(x[loop, 2].max())
    height = high - float(x[body, 2].min())
    girth = loop_length(x, loop)
    expected = f"expected a sleeve that stands out from the body, or {by_key(name)}"
    if high - low > _DEEPEST * height or girth > _MOST_GIRTH:
        raise UserError(
            hanging.source,
            f"loops.{name}",
            f"the armhole found runs toward the hip: it is {hanging.told(loop)}, and reaches "
            f"{high - low:.2f} m down a body of {height:.2f} m; {expected}",
        )
    if _measured(x, loops, side, body).length < _LEAST_SLEEVE:
        raise UserError(
            hanging.source,
            f"loops.{name}",
            f"there is no sleeve at the opening {hanging.told(cuff)} (is it a vest?), {expected}",
        )


def _measured(x: FloatArray, loops: Mapping[str, IntArray], side: str, body: np.ndarray) -> _Sleeve:
    armhole, cuff = x[loops[f"{side}_armhole"]], x[loops[f"{side}_cuff"]]
    return _Sleeve(
        loop_length(x, loops[f"{side}_armhole"]),
        loop_length(x, loops[f"{side}_cuff"]),
        float(np.linalg.norm(armhole.mean(axis=0) - cuff.mean(axis=0))),
        abs(float(cuff[:, 1].mean() - x[body, 1].mean())),
    )
