"""Estimated points of the garment or of the person's arms, as `lcmt_point_cloud`.

A message has one row per point, in the order of the controller's nodes or joints. Its fields are x,
y, z, m, and optionally vx, vy, vz, m/s: float32, in the world frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from drake import lcmt_point_cloud, lcmt_point_cloud_field
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.arrays import FloatArray
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.systems.lcm_inbox import Received

FRAME = "world"
_FIELDS = ("x", "y", "z", "vx", "vy", "vz")
_FLOAT32 = 7  # of lcmt_point_cloud_field's data types


def encode_points(time: float, *columns: FloatArray) -> lcmt_point_cloud:
    """Returns a message of positions (m,3), m, and velocities (m,3), m/s, if given."""
    values = np.hstack(columns).astype("<f4")
    message = lcmt_point_cloud()
    message.utime = round(1e6 * time)
    message.frame_name = FRAME
    message.width, message.height = len(values), 1
    message.flags = lcmt_point_cloud.IS_STRICTLY_FINITE
    for i, name in enumerate(_FIELDS[: values.shape[1]]):
        entry = lcmt_point_cloud_field()
        entry.name, entry.byte_offset, entry.datatype, entry.count = name, 4 * i, _FLOAT32, 1
        message.fields.append(entry)
    message.num_fields = len(message.fields)
    message.point_step = 4 * values.shape[1]
    message.row_step = message.point_step * len(values)
    message.filler_size, message.filler = 0, b""
    message.data = values.tobytes()
    message.data_size = len(message.data)
    return message


def decode_points(message: Any) -> FloatArray | None:
    """Returns (m,3) or (m,6) positions, m, and velocities, m/s; None for any other message."""
    names = tuple(entry.name for entry in message.fields)
    width = len(names)
    if (
        names not in (_FIELDS[:3], _FIELDS)
        or message.frame_name != FRAME
        or any(entry.datatype != _FLOAT32 or entry.count != 1 for entry in message.fields)
        or [entry.byte_offset for entry in message.fields] != list(range(0, 4 * width, 4))
        or message.point_step != 4 * width
        or len(message.data) != 4 * width * message.width * message.height
    ):
        return None
    values: FloatArray = np.frombuffer(message.data, "<f4").reshape(-1, width).astype(np.float64)
    return values


def check_points(count: int) -> Callable[[Any], Finding]:
    """Returns a check of messages with `count` points."""
    return lambda message: read_points(message, count)[0]


def read_points(message: Any, count: int, names: Sequence[str] = ()) -> tuple[Finding, FloatArray]:
    """Checks that a message has `count` finite points, and returns them.

    Args:
        message: `lcmt_point_cloud`.
        count: Expected number of points.
        names: Names of the points, if any.

    Returns:
        What is wrong, and the points (count,3) or (count,6) as in `decode_points`; (0,3) on a
        fault.
    """
    values, none = decode_points(message), np.zeros((0, 3))
    if values is None:
        return Finding(Fault.WRONG_SIZE, f"no cloud of float32 x, y, z in frame {FRAME!r}"), none
    if len(values) != count:
        return Finding(Fault.WRONG_SIZE, f"{len(values)} points, expected {count}"), none
    if not np.isfinite(values).all():
        k = int(np.argmin(np.isfinite(values).all(axis=1)))
        name = names[k] if names else f"point {k}"
        return Finding(Fault.NOT_FINITE, f"{name} is {values[k].tolist()}"), none
    return SOUND, values


class PointSender(LeafSystem):
    """Converts points into messages.

    .. pydrake_system::

        name: PointSender
        input_ports:
        - position
        - velocity (if it has)
        output_ports:
        - lcmt_point_cloud

    Inputs (3m,) row-major (m,3), m, m/s.

    Args:
        count: m.
        has_velocity: Whether messages have velocities.
    """

    def __init__(self, count: int, has_velocity: bool) -> None:
        super().__init__()
        for name in ("position", "velocity")[: 1 + has_velocity]:
            self.DeclareVectorInputPort(name, 3 * count)
        self.DeclareAbstractOutputPort(
            "lcmt_point_cloud", lambda: Value(lcmt_point_cloud()), self._calc
        )

    def _calc(self, context: Context, output: AbstractValue) -> None:
        columns = [
            self.get_input_port(i).Eval(context).reshape(-1, 3)
            for i in range(self.num_input_ports())
        ]
        output.set_value(encode_points(context.get_time(), *columns))


class PointReceiver(LeafSystem):
    """Outputs the points of the last valid message.

    .. pydrake_system::

        name: PointReceiver
        input_ports:
        - received
        output_ports:
        - position
        - velocity

    received: a `Received`. Outputs (3m,) row-major (m,3), m, m/s; velocities are 0 if messages have
    none.

    Args:
        start: (m,3) output before the first message, m.
    """

    def __init__(self, start: FloatArray) -> None:
        super().__init__()
        self._start = start
        self.DeclareAbstractInputPort("received", Value(Received()))
        for i, name in enumerate(("position", "velocity")):
            self.DeclareVectorOutputPort(name, start.size, self._calc(i))

    def _calc(self, part: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            received: Received = self.get_input_port().Eval(context)
            points = None if received.message is None else decode_points(received.message)
            if points is None:
                points = self._start
            if part and points.shape[1] == 3:
                output.SetFromVector(np.zeros(points.size))
            else:
                output.SetFromVector(points[:, 3 * part : 3 * part + 3].ravel())

        return calc
