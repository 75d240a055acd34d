"""Labels the parts of a garment: openings, sleeves and grasp patches."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.axes import AXES, facings, turned
from drake_dress.models.garment.doubtful import check_openings
from drake_dress.models.garment.mesh import LOOP_NAMES, REGION_NAMES, GarmentMesh
from drake_dress.models.garment.openings import (
    Hanging,
    beyond,
    check_neck_and_hem,
    find_armhole,
    find_cuffs,
    ordered,
)
from drake_dress.models.sides import SIDES

_GRASP_COUNT = 10  # nodes per gripper if none are given
_GRASP_INSET = 0.035  # from the shoulder tip toward the neck, m
# Least distance of the body's centroid from the armholes at which the up axis is judged, m. A
# coat's centroid lies 0.2 m below them or more.
_TELLING = 0.06


def with_openings(
    position: FloatArray,
    faces: IntArray,
    named: Mapping[str, IntArray],
    up: str,
    facing: str | None,
    source: str,
) -> dict[str, IntArray]:
    """Returns the named loops, and finds the others.

    Args:
        position: (n,3), m, in the axes of the file.
        faces: (F,3) of a manifold.
        named: loops by their names in `LOOP_NAMES`.
        up: the axis of the file that points up.
        facing: the axis of the file that the garment faces; None for the usual one.
        source: file put in front of messages.

    Raises:
        UserError: a loop is not found, or `up` or `facing` is the wrong axis.
    """

    def hanging(up: str, facing: str | None) -> dict[str, IntArray]:
        upright = turned(position, up, facing)
        return _found(Hanging(source, upright, faces, position), named)

    try:
        return hanging(up, facing)
    except UserError as error:
        keys = _keys_that_fit(hanging, up, facing)
        if keys is None:
            raise
        raise UserError(source, error.key, f"{error.message}; with {keys} it would fit") from error


def _keys_that_fit(
    hanging: Callable[[str, str | None], object], up: str, facing: str | None
) -> str | None:
    """Returns the keys with which the garment hangs as expected; None if there are none.

    Args:
        hanging: raises UserError if the garment does not hang with these axes.
        up: axis that does not fit as the upper one.
        facing: axis that does not fit as the one in front.
    """
    usual = [(other, None) for other in AXES]
    others = [(other, axis) for other in AXES for axis in facings(other)[1:]]
    for other, axis in [*usual, *others]:
        if (other, axis or facings(other)[0]) == (up, facing or facings(up)[0]):
            continue
        try:
            hanging(other, axis)
        except UserError:
            continue
        changed = [] if other == up else [f"garment.mesh.up: {other}"]
        if axis is not None:
            changed.append(f"garment.mesh.facing: {axis}")
        elif facing is not None:
            changed.append("the usual garment.mesh.facing")
        return " and ".join(changed)
    return None


def labelled(
    position: FloatArray,
    faces: IntArray,
    loops: Mapping[str, IntArray],
    grasp: Mapping[str, IntArray],
) -> GarmentMesh:
    """Returns the mesh with its regions labelled and its origin between the shoulder tips.

    Args:
        position: (n,3), m, in the canonical rest pose, with any origin.
        faces: (F,3) of a manifold.
        loops: nodes around each opening of `LOOP_NAMES`.
        grasp: nodes that each gripper holds. A gripper not given holds the ten nodes nearest to a
            point 3.5 cm inward of the shoulder tip.
    """
    named = {name: ordered(position, loops[name]) for name in LOOP_NAMES}
    region = np.zeros(len(position), dtype=np.int8)
    for side in SIDES:
        sleeve = beyond(faces, len(position), named[f"{side}_armhole"], named[f"{side}_cuff"])
        region[sleeve] = REGION_NAMES.index(f"{side}_sleeve")
    tips = np.stack([position[named[f"{side}_armhole"][0]] for side in SIDES])
    inward = (tips[::-1] - tips) / max(float(np.linalg.norm(tips[0] - tips[1])), 1e-9)
    held = dict(grasp)
    for k, side in enumerate(SIDES):
        if side not in held:
            far = np.linalg.norm(position - (tips[k] + _GRASP_INSET * inward[k]), axis=1)
            held[side] = np.argsort(far, kind="stable")[:_GRASP_COUNT].astype(np.int32)
    return GarmentMesh(position - tips.mean(axis=0), faces, named, held, region)


def _found(hanging: Hanging, named: Mapping[str, IntArray]) -> dict[str, IntArray]:
    loops = dict(named)
    if not all(f"{side}_cuff" in loops for side in SIDES):
        loops = {**find_cuffs(hanging, named), **loops}
    check_neck_and_hem(hanging, loops)
    for side in SIDES:
        name = f"{side}_armhole"
        if name not in loops:
            loops[name] = find_armhole(hanging, loops[f"{side}_cuff"], name)
    check_openings(hanging, loops, named)
    _check_hangs(hanging, loops)
    return loops


def _check_hangs(hanging: Hanging, loops: Mapping[str, IntArray]) -> None:
    """Checks that the body hangs below the armholes."""
    position, faces = hanging.position, hanging.faces
    body = np.ones(len(position), dtype=bool)
    for side in SIDES:
        body &= ~beyond(faces, len(position), loops[f"{side}_armhole"], loops[f"{side}_cuff"])
    corners = position[faces[body[faces].all(axis=1)]]
    if len(corners) == 0:
        return
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    middle = np.average(corners.mean(axis=1), axis=0, weights=area + 1e-15)
    armholes = np.mean([position[loops[f"{side}_armhole"]].mean(axis=0) for side in SIDES], axis=0)
    away = middle - armholes
    if np.linalg.norm(away) > _TELLING and away[2] > -0.5 * np.linalg.norm(away):
        k = int(np.argmax(np.abs(away)))
        toward = (
            ("forward", "to the left", "upward")
            if away[k] > 0
            else (
                "backward",
                "to the right",
                "upward",
            )
        )
        raise UserError(
            hanging.source,
            "up",
            f"the body of the garment hangs {toward[k]} of the armholes, expected below them",
        )
