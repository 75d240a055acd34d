"""A person's skin from a scan: a mesh file and the places of the arms' joints in it.

A scan has no skin weights. Each vertex belongs to the part of the body whose bone is nearest, in
radii of that part. Joints that are not given stand where they do in most people.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.axes import AXES, turned
from drake_dress.models.garment.files import read_mesh
from drake_dress.models.garment.life_size import UNITS
from drake_dress.models.garment.merge import duplicates_merged
from drake_dress.models.human.skin.assign import parts_by_distance
from drake_dress.models.human.skin.estimated import all_joints
from drake_dress.models.human.skin.inside import winding_numbers
from drake_dress.models.human.skin.measures import SkinMeasures, skin_measures
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.sides import SIDES

NEEDED = tuple(f"{side}_{name}" for side in SIDES for name in ("shoulder", "elbow", "hand"))
OPTIONAL = (
    "neck",
    "head",
    *(f"{side}_{name}" for side in SIDES for name in ("wrist", "hip", "knee", "ankle")),
)
JOINT_NAMES = NEEDED + OPTIONAL
_STATURE = (0.8, 2.3)  # m
# Distances between neighbouring joints of an arm, m: from a child of four to a very tall man.
_LIMB = (0.08, 0.5)
_SHOULDERS = (0.15, 0.6)
# Height of the shoulder joints of who stands over the stature: a child's 0.76, a man's 0.80.
_STANDING = (0.70, 0.86)
# A point inside a closed mesh has 1, outside 0; scans have holes.
_INSIDE = 0.5


@dataclass(frozen=True)
class Scan:
    """A scan of a standing person.

    Attributes:
        file: OBJ, PLY, STL or glTF file.
        unit: unit of its coordinates and of the joints, one of `UNITS`.
        up: axis of the file that points up, one of `AXES`.
        joints: places (3,) by name, in the file's coordinates: those of `NEEDED`, which are
            shoulder, elbow and middle of the hand of both sides, and any of `OPTIONAL`.
    """

    file: Path
    unit: str = "m"
    up: str = "z"
    joints: Mapping[str, Sequence[float]] = field(default_factory=dict)


def scan_skin(scan: Scan) -> Skin:
    """Returns the skin of a scan.

    Raises:
        UserError: the file cannot be used, or is no person's size; a joint is missing, outside of
            the body, or too near to or too far from its neighbour; the person does not stand.
    """
    source = str(scan.file)
    _check_words(source, scan)
    mesh = duplicates_merged(read_mesh(scan.file))
    factor = UNITS[scan.unit]
    vertices = turned(mesh.position * factor, scan.up)
    _check_stature(source, float(np.ptp(vertices[:, 2])) / factor, scan.unit)
    given = {
        name: turned(factor * np.array(place, dtype=np.float64)[None], scan.up)[0]
        for name, place in _places(source, scan.joints).items()
    }
    _check_inside(source, scan, given, vertices, mesh.faces)
    _check_lengths(source, given)
    vertices, given = _in_torso_frame(vertices, given)
    _check_standing(source, given, float(np.ptp(vertices[:, 2])))
    joints = all_joints(given, float(np.ptp(vertices[:, 2])))
    parts, sides, weights = parts_by_distance(vertices, joints)
    return Skin(vertices, mesh.faces.astype(np.int64), joints, weights, parts, sides)


def scan_measures(scan: Scan) -> SkinMeasures:
    """Returns the measures of a scan.

    Raises:
        UserError: as `scan_skin`, or a plane that measures a girth misses the scan.
    """
    try:
        return skin_measures(scan_skin(scan))
    except ValueError as error:
        if isinstance(error, UserError):
            raise
        raise UserError(
            str(scan.file), "joints", f"{error}: a limb is missing, or a joint is misplaced"
        ) from error


def _check_words(source: str, scan: Scan) -> None:
    for key, value, words in (("unit", scan.unit, tuple(UNITS)), ("up", scan.up, AXES)):
        if value not in words:
            raise UserError(source, key, f"is {value!r}, expected one of {', '.join(words)}")


def _places(source: str, joints: Mapping[str, Sequence[float]]) -> dict[str, Sequence[float]]:
    missing = [name for name in NEEDED if name not in joints]
    if missing:
        raise UserError(source, "joints", f"has no {missing[0]}, expected {', '.join(NEEDED)}")
    for name, place in joints.items():
        if name not in JOINT_NAMES:
            known = ", ".join(JOINT_NAMES)
            raise UserError(source, f"joints.{name}", f"is unknown, expected {known}")
        numbers = all(isinstance(x, int | float) and np.isfinite(x) for x in place)
        if len(place) != 3 or not numbers:
            raise UserError(source, f"joints.{name}", f"is {list(place)}, expected x, y, z")
    return dict(joints)


def _check_stature(source: str, height: float, unit: str) -> None:
    low, high = _STATURE
    if low <= height * UNITS[unit] <= high:
        return
    fitting = [name for name, factor in UNITS.items() if low <= height * factor <= high]
    hint = f"; with {fitting[0]} it would fit" if fitting else " (is another axis up?)"
    raise UserError(
        source,
        "unit",
        f"in {unit} the scan is {height * UNITS[unit]:.3g} m tall, expected a person of {low} to "
        f"{high} m{hint}",
    )


def _check_inside(
    source: str,
    scan: Scan,
    given: Mapping[str, FloatArray],
    vertices: FloatArray,
    faces: IndexArray,
) -> None:
    """Checks that the joints are inside the body."""
    points = np.stack(list(given.values()))
    numbers = np.abs(winding_numbers(points, vertices, faces))
    for name, number in zip(given, numbers, strict=True):
        if number < _INSIDE:
            place = ", ".join(f"{x:g}" for x in scan.joints[name])
            raise UserError(
                source,
                f"joints.{name}",
                f"({place}) {scan.unit} is outside of the scan, expected a place inside the body",
            )


def _check_lengths(source: str, given: Mapping[str, FloatArray]) -> None:
    pairs = [("left_shoulder", "right_shoulder", _SHOULDERS)]
    for side in SIDES:
        pairs.append((f"{side}_shoulder", f"{side}_elbow", _LIMB))
        pairs.append((f"{side}_elbow", f"{side}_hand", _LIMB))
    for start, end, (low, high) in pairs:
        length = float(np.linalg.norm(given[end] - given[start]))
        if not low <= length <= high:
            raise UserError(
                source,
                f"joints.{end}",
                f"is {length:.3g} m from {start}, expected {low} to {high} m",
            )


def _check_standing(source: str, given: Mapping[str, FloatArray], stature: float) -> None:
    """Checks that the scan is of a whole person who stands."""
    low, high = _STANDING
    for side in SIDES:
        share = given[f"{side}_shoulder"][2] / stature
        if not low <= share <= high:
            raise UserError(
                source,
                f"joints.{side}_shoulder",
                f"is at {100 * share:.0f} % of the scan's height, expected {100 * low:.0f} to "
                f"{100 * high:.0f} %: a scan of the whole standing person, up along the axis `up`",
            )


def _in_torso_frame(
    vertices: FloatArray, given: Mapping[str, FloatArray]
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Returns vertices and joints with y from the right to the left shoulder and the floor at 0."""
    left, right = given["left_shoulder"], given["right_shoulder"]
    across = (left - right) * np.array([1.0, 1.0, 0.0])
    y = across / np.linalg.norm(across)
    z = np.array([0.0, 0.0, 1.0])
    rotation = np.stack([np.cross(y, z), y, z])
    origin = 0.5 * (left + right)
    origin[2] = vertices[:, 2].min()
    moved = {name: rotation @ (place - origin) for name, place in given.items()}
    return (vertices - origin) @ rotation.T, moved
