"""Changes messages while faults are active."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drake_dress.models.supervision.injection import (
    CLOCK_JUMP,
    SECOND_CLOCK,
    SET_BACK,
    TIME_BACK,
)
from drake_dress.models.supervision.wrong_points import Moment, WrongPoints
from drake_dress.systems.point_messages import decode_points

# Changes a decoded message in place, given the first message of the fault and the number of
# messages since then.
Spoil = Callable[[Any, Any, int], None]
_SILENT = {"stale", "bus_lost", "arm_lost"}
_SHIFTS = {"time_back": TIME_BACK, "clock_jump": CLOCK_JUMP, "set_back": SET_BACK}


class Spoiler:
    """Injects the faults of one source; stores how each fault began.

    Args:
        lcm_type: Python class of the messages.
        spoils: By kind of fault, how it changes a message; adds to those common to all sources.
    """

    def __init__(self, lcm_type: Any, spoils: Mapping[str, Spoil] | None = None) -> None:
        self._type, self._spoils = lcm_type, dict(spoils or {})
        self._rng = np.random.default_rng(0)
        # for each active fault, its stored message and the number of messages since
        self._begun: dict[str, tuple[Any, int]] = {}

    def __call__(self, encoded: bytes, on: set[str]) -> list[bytes]:
        """Returns the messages to send in place of one message.

        Args:
            encoded: The message.
            on: Active kinds of faults, from `models.supervision.injection`.
        """
        self._begun = {kind: begun for kind, begun in self._begun.items() if kind in on}
        if on & _SILENT:
            return []
        if "malformed" in on:
            return [self._rng.bytes(int(self._rng.integers(0, len(encoded) + 1)))]
        return self._in_order(self._changed(encoded, on), on) if on else [encoded]

    def _changed(self, encoded: bytes, on: set[str]) -> bytes:
        message = self._type.decode(encoded)
        for kind in sorted(on & set(self._spoils)):
            first, number = self._begun.get(kind, (self._type.decode(encoded), 0))
            self._begun[kind] = first, number + 1
            self._spoils[kind](message, first, number)
        dated = _dated(message)
        dated.utime += round(1e6 * sum(_SHIFTS[kind] for kind in on & set(_SHIFTS)))
        if "utime_zero" in on:
            dated.utime = 0
        changed: bytes = message.encode()
        return changed

    def _in_order(self, encoded: bytes, on: set[str]) -> list[bytes]:
        """Returns at most one message, since a bus may keep only the last of two."""
        kind = next((k for k in ("reordered", "duplicated", "second_sender") if k in on), None)
        if kind is None:
            return [encoded]
        kept, number = self._begun.get(kind, (encoded, 0))
        if kind == "reordered":
            # the first of three is sent after the second, in place of the third
            turn = number % 3
            self._begun[kind] = encoded if turn == 0 else kept, number + 1
            return [[], [encoded], [kept]][turn]
        again = number % 2 == 1
        self._begun[kind] = encoded, number + 1
        if kind == "duplicated":
            return [kept if again else encoded]
        return [self._of_another(encoded) if again else encoded]

    def _of_another(self, encoded: bytes) -> bytes:
        message = self._type.decode(encoded)
        _dated(message).utime += round(1e6 * SECOND_CLOCK)
        other: bytes = message.encode()
        return other


def _dated(message: Any) -> Any:
    """Returns the part of a message that has the utime: the message or its header."""
    return message if hasattr(message, "utime") else message.header


def spoil_points(wrong: WrongPoints) -> Spoil:
    """Returns a function that corrupts the points of a `lcmt_point_cloud`."""

    def spoil(message: Any, first: Any, number: int) -> None:
        values, before = decode_points(message), decode_points(first)
        if values is None or before is None:
            raise ValueError("is no cloud of points")
        message.data = wrong(Moment(values, before, number)).astype("<f4").tobytes()

    return spoil
