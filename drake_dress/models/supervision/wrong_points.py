"""Impossible estimates made from sound ones, as trackers send them when something is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray

# Rows of a person's points.
_LEFT_ELBOW, _LEFT_HAND = 1, 2
_OTHER_SIDE = [3, 4, 5, 0, 1, 2]
# Jump of an estimate back and forth between two places that are each possible, and offsets of the
# person's and the garment's estimate, m.
_LEAP, _OFFSET, _FAR = 0.2, 1.0, 0.4
_HUGE = 1e30


@dataclass(frozen=True)
class Moment:
    """One message while a fault is active.

    Attributes:
        values: (m,3) points, m, or (m,6) with their velocities, m/s.
        first: the same of the first message of the fault.
        number: index of the message, from 0.
    """

    values: FloatArray
    first: FloatArray
    number: int


WrongPoints = Callable[[Moment], FloatArray]


def _positions(change: Callable[[FloatArray], FloatArray]) -> WrongPoints:
    """Returns a fault that changes positions and keeps velocities."""
    return lambda m: np.hstack([change(m.values[:, :3]), m.values[:, 3:]])


def _without(rows: slice | int) -> WrongPoints:
    """Returns a fault that writes rows as zero."""

    def wrong(m: Moment) -> FloatArray:
        values = m.values.copy()
        values[rows] = 0.0
        return values

    return wrong


def _long_forearm(m: Moment) -> FloatArray:
    values = m.values.copy()
    values[_LEFT_HAND] += 2.0 * (values[_LEFT_HAND] - values[_LEFT_ELBOW])
    return values


def _leaping(m: Moment) -> FloatArray:
    """Moves all points forward in every second message."""
    values = m.values.copy()
    values[:, 0] += _LEAP * ((m.number + 1) % 2)
    return values


def _scrambled(m: Moment) -> FloatArray:
    return m.values[np.random.default_rng(0).permutation(len(m.values))]


def _fast(m: Moment) -> FloatArray:
    return m.values * np.repeat([1.0, 1e3], 3)[: m.values.shape[1]]


def _frozen(m: Moment) -> FloatArray:
    return m.first


_Y_UP = _positions(lambda x: x[:, [0, 2, 1]] * [1.0, 1.0, -1.0])
_MM = _positions(lambda x: 1e3 * x)
# By kind of fault; the first word is the source.
WRONG_POINTS: dict[str, WrongPoints] = {
    "person_zero": _without(slice(None)),
    "person_hand_zero": _without(_LEFT_HAND),  # as a lost point is often written
    "person_mm": _MM,
    "person_cm": _positions(lambda x: 1e2 * x),
    "person_swapped": lambda m: m.values[_OTHER_SIDE],
    "person_y_up": _Y_UP,
    "person_huge": _positions(lambda x: _HUGE * x),
    "person_limb": _long_forearm,
    "person_jump": _leaping,
    "person_offset": _positions(lambda x: x + [_OFFSET, 0.0, 0.0]),
    "person_frozen": _frozen,
    "garment_zero": _without(slice(None)),
    "garment_lost": _without(slice(None, None, 10)),
    "garment_mm": _MM,
    "garment_y_up": _Y_UP,
    "garment_scrambled": _scrambled,
    "garment_far": _positions(lambda x: x + [_FAR, 0.0, 0.0]),
    "garment_mirrored": _positions(lambda x: x * [1.0, -1.0, 1.0]),
    "garment_jump": _leaping,
    "garment_fast": _fast,  # velocities in mm/s
    "garment_frozen": _frozen,
}
