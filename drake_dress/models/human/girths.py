"""Girths of a person instead of radii and widths, as a tape measure gives them.

A limb's girth g stands for the radius g / 2π. The girth of chest, waist or hips stands for a width,
and also for the depth unless that is given. A section of width w and depth d is as in `shape.py`:
two half circles with straight sides between them. A tape around it has the length

    g = 2 (w - d) + π d for w ≥ d, and the same with both exchanged for w < d.
"""

from __future__ import annotations

import math

# Radius that the girth of a limb stands for.
LIMB_GIRTHS = {
    f"{name}_girth": f"{name}_radius"
    for name in (
        "upper_arm",
        "elbow",
        "forearm",
        "wrist",
        "hand",
        "neck",
        "neck_base",
        "head",
        "thigh",
        "knee",
        "ankle",
    )
}
# Depth over width where the depth is not given: the default person's chest, and estimates for waist
# and hips, which are rounder.
TRUNK_GIRTHS = {"chest_girth": 0.625, "waist_girth": 0.73, "hip_girth": 0.70}
ARM_GIRTHS = tuple(f"{name}_girth" for name in ("upper_arm", "elbow", "forearm", "wrist", "hand"))
GIRTHS = (*LIMB_GIRTHS, *TRUNK_GIRTHS)


def radius_of(girth: float) -> float:
    """Returns the radius of a limb with a girth, m."""
    return girth / (2.0 * math.pi)


def girth_of(width: float, depth: float) -> float:
    """Returns the girth of a section of the trunk, m."""
    thin = min(width, depth)
    return 2.0 * (max(width, depth) - thin) + math.pi * thin


def section_of(girth: float, depth: float | None, share: float) -> tuple[float, float]:
    """Returns width and depth of a section of the trunk, m.

    Args:
        girth: its girth, m.
        depth: its depth, m; None: `share` of the width.
        share: depth over width, at most 1.

    Raises:
        ValueError: the girth is at most twice the depth.
    """
    if depth is None:
        width = girth / girth_of(1.0, share)
        return width, share * width
    if girth <= 2.0 * depth:
        raise ValueError(f"girth {girth} m, expected more than twice the depth, {depth} m")
    if girth >= math.pi * depth:
        return depth + 0.5 * (girth - math.pi * depth), depth
    return (girth - 2.0 * depth) / (math.pi - 2.0), depth
