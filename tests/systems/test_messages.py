"""What comes over a bus is taken as it is: messages, garbage, and what is neither."""

from typing import Any

import numpy as np
import pytest
from drake import lcmt_panda_status, lcmt_point_cloud
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.lcm import DrakeLcm
from pydrake.manipulation import PandaStatusReceiver
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem, LcmSubscriberSystem, PySerializer
from pydrake.systems.primitives import ConstantVectorSource

from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.arm.status_check import JointBounds
from drake_dress.models.supervision.fault import Fault
from drake_dress.models.supervision.injection import InjectedFault
from drake_dress.systems.lcm_inbox import (
    Decoder,
    GuardedSerializer,
    InboxSerializer,
    Received,
    cpp_serializer,
)
from drake_dress.systems.outbox import Outbox, with_tail
from drake_dress.systems.point_messages import (
    PointReceiver,
    PointSender,
    check_points,
    decode_points,
    encode_points,
)
from drake_dress.systems.status_messages import StatusCheck, mode_finding

HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])
_ARRAYS = (
    "joint_position_desired",
    "joint_velocity",
    "joint_velocity_desired",
    "joint_acceleration_desired",
    "joint_torque",
    "joint_torque_desired",
    "joint_torque_external",
)


def status(utime: int = 7, position: np.ndarray = HOME) -> lcmt_panda_status:
    message = lcmt_panda_status()
    message.utime, message.num_joints = utime, 7
    message.robot_mode = lcmt_panda_status.kMove
    message.joint_position = list(position)
    for name in _ARRAYS:
        setattr(message, name, [0.0] * 7)
    return message


class Ear:
    """Takes statuses from a bus in memory, for Python and for Drake's receiver."""

    def __init__(self, late: float = 0.0) -> None:
        builder = DiagramBuilder()
        self.lcm = DrakeLcm("memq://")
        bus = builder.AddSystem(LcmInterfaceSystem(self.lcm))
        decoder = Decoder(lcmt_panda_status, StatusCheck(JointBounds(LIMITS)), late)
        inbox = builder.AddNamedSystem(
            "inbox", LcmSubscriberSystem(channel="S", serializer=InboxSerializer(decoder), lcm=bus)
        )
        guarded = GuardedSerializer(decoder, cpp_serializer(lcmt_panda_status))
        sound = builder.AddNamedSystem(
            "sound", LcmSubscriberSystem(channel="S", serializer=guarded, lcm=bus)
        )
        receiver = builder.AddSystem(PandaStatusReceiver())
        builder.Connect(sound.get_output_port(), receiver.get_input_port())
        builder.ExportOutput(inbox.get_output_port(), "received")
        builder.ExportOutput(receiver.GetOutputPort("position_measured"), "position")
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.simulator.Initialize()
        self.now = 0.0

    def hear(self, message: bytes) -> tuple[Received, np.ndarray]:
        self.lcm.Publish("S", message)
        self.now += 0.01
        self.simulator.AdvanceTo(self.now)
        context = self.simulator.get_context()
        read = self.diagram.GetOutputPort
        return read("received").Eval(context), read("position").Eval(context)


@settings(max_examples=30)
@given(st.binary(max_size=700) | st.integers(0, 600))
def test_garbage_is_counted_and_changes_nothing(garbage: bytes | int) -> None:
    ear = Ear()
    sound = status().encode()
    ear.hear(sound)
    # a number: so many bytes of a message
    raw = garbage if isinstance(garbage, bytes) else sound[: min(garbage, len(sound) - 1)]
    received, position = ear.hear(raw)
    assert received.arrival.count == 2
    assert received.arrival.fault is Fault.MALFORMED
    assert received.message.utime == 7
    np.testing.assert_array_equal(position, HOME)
    received, _ = ear.hear(sound + b"more")
    assert received.arrival.fault is Fault.MALFORMED
    received, _ = ear.hear(status(8).encode())
    assert received.arrival.fault is Fault.NONE
    assert received.message.utime == 8


@pytest.mark.parametrize(
    ("position", "fault"),
    [
        (HOME * np.nan, Fault.NOT_FINITE),
        (LIMITS.upper + 0.1, Fault.JOINT_LIMIT),
        (HOME[:3], None),
    ],
)
def test_a_message_that_cannot_be_true_does_not_get_through(
    position: np.ndarray, fault: Fault | None
) -> None:
    ear = Ear()
    ear.hear(status().encode())
    if fault is None:
        message = status(8)
        message.num_joints = 3
        fault = Fault.WRONG_SIZE
    else:
        message = status(8, position)
    received, seen = ear.hear(message.encode())
    assert received.arrival.fault is fault
    np.testing.assert_array_equal(seen, HOME)


@pytest.mark.parametrize(
    ("mode", "fault"),
    [(lcmt_panda_status.kReflex, Fault.STOPPED), (lcmt_panda_status.kIdle, Fault.IDLE)],
)
def test_an_arm_that_does_not_follow_tells_so_and_where_it_is(mode: int, fault: Fault) -> None:
    ear = Ear()
    message = status(9, HOME + 0.01)
    message.robot_mode = mode
    received, seen = ear.hear(message.encode())
    assert received.arrival.fault is fault
    np.testing.assert_array_equal(seen, HOME + 0.01)


@given(st.integers(-128, 127))
def test_an_arm_follows_in_one_mode_alone(mode: int) -> None:
    found = mode_finding(mode)
    if mode == lcmt_panda_status.kMove:
        assert found.fault is Fault.NONE
    elif mode == lcmt_panda_status.kIdle:
        assert found.fault is Fault.IDLE
    else:
        assert found.fault is Fault.STOPPED
        assert f"robot_mode is {mode} (" in found.reason


@pytest.mark.parametrize("name", _ARRAYS)
def test_a_status_with_a_number_that_is_none_is_refused(name: str) -> None:
    ear = Ear()
    ear.hear(status().encode())
    message = status(8, HOME + 0.01)
    setattr(message, name, [0.0] * 6 + [np.nan])
    received, seen = ear.hear(message.encode())
    assert received.arrival.fault is Fault.NOT_FINITE
    np.testing.assert_array_equal(seen, HOME)


def test_repeated_and_late_messages_are_dropped_and_counted() -> None:
    ear = Ear(late=0.02)
    first, second, third = (
        status(t, HOME + 1e-3 * t / 5000).encode() for t in (5000, 10000, 15000)
    )
    for raw in (first, third, third, second, first):
        received, seen = ear.hear(raw)
    assert received.arrival.dropped == 3
    assert received.arrival.count == 2
    assert received.arrival.fault is Fault.NONE
    assert received.message.utime == 15000
    np.testing.assert_array_equal(seen, HOME + 3e-3)


def test_a_clock_set_back_for_good_is_told_with_its_step() -> None:
    ear = Ear(late=0.02)
    ear.hear(status(5_000_000).encode())
    received, _ = ear.hear(status(4_000_000, HOME + 0.01).encode())
    assert received.arrival.fault is Fault.TIME_BACK
    assert "went back by 1.000 s, expected 0.02 s at most" in received.arrival.reason
    assert received.message.utime == 5_000_000


def test_the_tail_of_a_status_is_its_mode_and_its_robot_s_time() -> None:
    message = status()
    message.control_mode = 3
    changed = lcmt_panda_status.decode(
        with_tail(message.encode(), lcmt_panda_status.kReflex, 123456789012)
    )
    assert changed.robot_mode == lcmt_panda_status.kReflex
    assert changed.robot_utime == 123456789012
    assert changed.control_mode == 3
    np.testing.assert_array_equal(changed.joint_position, HOME)


@given(st.integers(1, 30), st.booleans())
def test_points_arrive_as_they_were_sent(count: int, moving: bool) -> None:
    rng = np.random.default_rng(count)
    sent = [rng.normal(size=(count, 3)) for _ in range(1 + moving)]
    message = lcmt_point_cloud.decode(encode_points(1.5, *sent).encode())
    assert message.utime == 1_500_000
    assert check_points(count)(message).fault is Fault.NONE
    assert check_points(count + 1)(message).fault is Fault.WRONG_SIZE
    points = decode_points(message)
    assert points is not None
    np.testing.assert_allclose(points, np.hstack(sent), rtol=1e-6, atol=1e-6)


def test_points_of_another_kind_are_refused() -> None:
    message = encode_points(0.0, np.zeros((4, 3)))
    message.frame_name = "camera"
    assert decode_points(message) is None
    message = encode_points(0.0, np.zeros((4, 3)))
    message.fields[0].datatype = 8
    assert decode_points(message) is None
    infinite = encode_points(0.0, np.full((4, 3), np.inf))
    assert check_points(4)(infinite).fault is Fault.NOT_FINITE


def test_points_go_from_sender_to_receiver() -> None:
    rng = np.random.default_rng(0)
    x, v, start = (rng.normal(size=(5, 3)) for _ in range(3))
    sender, receiver = PointSender(5, True), PointReceiver(start)
    context = sender.CreateDefaultContext()
    sender.GetInputPort("position").FixValue(context, x.ravel())
    sender.GetInputPort("velocity").FixValue(context, v.ravel())
    message = sender.get_output_port().Eval(context)
    at = receiver.CreateDefaultContext()
    receiver.get_input_port().FixValue(at, Value(Received()))
    np.testing.assert_array_equal(receiver.GetOutputPort("position").Eval(at), start.ravel())
    receiver.get_input_port().FixValue(at, Value(Received(message)))
    np.testing.assert_allclose(receiver.GetOutputPort("position").Eval(at), x.ravel(), rtol=1e-6)
    np.testing.assert_allclose(receiver.GetOutputPort("velocity").Eval(at), v.ravel(), rtol=1e-6)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("stale", 0), ("bus_lost", 0), ("malformed", 5), ("nan", 5), ("time_back", 5)],
)
def test_an_outbox_spoils_what_it_sends_while_a_fault_is_on(kind: str, expected: int) -> None:
    lcm = DrakeLcm("memq://")
    heard: list[bytes] = []
    lcm.Subscribe("G", heard.append)
    builder = DiagramBuilder()
    sender = builder.AddSystem(PointSender(2, False))
    points = builder.AddSystem(ConstantVectorSource(np.arange(6.0)))
    builder.Connect(points.get_output_port(), sender.get_input_port())

    def spoil(message: Any, first: Any, number: int) -> None:
        message.data = np.full(6, np.nan, dtype="<f4").tobytes()

    box = builder.AddSystem(
        Outbox(
            "garment",
            "G",
            PySerializer(lcmt_point_cloud),
            lcmt_point_cloud,
            lcm,
            0.1,
            0.05,
            [InjectedFault(kind, "garment", 0.0, 0.5)],
            {"nan": spoil},
        )
    )
    builder.Connect(sender.get_output_port(), box.GetInputPort("message"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    since = box.GetInputPort("since")
    at = box.GetMyMutableContextFromRoot(simulator.get_mutable_context())

    def send(begun: float) -> list[bytes]:
        since.FixValue(at, [begun])
        heard.clear()
        simulator.AdvanceTo(simulator.get_context().get_time() + 0.5)
        lcm.HandleSubscriptions(0)
        return list(heard)

    decoder = Decoder(lcmt_point_cloud, check_points(2))
    during = send(0.2)
    assert len(during) == expected
    for raw in during:
        taken = decoder(raw)
        assert taken.finding is not None
        if kind == "malformed":
            assert taken.finding.fault is Fault.MALFORMED
        elif kind == "nan":
            assert taken.finding.fault is Fault.NOT_FINITE
        else:
            assert taken.message.utime < 0
    after = send(0.6)
    assert len(after) == 5
    assert all(decoder(raw).usable for raw in after)
