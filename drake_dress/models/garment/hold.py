"""Where grippers hold a garment: beside its shoulder tips, or at both edges of its opening.

Held beside the shoulder tips, the panels between armholes and opening hang before the armholes like
curtains, and a hand has to find its way around a panel. Held at the edges of the opening and
spread, as people hold a coat for each other, the panels are walls of a way to the armholes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.garment.front import left_half, rim_of, side_changes
from drake_dress.models.garment.mesh import GarmentMesh, Hold
from drake_dress.models.sides import SIDES

HOLDS: tuple[Hold, ...] = get_args(Hold)

# Nodes within this distance of the held point are held, m, and at least so many.
_RADIUS, _FEWEST = 0.045, 4


def held_at_edges(mesh: GarmentMesh, depth: float, source: str) -> GarmentMesh:
    """Returns the garment with both edges of its opening held.

    Args:
        mesh: the garment, held anywhere.
        depth: of the held points below the shoulder tips, as a share of the armholes' height.
        source: scenario or file, for the message.

    Raises:
        UserError: there is no opening from neck to hem, or nothing of an edge is at this depth.
    """
    rim = rim_of(mesh)
    is_left = left_half(mesh)
    neck = None if rim is None else _middle_of_neck(mesh, rim, is_left)
    if rim is None or neck is None:
        raise UserError(
            source, "garment.hold", "is edges, but no opening runs from neck to hem: use shoulders"
        )
    x = mesh.rest_position
    armholes = np.concatenate([mesh.loops[f"{side}_armhole"] for side in SIDES])
    level = -depth * float(x[armholes, 2].max() - x[armholes, 2].min())
    grasp: dict[str, IntArray] = {}
    for side, wanted in zip(SIDES, (True, False), strict=True):
        way = np.roll(rim, -neck - 1)
        if is_left[way[0]] != wanted:
            way = way[::-1]
        point = _first_below(x[way, 2], level)
        if point is None or is_left[way[point]] != wanted:
            raise UserError(
                source, "garment.hold_depth", f"is {depth:g}, deeper than the {side} edge reaches"
            )
        far = np.linalg.norm(x - x[way[point]], axis=1)
        far[is_left != wanted] = np.inf
        count = max(_FEWEST, int(np.count_nonzero(far <= _RADIUS)))
        grasp[side] = np.argsort(far, kind="stable")[:count].astype(np.int32)
    return replace(mesh, grasp=grasp, hold="edges")


def _middle_of_neck(mesh: GarmentMesh, rim: IntArray, is_left: BoolArray) -> int | None:
    """Returns the place on the rim after which it changes sides at the neck: the highest one."""
    changes = side_changes(is_left[rim])
    if len(changes) == 0:
        return None
    return int(changes[np.argmax(mesh.rest_position[rim[changes], 2])])


def _first_below(height: FloatArray, level: float) -> int | None:
    """Returns the first of a way's nodes, by height, m, that is at a level or below it."""
    below = np.flatnonzero(height <= level)
    return int(below[0]) if len(below) else None
