"""Messages at the end of a dressing, of a hardware station and of its lab.

    PERSON_CUE                       lcmt_robot_state          1: lower the arms
    GRIPPER_COMMAND_LEFT, _RIGHT     lcmt_schunk_wsg_command   0 mm: hold, else open
    GRIPPER_STATUS_LEFT, _RIGHT      lcmt_schunk_wsg_status    distance of the fingers, mm

The types of the grippers are Drake's for parallel grippers of any make.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from drake import lcmt_robot_state, lcmt_schunk_wsg_command, lcmt_schunk_wsg_status
from pydrake.manipulation import (
    SchunkWsgCommandReceiver,
    SchunkWsgCommandSender,
    SchunkWsgStatusReceiver,
    SchunkWsgStatusSender,
)
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort
from pydrake.systems.lcm import LcmInterfaceSystem, LcmPublisherSystem, LcmSubscriberSystem
from pydrake.systems.primitives import ConstantVectorSource, Gain, MatrixGain

from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.systems.all_above import AllAbove
from drake_dress.systems.cue_messages import CueReceiver, CueSender, check_cue
from drake_dress.systems.lcm_inbox import (
    Decoder,
    GuardedSerializer,
    InboxSerializer,
    cpp_serializer,
)
from drake_dress.systems.release_gate import Confirm, ReleaseGate

# Distance of the fingers of an open gripper, m: that of the Panda's hand.
OPEN_POSITION = 0.08
_RATE = 20.0  # of both messages, Hz


def _finite(*names: str) -> Any:
    """Returns the check that fields of a message are finite."""

    def check(message: Any) -> Finding:
        values = [getattr(message, name) for name in names]
        return SOUND if np.isfinite(values).all() else Finding(Fault.NOT_FINITE)

    return check


def status_decoders(channels: Mapping[str, str]) -> dict[str, Decoder]:
    """Returns the decoder of each side's status; it keeps the last sound message as `usable`.

    Args:
        channels: of the status, by side.
    """
    check = _finite("actual_position_mm")
    return {side: Decoder(lcmt_schunk_wsg_status, check, late=1.0) for side in channels}


def are_open(decoders: Mapping[str, Decoder]) -> bool:
    """Returns whether both grippers report that they are more than half open."""
    last = [decoder.usable for decoder in decoders.values()]
    half = 0.5e3 * OPEN_POSITION
    return all(status is not None and status.actual_position_mm > half for status in last)


def export_release(
    builder: DiagramBuilder,
    bus: LcmInterfaceSystem,
    commands: Mapping[str, str],
    statuses: Mapping[str, str],
    decoders: Mapping[str, Decoder],
    confirm: Confirm,
) -> None:
    """Exports `release` and `grippers_open`, with messages behind them.

    Args:
        builder: of the station.
        bus: of the messages.
        commands: channels of the commands by side.
        statuses: channels of the status by side.
        decoders: of the status by side.
        confirm: whether a release is confirmed.
    """
    gate = builder.AddNamedSystem("release_gate", ReleaseGate(confirm, 1.0 / _RATE))
    builder.ExportInput(gate.GetInputPort("request"), "release")
    position = builder.AddNamedSystem("gripper_target", Gain(OPEN_POSITION, 1))
    builder.Connect(gate.GetOutputPort("release"), position.get_input_port())
    positions = []
    for side in SIDES:
        command = builder.AddNamedSystem(f"{side}_gripper_command", SchunkWsgCommandSender())
        builder.Connect(position.get_output_port(), command.GetInputPort("position"))
        message = command.get_output_port()
        _publish(
            builder,
            bus,
            f"{side}_gripper_publisher",
            commands[side],
            lcmt_schunk_wsg_command,
            message,
        )
        inbox = _subscribed(
            builder, bus, f"{side}_gripper_messages", statuses[side], decoders[side]
        )
        status = builder.AddNamedSystem(f"{side}_gripper_status", SchunkWsgStatusReceiver())
        builder.Connect(inbox.get_output_port(), status.get_input_port())
        first = builder.AddSystem(MatrixGain(np.array([[1.0, 0.0]])))
        builder.Connect(status.GetOutputPort("state"), first.get_input_port())
        positions.append(first.get_output_port())
    opened = builder.AddNamedSystem("grippers_open", AllAbove(len(SIDES), 0.5 * OPEN_POSITION))
    for port, above in zip(positions, opened.ports, strict=True):
        builder.Connect(port, above)
    builder.ExportOutput(opened.get_output_port(), "grippers_open")


def receive_release(
    builder: DiagramBuilder,
    bus: LcmInterfaceSystem,
    channels: Mapping[str, str],
    release: InputPort,
) -> None:
    """Opens a lab's grippers once both are commanded to open more than half.

    Args:
        builder: of the lab.
        bus: of the messages.
        channels: of the commands by side.
        release: input of the lab's station.
    """
    opened = builder.AddNamedSystem("release", AllAbove(len(SIDES), 0.5 * OPEN_POSITION))
    for side, above in zip(SIDES, opened.ports, strict=True):
        decoder = Decoder(lcmt_schunk_wsg_command, _finite("target_position_mm"), late=1.0)
        name = f"{side}_gripper_command"
        inbox = _subscribed(builder, bus, f"{name}_inbox", channels[side], decoder, command=True)
        command = builder.AddNamedSystem(name, SchunkWsgCommandReceiver(initial_position=0.0))
        builder.Connect(inbox.get_output_port(), command.get_input_port())
        builder.Connect(command.GetOutputPort("position"), above)
    builder.Connect(opened.get_output_port(), release)


def send_gripper_status(
    builder: DiagramBuilder,
    bus: LcmInterfaceSystem,
    channels: Mapping[str, str],
    grippers_open: OutputPort,
) -> None:
    """Sends the status of a lab's grippers, which open at once.

    Args:
        builder: of the lab.
        bus: of the messages.
        channels: of the status by side.
        grippers_open: output of the lab's station.
    """
    state = builder.AddNamedSystem("gripper_state", MatrixGain(np.array([[OPEN_POSITION], [0.0]])))
    builder.Connect(grippers_open, state.get_input_port())
    no_force = builder.AddSystem(ConstantVectorSource([0.0]))
    for side in SIDES:
        status = builder.AddNamedSystem(f"{side}_gripper_status", SchunkWsgStatusSender())
        builder.Connect(state.get_output_port(), status.get_input_port(0))
        builder.Connect(no_force.get_output_port(), status.get_input_port(1))
        message = status.get_output_port()
        _publish(
            builder,
            bus,
            f"{side}_gripper_publisher",
            channels[side],
            lcmt_schunk_wsg_status,
            message,
        )


def export_cue(builder: DiagramBuilder, bus: LcmInterfaceSystem, channel: str) -> None:
    """Exports `cue`, with a message behind it, on a station."""
    sender = builder.AddNamedSystem("cue_message", CueSender())
    builder.ExportInput(sender.get_input_port(), "cue")
    publisher = builder.AddNamedSystem(
        "cue_publisher",
        LcmPublisherSystem.Make(
            channel=channel, lcm_type=lcmt_robot_state, lcm=bus, publish_period=1.0 / _RATE
        ),
    )
    builder.Connect(sender.get_output_port(), publisher.get_input_port())


def receive_cue(
    builder: DiagramBuilder, bus: LcmInterfaceSystem, channel: str, cue: InputPort
) -> None:
    """Passes the cue of messages on to a lab's person."""
    decoder = Decoder(lcmt_robot_state, check_cue, late=1.0)
    inbox = builder.AddNamedSystem(
        "cue_inbox",
        LcmSubscriberSystem(channel=channel, serializer=InboxSerializer(decoder), lcm=bus),
    )
    receiver = builder.AddNamedSystem("cue", CueReceiver())
    builder.Connect(inbox.get_output_port(), receiver.get_input_port())
    builder.Connect(receiver.get_output_port(), cue)


def _publish(
    builder: DiagramBuilder,
    bus: LcmInterfaceSystem,
    name: str,
    channel: str,
    lcm_type: Any,
    message: OutputPort,
) -> None:
    """Adds a publisher of a C++ message."""
    publisher = builder.AddNamedSystem(
        name,
        LcmPublisherSystem.Make(
            channel=channel,
            lcm_type=lcm_type,
            lcm=bus,
            publish_period=1.0 / _RATE,
            use_cpp_serializer=True,
        ),
    )
    builder.Connect(message, publisher.get_input_port())


def _subscribed(
    builder: DiagramBuilder,
    bus: LcmInterfaceSystem,
    name: str,
    channel: str,
    decoder: Decoder,
    command: bool = False,
) -> LcmSubscriberSystem:
    """Adds a subscriber that passes on sound messages only."""
    kind = lcmt_schunk_wsg_command if command else lcmt_schunk_wsg_status
    serializer = GuardedSerializer(decoder, cpp_serializer(kind))
    return builder.AddNamedSystem(
        name, LcmSubscriberSystem(channel=channel, serializer=serializer, lcm=bus)
    )
