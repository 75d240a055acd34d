"""The diagram of a lab: a simulated station with arms, behind hardware messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status, lcmt_point_cloud
from pydrake.lcm import DrakeLcm
from pydrake.manipulation import PandaCommandReceiver, PandaStatusSender
from pydrake.systems.framework import Diagram, OutputPort
from pydrake.systems.lcm import (
    LcmInterfaceSystem,
    LcmSubscriberSystem,
    PySerializer,
    SerializerInterface,
)

from drake_dress.diagrams.cameras import Camera
from drake_dress.diagrams.end_messages import (
    receive_cue,
    receive_release,
    send_gripper_status,
)
from drake_dress.diagrams.hardware_station import control_modes
from drake_dress.diagrams.sections.hardware import links
from drake_dress.diagrams.setup import Setup
from drake_dress.diagrams.station import ARM_STATUS, MOTION, SimulatedStation
from drake_dress.diagrams.studio import add_picture_messages
from drake_dress.diagrams.wiring import Wiring
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.sides import SIDES, Side
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.models.supervision.injection import InjectedFault
from drake_dress.models.supervision.supervision import Patience
from drake_dress.models.supervision.watch import WatchSettings
from drake_dress.models.supervision.wrong_points import WRONG_POINTS
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.camera_outbox import CameraOutbox, Take
from drake_dress.systems.fault_player import FaultPlayer
from drake_dress.systems.lcm_inbox import (
    Check,
    Decoder,
    GuardedSerializer,
    InboxSerializer,
    cpp_serializer,
)
from drake_dress.systems.outbox import Outbox, StatusOutbox
from drake_dress.systems.point_messages import PointSender
from drake_dress.systems.point_noise import PointNoise
from drake_dress.systems.run_recorder import RunRecorder
from drake_dress.systems.spoiler import Spoil, spoil_points
from drake_dress.systems.station_watch import StationWatch

# Ports of the station that pictures are rendered from.
_PICTURED = ("cheat_plant_state", "cheat_garment_position")
_WATCH_PERIOD = 0.005
# Offset of a joint's reported position in the fault `joint_leap`, rad.
_LEAP = 0.3


@dataclass(frozen=True)
class LabDiagram:
    """A lab's diagram, and the parts of it that its loop reads."""

    diagram: Diagram
    station: SimulatedStation
    watch: StationWatch
    player: FaultPlayer
    lcm: DrakeLcm


def make_lab(
    setup: Setup,
    station: SimulatedStation,
    lcm: DrakeLcm,
    writer: RunLogWriter | None,
    take: Take | None = None,
) -> LabDiagram:
    """Returns a station behind its messages.

    Args:
        setup: of the lab's scenario.
        station: with arms and estimates.
        lcm: its bus.
        writer: of the lab's own log, if one is kept.
        take: renders pictures in another process. When None, the diagram renders them itself,
            which delays the arms.
    """
    make = _LabMaker(setup, station, lcm)
    for side in SIDES:
        make.receive_commands(side)
        make.send_status(side)
    make.receive_end()
    garment = [make.station.GetOutputPort(f"estimate.garment_{q}") for q in MOTION]
    make.send_points("garment", len(setup.garments.belief.rest_position), garment)
    make.send_points("person", 6, [make.noisy_person()])
    for camera in setup.station.cameras:
        if take is None:
            make.send_pictures(camera)
        else:
            make.send_pictures_taken_elsewhere(camera, take)
    if writer is not None:
        make.record(writer)
    diagram = make.builder.Build()
    diagram.set_name("lab")
    return LabDiagram(diagram, station, make.watch, make.player, lcm)


class _LabMaker(Wiring):
    """A lab's diagram under construction: station, bus, and the player of faults."""

    def __init__(self, setup: Setup, station: SimulatedStation, lcm: DrakeLcm) -> None:
        super().__init__(station)
        scenario = setup.scenario
        self.setup, self.scenario, self.lcm = setup, scenario, lcm
        self.hardware, self.links = scenario.station.hardware, links(scenario.station)
        self.faults = [
            InjectedFault(f.kind, f.source, f.start, f.duration) for f in scenario.lab.faults
        ]
        self.modes = control_modes(scenario.station.arms.mode)
        self.bus = self.add("lcm", LcmInterfaceSystem(lcm))
        stale = scenario.lab.stale_command
        settings = {f"{side}_command": WatchSettings(stale, late=stale) for side in SIDES}
        self.watch = self.add("command_watch", StationWatch(settings, Patience(), _WATCH_PERIOD))
        self.player = self.add(
            "fault_player", FaultPlayer(self.faults, scenario.lab.push, _WATCH_PERIOD)
        )
        self.connect(self.player, "push", self.station, "cheat_push")

    def receive_commands(self, side: Side) -> None:
        """Passes an arm's sound commands to the station, and all of them to the watch."""
        channel = self.links.of_arm("command", side)
        check = _command_check(sum(self.modes.values()))
        decoder = Decoder(lcmt_panda_command, check, self.scenario.lab.stale_command)
        inbox = self.add(
            f"{side}_command_inbox",
            LcmSubscriberSystem(channel=channel, serializer=InboxSerializer(decoder), lcm=self.bus),
        )
        self.builder.Connect(inbox.get_output_port(), self.watch.GetInputPort(f"{side}_command"))
        self.connect(self.watch, f"{side}_command_valid", self.player, f"{side}_valid")
        self.connect(self.player, f"{side}_fresh", self.station, f"cheat_{side}_arm_fresh")
        sound = self.add(
            f"{side}_command_messages",
            LcmSubscriberSystem(
                channel=channel,
                serializer=GuardedSerializer(decoder, cpp_serializer(lcmt_panda_command)),
                lcm=self.bus,
            ),
        )
        command = self.add(f"{side}_command", PandaCommandReceiver(7, sum(self.modes.values())))
        self.builder.Connect(sound.get_output_port(), command.GetInputPort("lcmt_panda_command"))
        if "position" in self.modes:
            self.connect(
                self.station, f"{side}_arm.position_measured", command, "position_measured"
            )
        for name in self.modes:
            self.connect(command, name, self.station, f"{side}_arm.{name}")

    def send_status(self, side: Side) -> None:
        """Sends the status of an arm."""
        status = self.add(f"{side}_status", PandaStatusSender())
        for name in ARM_STATUS:
            self.connect(self.station, f"{side}_arm.{name}", status, name)
        outbox = self._send(
            f"{side}_arm",
            self.links.of_arm("status", side),
            status.get_output_port(),
            cpp_serializer(lcmt_panda_status),
            lcmt_panda_status,
            self.hardware.status_rate,
            _ARM_SPOILS,
            StatusOutbox,
        )
        self.connect(self.station, f"cheat_{side}_arm_stop", outbox, "stop")

    def receive_end(self) -> None:
        """Receives cue and commands to open the grippers, and sends the grippers' status."""
        commands, statuses = (self.links.of_grippers(kind) for kind in ("command", "status"))
        receive_release(self.builder, self.bus, commands, self.station.GetInputPort("release"))
        opened = self.station.GetOutputPort("grippers_open")
        send_gripper_status(self.builder, self.bus, statuses, opened)
        if self.station.HasInputPort("cue"):
            cue = self.station.GetInputPort("cue")
            receive_cue(self.builder, self.bus, self.links.cue, cue)

    def noisy_person(self) -> OutputPort:
        """Returns the person's points as a tracker would report them."""
        noise = self.add(
            "person_noise", PointNoise(6, self.scenario.lab.person_noise, self.scenario.seed)
        )
        self.builder.Connect(
            self.station.GetOutputPort("estimate.joint_position"), noise.get_input_port()
        )
        return noise.get_output_port()

    def send_points(self, name: str, count: int, ports: list[OutputPort]) -> None:
        """Sends an estimate: `count` points, and their velocities if there are two ports."""
        sender = self.add(f"{name}_points", PointSender(count, len(ports) > 1))
        for i, port in enumerate(ports):
            self.builder.Connect(port, sender.get_input_port(i))
        self._send(
            name,
            getattr(self.links, name),
            sender.get_output_port(),
            PySerializer(lcmt_point_cloud),
            lcmt_point_cloud,
            self.hardware.estimate_rate,
            _POINT_SPOILS,
        )

    def send_pictures(self, camera: Camera) -> None:
        """Sends the pictures of a camera of the station."""
        self._send(
            f"camera_{camera.name}",
            self.links.of_camera(camera.name),
            add_picture_messages(self.builder, self.station, camera.name),
            cpp_serializer(lcmt_image_array),
            lcmt_image_array,
            camera.rate,
            {},
        )

    def send_pictures_taken_elsewhere(self, camera: Camera, take: Take) -> None:
        """Sends the pictures of a camera, which another process renders."""
        sizes = tuple(self.station.GetOutputPort(name).size() for name in _PICTURED)
        outbox = self.add(
            f"camera_{camera.name}_outbox",
            CameraOutbox(
                camera.name,
                self.links.of_camera(camera.name),
                take,
                sizes,
                self.lcm,
                1.0 / camera.rate,
                self.faults,
            ),
        )
        for name, port in zip(_PICTURED, ("plant_state", "garment_position"), strict=True):
            self.connect(self.station, name, outbox, port)
        self.connect(self.player, "since", outbox, "since")

    def record(self, writer: RunLogWriter) -> None:
        """Adds the recorder of the lab's own log."""
        recorder = self.add(
            "run_recorder",
            RunRecorder(
                writer,
                self.setup.garments.plant,
                len(self.setup.garments.belief.rest_position),
                self.of.person.placed_capsules,
                self.setup.rates.log_period,
                self.setup.rates.command_period,
                arm_period=self.setup.rates.plant_period,
                has_control=False,
            ),
        )
        to = {
            f"cheat_{n}": n
            for n in ("garment_position", "contact", "contact_force", "body_poses", "intent")
        }
        to |= {
            "cheat_joint_position": "joint_position",
            "estimate.garment_position": "estimated_position",
            "estimate.joint_position": "estimated_joint_position",
        }
        for side in SIDES:
            to |= {
                f"{side}_gripper.position_measured": f"{side}_gripper_position",
                f"{side}_gripper.force_measured": f"{side}_gripper_force",
                f"{side}_arm.position_measured": f"{side}_arm_position",
                f"{side}_arm.velocity_measured": f"{side}_arm_velocity",
                f"{side}_arm.position_commanded": f"{side}_arm_command",
                f"{side}_arm.torque_measured": f"{side}_arm_torque",
            }
        for name, port in to.items():
            self.connect(self.station, name, recorder, port)
        # the log starts at the first command
        self.connect(self.player, "since", recorder, "active")

    def _send(
        self,
        name: str,
        channel: str,
        port: OutputPort,
        serializer: SerializerInterface,
        lcm_type: Any,
        rate: float,
        spoils: Mapping[str, Spoil],
        kind: type[Outbox] = Outbox,
    ) -> Outbox:
        outbox: Outbox = self.add(
            f"{name}_outbox",
            kind(
                name, channel, serializer, lcm_type, self.lcm, 1.0 / rate, 0.0, self.faults, spoils
            ),
        )
        self.builder.Connect(port, outbox.GetInputPort("message"))
        self.connect(self.player, "since", outbox, "since")
        return outbox


def _command_check(mode: int) -> Check:
    """Returns the check of an `lcmt_panda_command`."""

    def check(message: Any) -> Finding:
        # Drake's sender fills in only the arrays of its control mode
        sizes = {1: message.num_joint_position, 2: message.num_joint_velocity}
        for bit, size in sizes.items():
            if size != (7 if mode & bit else 0):
                return Finding(Fault.WRONG_SIZE)
        values = [*message.joint_position, *message.joint_velocity]
        return SOUND if np.isfinite(values).all() else Finding(Fault.NOT_FINITE)

    return check


def _nan_joints(message: Any, first: Any, number: int) -> None:
    message.joint_position = [float("nan")] * 7


def _joint_too_far(message: Any, first: Any, number: int) -> None:
    position = list(message.joint_position)
    position[3] = float(LIMITS.upper[3]) + 0.05
    message.joint_position = position


def _joint_elsewhere(message: Any, first: Any, number: int) -> None:
    position = list(message.joint_position)
    position[0] -= np.copysign(_LEAP, position[0])
    message.joint_position = position


def _mode_unknown(message: Any, first: Any, number: int) -> None:
    message.robot_mode = lcmt_panda_status.kOther


def _nan_points(message: Any, first: Any, number: int) -> None:
    message.data = np.full(len(message.data) // 4, np.nan, dtype="<f4").tobytes()


_ARM_SPOILS: dict[str, Spoil] = {
    "nan": _nan_joints,
    "joint_limit": _joint_too_far,
    "joint_leap": _joint_elsewhere,
    "mode_unknown": _mode_unknown,
}
_POINT_SPOILS: dict[str, Spoil] = {"nan": _nan_points} | {
    kind: spoil_points(wrong) for kind, wrong in WRONG_POINTS.items()
}
