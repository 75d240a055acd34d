"""The station over LCM: the same ports as the simulated one, with messages behind them.

    PANDA_STATUS_LEFT, _RIGHT     lcmt_panda_status    from the arms' drivers
    PANDA_COMMAND_LEFT, _RIGHT    lcmt_panda_command   to them, at a fixed rate
    GARMENT_ESTIMATE              lcmt_point_cloud     nodes of the controller's garment, m, m/s
    PERSON_ESTIMATE               lcmt_point_cloud     shoulder, elbow, hand of left, then right, m
    CAMERA_<NAME>                 lcmt_image_array     images of each camera
    GRIPPER_COMMAND_…, GRIPPER_STATUS_…, PERSON_CUE    see `end_messages.py`

`drake-dress sim-station` sends and receives the same messages. Each source is supervised; see
`models/supervision/`.
"""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status, lcmt_point_cloud
from pydrake.lcm import DrakeLcm
from pydrake.manipulation import PandaCommandSender, PandaControlMode, PandaStatusReceiver
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.lcm import LcmInterfaceSystem, LcmPublisherSystem, LcmSubscriberSystem
from pydrake.systems.sensors import LcmImageArrayToImages

from drake_dress.diagrams.arms import ArmSetup
from drake_dress.diagrams.end_messages import (
    are_open,
    export_cue,
    export_release,
    status_decoders,
)
from drake_dress.diagrams.person import Person
from drake_dress.diagrams.station import ARM_STATUS, Station
from drake_dress.models.arm.chain import SerialArm
from drake_dress.models.arm.status_check import JointBounds
from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.models.supervision.garment_belief import GarmentBounds
from drake_dress.models.supervision.person_belief import PersonBounds
from drake_dress.models.supervision.supervision import Patience, words
from drake_dress.models.supervision.watch import WatchSettings
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.arm_measurement import ArmMeasurement
from drake_dress.systems.command_meter import CommandMeter, process_age
from drake_dress.systems.estimate_checks import GarmentCheck, PersonCheck
from drake_dress.systems.lcm_inbox import (
    Check,
    Decoder,
    GuardedSerializer,
    InboxSerializer,
    cpp_serializer,
    stamp,
)
from drake_dress.systems.point_messages import PointReceiver, decode_points
from drake_dress.systems.release_gate import Confirm, confirmed_at_once
from drake_dress.systems.station_watch import StationWatch
from drake_dress.systems.status_messages import StatusCheck

# Period of the watch, and longest wait for a message while listening, s.
_WATCH_PERIOD = 0.005
_LISTENING_STEP = 0.05
# Time to receive the backlog and a new message of each source, s.
_CATCHING_UP = 0.2


@dataclass(frozen=True)
class Links:
    """Channels of the messages, and rate of the commands.

    Attributes:
        lcm_url: of the bus.
        status, command: channels of the arms; _LEFT and _RIGHT are appended.
        garment, person: channels of the estimates.
        camera: channels of images; _NAME is appended.
        gripper_command, gripper_status: channels of the grippers; _LEFT and _RIGHT are appended.
        cue: channel of the cue to lower the arms.
        command_period: s. command_offset: time of the first command, s.
    """

    lcm_url: str
    status: str
    command: str
    garment: str
    person: str
    camera: str
    gripper_command: str
    gripper_status: str
    cue: str
    command_period: float
    command_offset: float = 0.001

    def of_arm(self, kind: str, side: str) -> str:
        """Returns the channel of an arm's or gripper's `kind`, such as status."""
        return f"{getattr(self, kind)}_{side.upper()}"

    def of_grippers(self, kind: str) -> dict[str, str]:
        """Returns the channels of both grippers' `kind`, command or status, by side."""
        return {side: self.of_arm(f"gripper_{kind}", side) for side in SIDES}

    def of_camera(self, name: str) -> str:
        """Returns the channel of a camera."""
        return f"{self.camera}_{name.upper()}"


@dataclass(frozen=True)
class Beliefs:
    """Bounds within which messages about arm joints, person and garment are plausible."""

    joints: JointBounds
    person: PersonBounds
    garment: GarmentBounds


@dataclass(frozen=True)
class HardwareParameters:
    """Parameters of the hardware station.

    Attributes:
        links: channels of the messages.
        mode: one of `panda_driver.MODES`.
        node_count: number of nodes of the controller's garment.
        arms: left and right, at their bases.
        beliefs: bounds of plausible messages.
        cameras: their names.
        stale_status, stale_estimate, stale_camera: age at which a source is stale, s. An
            out-of-order message that is older than the newest one by no more than this is dropped
            without a fault.
        patience: how long faults are tolerated.
        wait: longest wait for the first messages, s.
        start_distance: largest distance of a gripper from its place at the start of the run, m.
        start_angle: largest deviation of a joint from its angle there, rad.
        wall: whether staleness is measured by this machine's clock instead of the diagram's.
    """

    links: Links
    mode: str
    node_count: int
    arms: tuple[SerialArm, SerialArm]
    beliefs: Beliefs
    cameras: tuple[str, ...]
    stale_status: float
    stale_estimate: float
    stale_camera: float
    patience: Patience
    wait: float
    start_distance: float
    start_angle: float
    wall: bool = True


class StationSilentError(RuntimeError):
    """A source that the station needs sent no sound message."""


class NoBusError(RuntimeError):
    """No bus can be opened at a URL."""


class NotAtStartError(RuntimeError):
    """An arm is not at the start of the run."""


@dataclass(frozen=True)
class Heard:
    """First sound messages: arm joints (2,7) rad, garment (m,3) m, person's joints (6,3) m."""

    joints: FloatArray
    garment: FloatArray
    person: FloatArray


@dataclass(frozen=True)
class HardwareStation(Station):
    """A station over LCM.

    Attributes:
        watch: supervises its sources.
        meter: records the times of its commands.
        lcm: its bus, which must live as long as the station.
        heard: first messages of its sources.
    """

    watch: StationWatch
    meter: CommandMeter
    lcm: DrakeLcm
    heard: Heard

    @property
    def in_real_time(self) -> bool:
        """Whether the world keeps moving while a controller solves."""
        return True

    def make_ready(self, rehearse: Callable[[FloatArray, FloatArray], None]) -> None:
        """Has controllers solve once for the first messages, then receives the backlog."""
        print("rehearsing: each controller solves once", flush=True)
        rehearse(self.heard.garment, self.heard.person)
        self.catch_up()

    def fault(self, root: Context) -> str | None:
        """Returns the fault that has lasted longer than is tolerated; None if there is none."""
        return self.watch.conclusion(self.watch.GetMyContextFromRoot(root))

    def note(self, root: Context, writer: RunLogWriter) -> None:
        """Writes the faults of the sources, and the times of the commands."""
        context = self.watch.GetMyContextFromRoot(root)
        events = self.watch.events(context)
        writer.note("events", "\n".join(f"{t:.3f} {line}" for t, line in events))
        writer.note("dropped_messages", json.dumps(self.watch.dropped(context)))
        if self.meter.first is not None:
            times, ages = self.meter.commands
            writer.series("/station/command_time", times, "s")
            writer.series("/station/status_age", ages, "s")
            writer.note("start_up", process_age(self.meter.first))

    def catch_up(self) -> None:
        """Receives the messages that came meanwhile, so that a run begins with the newest."""
        # a full bus drops new messages and keeps the oldest, so waiting messages are old
        end = clock.monotonic() + _CATCHING_UP
        while clock.monotonic() < end:
            self.lcm.HandleSubscriptions(round(1e3 * _LISTENING_STEP))


@dataclass(frozen=True)
class _Source:
    channel: str
    lcm_type: Any
    check: Check
    max_age: float

    @cached_property
    def decoder(self) -> Decoder:
        """Decoder shared by all subscribers to the messages."""
        return Decoder(self.lcm_type, self.check, self.max_age)


def _image_finding(message: Any) -> Finding:
    sizes = [image.width * image.height for image in message.images]
    if sizes and min(sizes) > 0:
        return SOUND
    return Finding(Fault.WRONG_SIZE, "no image, or an empty one")


def _sources(
    p: HardwareParameters, released: Callable[[], bool] = lambda: False
) -> dict[str, _Source]:
    """Returns the sources of one listener; their checks remember the messages that it received.

    Args:
        p: parameters of the station.
        released: returns whether the grippers have let go, so that the garment need not follow
            them any more.
    """
    arms = {
        f"{side}_arm": _Source(
            p.links.of_arm("status", side),
            lcmt_panda_status,
            StatusCheck(p.beliefs.joints),
            p.stale_status,
        )
        for side in SIDES
    }

    def grippers() -> FloatArray | None:
        if released():
            return None
        statuses = [source.decoder.usable for source in arms.values()]
        if any(status is None for status in statuses):
            return None
        return np.stack(
            [
                arm.tool_position(np.array(status.joint_position))
                for arm, status in zip(p.arms, statuses, strict=True)
            ]
        )

    checks: dict[str, tuple[str, Check]] = {
        "garment": (p.links.garment, GarmentCheck(p.node_count, p.beliefs.garment, grippers)),
        "person": (p.links.person, PersonCheck(p.beliefs.person)),
    }
    estimates = {
        name: _Source(channel, lcmt_point_cloud, check, p.stale_estimate)
        for name, (channel, check) in checks.items()
    }
    cameras = {
        f"camera_{name}": _Source(
            p.links.of_camera(name), lcmt_image_array, _image_finding, p.stale_camera
        )
        for name in p.cameras
    }
    return arms | estimates | cameras


def open_bus(url: str) -> DrakeLcm:
    """Returns the bus at a URL.

    Raises:
        NoBusError: no bus can be opened there.
    """
    try:
        lcm = DrakeLcm(url)
    except RuntimeError as error:
        raise NoBusError(f"is {url}: {error}") from error
    if not lcm.available():
        raise NoBusError(
            f"is {url}, where no bus can be opened; a multicast route may be missing: "
            "ip route add 239.255.76.67 dev lo"
        )
    return lcm


def listen(
    p: HardwareParameters,
    lcm: DrakeLcm,
    told: Callable[[str], None] = lambda _: None,
    stopped: Callable[[], bool] = lambda: False,
) -> Heard:
    """Waits until every source has sent a sound message, and returns these messages.

    Args:
        p: parameters of the station.
        lcm: a bus that is used for nothing else.
        told: called with the name of each source when its first sound message arrives.
        stopped: returns whether to give up.

    Raises:
        StationSilentError: a source sent no sound message in time; the message tells which, and
            what it sent instead.
    """
    first = _First(_sources(p), told)
    for name, source in first.sources.items():
        lcm.Subscribe(source.channel, partial(first.take, name))
    end = clock.monotonic() + p.wait
    while first.missing and clock.monotonic() < end and not stopped():
        lcm.HandleSubscriptions(round(1e3 * _LISTENING_STEP))
    if first.missing:
        raise StationSilentError(f"{', '.join(first.unheard())} for {p.wait:g} s")
    messages = first.messages
    points = {n: decode_points(messages[n]) for n in ("garment", "person")}
    return Heard(
        np.array([messages[f"{side}_arm"].joint_position for side in SIDES]),
        points["garment"][:, :3],  # type: ignore[index]
        points["person"][:, :3],  # type: ignore[index]
    )


class _First:
    """The first sound message of each source.

    Args:
        sources: to listen to.
        told: called with the name of each source when its first sound message arrives.

    Attributes:
        sources: to listen to.
        messages: first sound messages so far, by the name of the source.
    """

    def __init__(self, sources: dict[str, _Source], told: Callable[[str], None]) -> None:
        self.sources = sources
        self.messages: dict[str, Any] = {}
        self._told = told
        # fault of the last message of each source
        self._wrong: dict[str, Finding] = {}
        # a garment is checked against the grippers, so it waits for both arms
        self._waiting: set[str] = set()
        self._arms = {f"{side}_arm" for side in SIDES}

    @property
    def missing(self) -> list[str]:
        """Sources without a sound message so far."""
        return [name for name in self.sources if name not in self.messages]

    def take(self, name: str, raw: bytes) -> None:
        """Receives a message of a source."""
        if name in self.messages:
            return
        if name == "garment" and not self._arms <= set(self.messages):
            self._waiting.add(name)
            return
        self._waiting.discard(name)
        taken = self.sources[name].decoder(raw)
        if taken.finding is None:
            return
        # an arm is idle before the first command, so that is no fault here
        if taken.finding.fault & ~Fault.IDLE:
            self._wrong[name] = taken.finding
        elif stamp(taken.message) == 0.0:
            # a clock may start at 0; then the next message has a stamp and is accepted
            self._wrong[name] = Finding(Fault.UNSTAMPED, "utime is never filled in: it is 0")
        else:
            self.messages[name] = taken.message
            self._told(name)

    def unheard(self) -> list[str]:
        """Returns for each missing source what it sent instead of a sound message.

        A garment that only waits for the arms is left out.
        """
        named = [name for name in self.missing if name not in self._waiting]
        return [_unheard(self.sources[name].channel, self._wrong.get(name)) for name in named]


def _unheard(channel: str, wrong: Finding | None) -> str:
    """Returns in words what a channel carried instead of a sound message."""
    if wrong is None:
        return f"{channel} is silent"
    reason = f": {wrong.reason}" if wrong.reason else ""
    return f"{channel} came {words(wrong.fault)}{reason}"


def at_start(p: HardwareParameters, planned: ArmSetup, joints: FloatArray) -> ArmSetup:
    """Returns the arms at their measured joint angles, which must be near the start of the run.

    Args:
        p: parameters of the station.
        planned: arms at the start of the run.
        joints: (2,7) measured joint angles, rad.

    Raises:
        NotAtStartError: an arm is too far away; the message tells which one, how far, and the
            joint angles to move it to.
    """
    for i, side in enumerate(SIDES):
        arm = planned.pair.arms[i]
        off = float(
            np.linalg.norm(arm.tool_position(joints[i]) - arm.tool_position(planned.start[i]))
        )
        angle = float(np.abs(joints[i] - planned.start[i]).max())
        if off > p.start_distance or angle > p.start_angle:
            raise NotAtStartError(
                f"the {side} arm is {100.0 * off:.1f} cm and {angle:.2f} rad from where the run "
                f"begins, expected {100.0 * p.start_distance:g} cm and {p.start_angle:g} rad at "
                f"most; move its joints to {np.round(planned.start[i], 3).tolist()} rad"
            )
    # a joint that starts at a limit may be measured slightly beyond it
    inside = [
        np.clip(q, arm.limits.lower, arm.limits.upper)
        for q, arm in zip(joints, planned.pair.arms, strict=True)
    ]
    return replace(planned, start=np.stack(inside))


def make_hardware_station(
    p: HardwareParameters,
    lcm: DrakeLcm,
    person: Person,
    robots: ArmSetup,
    heard: Heard,
    confirm: Confirm = confirmed_at_once,
) -> HardwareStation:
    """Returns a station that exchanges messages with arms and trackers of garment and person.

    Args:
        p: its parameters.
        lcm: its bus.
        person: as the scenario describes it.
        robots: the arms at their measured joint angles.
        heard: first messages of the sources.
        confirm: returns whether the grippers may open.
    """
    builder = DiagramBuilder()
    bus = builder.AddNamedSystem("lcm", LcmInterfaceSystem(lcm))
    commands, statuses = p.links.of_grippers("command"), p.links.of_grippers("status")
    fingers = status_decoders(statuses)
    sources = _sources(p, partial(are_open, fingers))
    watch = _add_watch(builder, p, sources)
    inboxes = _add_inboxes(builder, bus, sources, watch)
    builder.ExportOutput(watch.GetOutputPort("permission"), "permission")

    measure = builder.AddNamedSystem("arm_measurement", ArmMeasurement(robots.pair.arms))
    for side in SIDES:
        _wire_arm(builder, p, bus, side, sources[f"{side}_arm"])
        _wire_gripper(builder, side, watch, measure)
    meter = _add_meter(builder, p.links, inboxes)
    _export_estimates(builder, inboxes, heard)
    export_release(builder, bus, commands, statuses, fingers, confirm)
    export_cue(builder, bus, p.links.cue)
    for name in p.cameras:
        _wire_camera(builder, bus, name, sources[f"camera_{name}"])
    diagram = builder.Build()
    diagram.set_name("station")
    grippers = np.stack(
        [arm.tool_position(q) for arm, q in zip(robots.pair.arms, robots.start, strict=True)]
    )
    return HardwareStation(diagram, person, grippers, robots, watch, meter, lcm, heard)


# Subscribers to the messages, by the name of the source.
_Inboxes = dict[str, LcmSubscriberSystem]


def _add_watch(
    builder: DiagramBuilder, p: HardwareParameters, sources: dict[str, _Source]
) -> StationWatch:
    """Adds the system that supervises the sources and permits motion."""
    watch: StationWatch = builder.AddNamedSystem(
        "station_watch",
        StationWatch(
            {n: WatchSettings(s.max_age, late=s.max_age) for n, s in sources.items()},
            p.patience,
            _WATCH_PERIOD,
            p.wall,
        ),
    )
    return watch


def _add_inboxes(
    builder: DiagramBuilder,
    bus: LcmInterfaceSystem,
    sources: dict[str, _Source],
    watch: StationWatch,
) -> _Inboxes:
    """Adds the subscriber of each source, for the watch and for other readers."""
    inboxes = {}
    for name, source in sources.items():
        inboxes[name] = builder.AddNamedSystem(
            f"{name}_inbox",
            LcmSubscriberSystem(
                channel=source.channel,
                serializer=InboxSerializer(source.decoder),
                lcm=bus,
            ),
        )
        builder.Connect(inboxes[name].get_output_port(), watch.GetInputPort(name))
    return inboxes


def _wire_gripper(
    builder: DiagramBuilder, side: str, watch: StationWatch, measure: ArmMeasurement
) -> None:
    """Exports a gripper's measurements, derived from its arm's joints, and the arm's `stopped`."""
    status = builder.GetSubsystemByName(f"{side}_arm_status")
    for name, port in (
        ("position", "position_measured"),
        ("velocity", "velocity_measured"),
        ("torque_external", "torque_external"),
    ):
        builder.Connect(status.GetOutputPort(port), measure.GetInputPort(f"{side}_{name}"))
    builder.Connect(watch.GetOutputPort(f"{side}_arm_valid"), measure.GetInputPort(f"{side}_valid"))
    builder.ExportOutput(watch.GetOutputPort(f"{side}_arm_stopped"), f"{side}_arm.stopped")
    for quantity in ("position", "velocity", "force"):
        builder.ExportOutput(
            measure.GetOutputPort(f"{side}_gripper_{quantity}"),
            f"{side}_gripper.{quantity}_measured",
        )


def _add_meter(builder: DiagramBuilder, links: Links, inboxes: _Inboxes) -> CommandMeter:
    """Adds the system that records the age of the arms' status at each command."""
    meter: CommandMeter = builder.AddNamedSystem(
        "command_meter", CommandMeter(links.command_period, links.command_offset)
    )
    for side in SIDES:
        builder.Connect(inboxes[f"{side}_arm"].get_output_port(), meter.GetInputPort(side))
    return meter


def _export_estimates(builder: DiagramBuilder, inboxes: _Inboxes, heard: Heard) -> None:
    """Exports the estimates of garment and person; until new messages come, the first ones."""
    starts: Mapping[str, FloatArray] = {"garment": heard.garment, "person": heard.person}
    for name, exported in (
        ("garment", {"position": "garment_position", "velocity": "garment_velocity"}),
        ("person", {"position": "joint_position"}),
    ):
        points = builder.AddNamedSystem(f"{name}_points", PointReceiver(starts[name]))
        builder.Connect(inboxes[name].get_output_port(), points.get_input_port())
        for port, out in exported.items():
            builder.ExportOutput(points.GetOutputPort(port), f"estimate.{out}")


def _guarded(
    builder: DiagramBuilder, bus: LcmInterfaceSystem, name: str, source: _Source
) -> LcmSubscriberSystem:
    return builder.AddNamedSystem(
        name,
        LcmSubscriberSystem(
            channel=source.channel,
            serializer=GuardedSerializer(source.decoder, cpp_serializer(source.lcm_type)),
            lcm=bus,
        ),
    )


def _wire_arm(
    builder: DiagramBuilder, p: HardwareParameters, bus: LcmInterfaceSystem, side: str, s: _Source
) -> None:
    sound = _guarded(builder, bus, f"{side}_arm_messages", s)
    status = builder.AddNamedSystem(f"{side}_arm_status", PandaStatusReceiver())
    builder.Connect(sound.get_output_port(), status.get_input_port())
    for name in ARM_STATUS:
        builder.ExportOutput(status.GetOutputPort(name), f"{side}_arm.{name}")
    wanted = control_modes(p.mode)
    command = builder.AddNamedSystem(
        f"{side}_arm_command", PandaCommandSender(7, sum(wanted.values()))
    )
    for name in wanted:
        builder.ExportInput(command.GetInputPort(name), f"{side}_arm.{name}")
    publisher = builder.AddNamedSystem(
        f"{side}_arm_publisher",
        LcmPublisherSystem.Make(
            channel=p.links.of_arm("command", side),
            lcm_type=lcmt_panda_command,
            lcm=bus,
            publish_period=p.links.command_period,
            publish_offset=p.links.command_offset,
            use_cpp_serializer=True,
        ),
    )
    builder.Connect(command.get_output_port(), publisher.get_input_port())


def control_modes(mode: str) -> dict[str, int]:
    """Returns Drake's control mode bits of one of `panda_driver.MODES`, by port name."""
    both = {"position": PandaControlMode.kPosition, "velocity": PandaControlMode.kVelocity}
    return {name: one for name, one in both.items() if name in mode}


def _wire_camera(
    builder: DiagramBuilder, bus: LcmInterfaceSystem, name: str, source: _Source
) -> None:
    sound = _guarded(builder, bus, f"camera_{name}_messages", source)
    images = builder.AddNamedSystem(f"camera_{name}_images", LcmImageArrayToImages())
    builder.Connect(sound.get_output_port(), images.get_input_port())
    for kind in ("color", "depth"):
        builder.ExportOutput(images.GetOutputPort(f"{kind}_image"), f"{name}.{kind}_image")
