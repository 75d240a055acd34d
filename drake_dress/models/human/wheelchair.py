"""A manual wheelchair around a sitting person: capsules fixed in the torso's frame.

Sizes that are not given are those of an adult's chair: push handles 0.42 m above the seat (0.915 m
above the floor with the seat at 0.485 m, and 0.66 m of width over the wheels, in Figure A3 of the
ADA Accessibility Guidelines), a back of 0.40 m, which ends below the shoulder blades, armrests
0.23 m above the seat and 5 cm wide (0.275 m in that figure), rear
wheels of 24 inches. Terms are those of ISO 7176-5. Such a chair is for an adult whose shoulder
joints are 0.60 m above the seat. Heights above the seat grow and shrink with that height. The seat
is 5 cm wider than the hips.

The chair goes where the person sits: its seat is below the thighs, its back touches the trunk. A
person who turns takes it along. The back is a row of lying capsules that touch each other, so that
no node passes through; a wheel is the upper half of its tyre, the lower half is out of a coat's
reach. Seat, front frame and spokes have no shape of their own: thighs and tyres cover them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arm.clearance import Capsules, clearance
from drake_dress.models.human.body import ArmPose, posed_capsules
from drake_dress.models.human.measures import BodyMeasures, Posture, shoulder_height
from drake_dress.models.human.shape import CHAIR, Capsule, body_capsules, capsule_arrays
from drake_dress.models.sides import SIDES, Side

ARMRESTS = ("both", "left", "right", "none")

# Capsules of the arms, which come last of a body's: upper arm, forearm and hand of each side.
_OF_ARMS = 6
# Heights of an adult's chair above its seat, m, and of that adult's shoulder joints.
_BACK, _HANDLES, _ARMRESTS, _SHOULDERS = 0.40, 0.42, 0.23, 0.60
# Seat beyond the hips, both sides together, m.
_ROOM = 0.05
# Radii of push handles (a grip of 32 mm) and of the posts that carry handles and armrests (tubes of
# 25 mm), and half the thickness of the back's upholstery, m.
_GRIP, _TUBE, _UPHOLSTERY = 0.016, 0.0125, 0.02
# Gap below a push handle that needs a post, m.
_POST_GAP = 0.01
# Middle of a wheel outside of the seat, and of its axle in front of the back, m; chords of the
# upper half of its tyre.
_WHEEL_OUTSIDE, _AXLE_AHEAD, _CHORDS = 0.07, 0.03, 4


@dataclass(frozen=True)
class Wheelchair:
    """Sizes of a wheelchair, m.

    Attributes:
        seat_width: width between the armrests. If empty, 5 cm more than the hips.
        back_height: height of the back's upper edge above the seat. If empty, two thirds of the
            height of the shoulder joints above it, 0.40 m for an adult of 0.60 m.
        back_gap: gap between the trunk and the back.
        handle_height: height of the push handles above the seat. If empty, 0.7 of that of the
            shoulder joints, 0.42 m for the same adult.
        handle_length: length of the push handles behind the back. 0 leaves them out, as where they
            fold down.
        armrest_height: height of the armrests' upper side above the seat. If empty, 0.23 m for the
            same adult.
        armrest_length: length of the armrests from the back on.
        armrest_width: width of the armrests.
        armrests: armrests that are in place, `both`, `left`, `right` or `none`.
        wheel_diameter: diameter of the rear wheels. 0.61 m are 24 inches.
        wheel_width: width of a wheel with its handrim.

    Raises:
        UserError: a size is not a positive finite number (gap and handles may be 0), or `armrests`
            is none of these words.
    """

    seat_width: float | None = None
    back_height: float | None = None
    back_gap: float = 0.0
    handle_height: float | None = None
    handle_length: float = 0.11
    armrest_height: float | None = None
    armrest_length: float = 0.34
    armrest_width: float = 0.05
    armrests: str = "both"
    wheel_diameter: float = 0.61
    wheel_width: float = 0.05

    def __post_init__(self) -> None:
        if self.armrests not in ARMRESTS:
            expected = ", ".join(ARMRESTS)
            raise UserError(
                "person.chair", "armrests", f"is {self.armrests!r}, expected one of {expected}"
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "armrests" or (value is None and field.default is None):
                continue
            may_be_zero = field.name in ("back_gap", "handle_length")
            number = isinstance(value, int | float) and not isinstance(value, bool)
            good = number and math.isfinite(value)
            if not (good and (value > 0.0 or (may_be_zero and value == 0.0))):
                expected = "0 or more m" if may_be_zero else "a positive number of m"
                raise UserError("person.chair", field.name, f"is {value!r}, expected {expected}")


@dataclass(frozen=True)
class _Place:
    """The chair beside its person, in the torso's frame, m.

    Attributes:
        seat: height of the seat.
        width: width of the seat.
        back: x of the middle of the back's upholstery.
        back_top, handles, armrests: heights above the floor of the back's upper edge, of the middle
            of the push handles, and of the armrests' upper side.
    """

    seat: float
    width: float
    back: float
    back_top: float
    handles: float
    armrests: float


def chair_capsules(chair: Wheelchair, measures: BodyMeasures) -> tuple[Capsule, ...]:
    """Returns the capsules of a chair in the torso's frame of the person who sits in it.

    Raises:
        UserError: the seat is narrower than the person, or the back has no height.
    """
    place = _placed(chair, measures)
    parts = [*_back(place), *_handles(chair, place)]
    for side in SIDES:
        parts += [*_armrest(chair, place, side), *_wheel(chair, place, side)]
    return tuple(parts)


def seated_capsules(
    measures: BodyMeasures, posture: Posture, chair: Wheelchair | None
) -> tuple[Capsule, ...]:
    """Returns the capsules of a body and of the chair, if there is one.

    Those of the torso come first, then the chair's, then those of the arms as in `body_capsules`.
    """
    body = body_capsules(measures, posture)
    if chair is None:
        return body
    return (*body[:-_OF_ARMS], *chair_capsules(chair, measures), *body[-_OF_ARMS:])


def room_of_arms(
    chair: Wheelchair, measures: BodyMeasures, arms: Mapping[Side, ArmPose]
) -> dict[Side, float]:
    """Returns the least distance of each arm from the chair, m; negative where they overlap."""
    left, right = distance_of_arms(chair_capsules(chair, measures), measures, arms)
    return {"left": left, "right": right}


def distance_of_arms(
    chair: Sequence[Capsule], measures: BodyMeasures, arms: Mapping[Side, ArmPose]
) -> tuple[float, float]:
    """Returns the least distance of left and right arm from a chair, m; negative if they overlap.

    Args:
        chair: its capsules, in the torso's frame.
        measures: of the person who sits in it.
        arms: poses of both arms.
    """
    first, second, radius = posed_capsules(measures, "sitting", arms)
    parts = Capsules(*capsule_arrays(chair))
    others = np.arange(len(parts.radius))
    gaps = []
    for k in range(len(SIDES)):
        rows = np.arange(3) + len(radius) - _OF_ARMS + 3 * k
        pairs = np.stack([np.repeat(rows, len(others)), np.tile(others, len(rows))], axis=1)
        gaps.append(float(clearance(Capsules(first, second, radius), parts, pairs).distance.min()))
    return gaps[0], gaps[1]


def _placed(chair: Wheelchair, m: BodyMeasures) -> _Place:
    top = shoulder_height(m, "sitting")
    seat = top - m.torso_length
    share = m.torso_length / _SHOULDERS
    width = m.hip_width + _ROOM if chair.seat_width is None else chair.seat_width
    if width < m.hip_width:
        raise UserError(
            "person.chair",
            "seat_width",
            f"is {width:g} m, expected the width of the hips, {m.hip_width:.3g} m, at least",
        )
    back_top = seat + (chair.back_height or _BACK * share)
    if back_top < seat + 2.0 * _UPHOLSTERY:
        raise UserError(
            "person.chair",
            "back_height",
            f"is {back_top - seat:.3g} m, expected {2.0 * _UPHOLSTERY:g} m or more",
        )
    rear = max(
        radius - float(end[0])
        for c in body_capsules(m, "sitting")
        if c.body == "torso" and min(c.a_B[2], c.b_B[2]) < back_top
        for end, radius in zip((c.a_B, c.b_B), c.radii, strict=True)
    )
    return _Place(
        seat=seat,
        width=width,
        back=-(rear + chair.back_gap + _UPHOLSTERY),
        back_top=back_top,
        handles=seat + (chair.handle_height or _HANDLES * share),
        armrests=seat + (chair.armrest_height or _ARMRESTS * share),
    )


def _part(a: list[float], b: list[float], radius: float) -> Capsule:
    return Capsule("torso", np.array(a), np.array(b), radius, part=CHAIR)


def _back(place: _Place) -> Iterator[Capsule]:
    """Yields lying capsules, as many as it takes for them to touch."""
    r, half = _UPHOLSTERY, 0.5 * place.width - _UPHOLSTERY
    low, high = place.seat + r, place.back_top - r
    for z in np.linspace(low, high, 1 + math.ceil((high - low) / (2.0 * r))):
        yield _part([place.back, -half, z], [place.back, half, z], r)


def _handles(chair: Wheelchair, place: _Place) -> Iterator[Capsule]:
    if chair.handle_length == 0.0:
        return
    x, z = place.back, place.handles
    for y in (0.5 * place.width - _UPHOLSTERY, _UPHOLSTERY - 0.5 * place.width):
        yield _part([x, y, z], [x - chair.handle_length, y, z], _GRIP)
        if z - _GRIP > place.back_top + _POST_GAP:
            yield _part([x, y, place.back_top], [x, y, z], _TUBE)


def _armrest(chair: Wheelchair, place: _Place, side: Side) -> Iterator[Capsule]:
    """Yields an armrest and the post at its front."""
    if chair.armrests not in ("both", side):
        return
    r = 0.5 * chair.armrest_width
    y = (1.0 if side == "left" else -1.0) * (0.5 * place.width + r)
    z, front = place.armrests - r, place.back + chair.armrest_length
    yield _part([place.back, y, z], [front, y, z], r)
    yield _part([front, y, place.seat], [front, y, z], _TUBE)


def _wheel(chair: Wheelchair, place: _Place, side: Side) -> Iterator[Capsule]:
    """Yields chords of the upper half of the tyre, whose ends lie on its outer side."""
    r, width = 0.5 * chair.wheel_diameter, 0.5 * chair.wheel_width
    y = (1.0 if side == "left" else -1.0) * (0.5 * place.width + _WHEEL_OUTSIDE)
    angle = np.linspace(0.0, np.pi, _CHORDS + 1)
    x = place.back + _AXLE_AHEAD + (r - width) * np.cos(angle)
    z = r + (r - width) * np.sin(angle)
    for k in range(_CHORDS):
        yield _part([x[k], y, z[k]], [x[k + 1], y, z[k + 1]], width)
