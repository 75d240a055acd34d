"""A lab in a process of its own: arms, garment, person behind the messages of hardware."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from drake import lcmt_image_array, lcmt_panda_command, lcmt_panda_status, lcmt_point_cloud
from pydrake.lcm import DrakeLcm
from pydrake.manipulation import PandaCommandReceiver, PandaStatusSender
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.lcm import (
    LcmInterfaceSystem,
    LcmSubscriberSystem,
    PySerializer,
    SerializerInterface,
)
from rich.console import Console

from drake_dress import __version__
from drake_dress.diagrams.arms import ArmReachError, arm_bases
from drake_dress.diagrams.assemble import garments
from drake_dress.diagrams.build import cameras as station_cameras
from drake_dress.diagrams.build import links, plant_station, station_parameters
from drake_dress.diagrams.hardware_station import NoBusError, control_modes, open_bus
from drake_dress.diagrams.run import NOT_DRESSED, concluded
from drake_dress.diagrams.scenario import Scenario, apply_variation, resolved_yaml
from drake_dress.diagrams.station import ARM_STATUS, SimulatedStation
from drake_dress.diagrams.studio import Studio, add_picture_messages
from drake_dress.errors import UserError
from drake_dress.file_output import RUN_FILES, claimed, remove_results
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.models.arm.command_guard import Stop
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.models.supervision.injection import InjectedFault
from drake_dress.models.supervision.supervision import Patience
from drake_dress.models.supervision.watch import WatchSettings
from drake_dress.models.supervision.wrong_points import WRONG_POINTS
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.apart import Apart
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

# Is said when statuses come.
OPEN = "the lab is open"
_CHUNK = 0.05
# What pictures are taken of.
_PICTURED = ("cheat_plant_state", "cheat_garment_position")
_WATCH_PERIOD = 0.005
# By which a joint is reported elsewhere, rad.
_LEAP = 0.3


@dataclass(frozen=True)
class Lab:
    """A lab's diagram, and what its loop looks at."""

    diagram: Diagram
    station: SimulatedStation
    watch: StationWatch
    player: FaultPlayer
    lcm: DrakeLcm


def run_lab(
    scenario: Scenario, source: Path, out: Path, realtime_rate: float = 1.0, report: bool = True
) -> int:
    """Plays a scenario's lab until its commands have ended; returns the exit status.

    Args:
        scenario: loaded and validated; its variation is drawn here from its seed.
        source: the scenario's file, for messages and paths relative to it.
        out: directory to write to.
        realtime_rate: at most this many simulated seconds per second.
        report: whether report and replay are written beside log and summary.

    Raises:
        UserError: the garment or the arms cannot be used, or there is no bus.
    """
    scenario = apply_variation(scenario)
    if scenario.station.arms.model != "panda":
        raise UserError(str(source), "station.arms.model", "is floating, expected panda")
    meshes, _ = garments(scenario, source)
    url = scenario.station.hardware.lcm_url
    try:
        lcm = open_bus(url)
        station = plant_station(scenario, meshes.plant, None, meshes.belief)
    except ArmReachError as error:
        raise UserError(str(source), "station.arms", str(error)) from error
    except NoBusError as error:
        raise UserError(str(source), "station.hardware.lcm_url", str(error)) from error
    take = None
    if scenario.station.cameras:
        take = Apart(Studio(station_parameters(scenario, meshes.plant))).submit
    with claimed("--out", out):
        with RunLogWriter(
            out / RUN_FILES[0],
            garment=meshes.plant,
            scenario_text=resolved_yaml(scenario),
            version=__version__,
            seed=scenario.seed,
            radius=station.person.radius,
            capsule_radius=[c.radius for c in station.person.capsules],
            estimate_garment=meshes.belief,
            bases=arm_bases(station.robots),
            results=RUN_FILES[1:],
        ) as writer:
            lab = make_lab(scenario, station, lcm, meshes.plant, meshes.belief, writer, take)
            heard, ended, wall_time = _play(lab, scenario, realtime_rate, writer)
        interrupt = ended if isinstance(ended, Interrupt) else None
        if not heard:
            remove_results(out, RUN_FILES[:1])
            print(f"no run: {ended}" if interrupt is None else interrupt.word)
            return NOT_DRESSED if interrupt is None else interrupt.status
        return concluded(out, wall_time, report, interrupt)


def make_lab(
    scenario: Scenario,
    station: SimulatedStation,
    lcm: DrakeLcm,
    mesh: GarmentMesh,
    belief: GarmentMesh,
    writer: RunLogWriter | None,
    take: Take | None = None,
) -> Lab:
    """Returns a station behind its messages.

    Args:
        scenario: of the lab.
        station: with arms and estimates.
        lcm: its bus.
        mesh: the true garment.
        belief: the one that is reported of.
        writer: of the lab's own log, if one is kept.
        take: has pictures taken elsewhere; they are taken on the way, which holds up the arms,
            when None.
    """
    h, to = scenario.station.hardware, links(scenario)
    faults = [InjectedFault(f.kind, f.source, f.start, f.duration) for f in scenario.lab.faults]
    builder = DiagramBuilder()
    lab = builder.AddNamedSystem("station", station.diagram)
    bus = builder.AddNamedSystem("lcm", LcmInterfaceSystem(lcm))
    stale_command = scenario.lab.stale_command
    stale = WatchSettings(stale_command, late=stale_command)
    watch = builder.AddNamedSystem(
        "command_watch",
        StationWatch({f"{s}_command": stale for s in SIDES}, Patience(), _WATCH_PERIOD),
    )
    player = builder.AddNamedSystem(
        "fault_player", FaultPlayer(faults, scenario.lab.push, _WATCH_PERIOD)
    )
    builder.Connect(player.GetOutputPort("push"), lab.GetInputPort("cheat_push"))
    wanted = control_modes(scenario.station.arms.mode)

    def send(
        name: str,
        channel: str,
        port: OutputPort,
        serializer: SerializerInterface,
        lcm_type: Any,
        rate: float,
        spoils: Mapping[str, Spoil],
        kind: type[Outbox] = Outbox,
    ) -> Outbox:
        outbox = builder.AddNamedSystem(
            f"{name}_outbox",
            kind(name, channel, serializer, lcm_type, lcm, 1.0 / rate, 0.0, faults, spoils),
        )
        builder.Connect(port, outbox.GetInputPort("message"))
        builder.Connect(player.GetOutputPort("since"), outbox.GetInputPort("since"))
        return outbox

    for side in SIDES:
        channel = to.of_arm("command", side)
        decoder = Decoder(lcmt_panda_command, _command_check(sum(wanted.values())), stale_command)
        inbox = builder.AddNamedSystem(
            f"{side}_command_inbox",
            LcmSubscriberSystem(channel=channel, serializer=InboxSerializer(decoder), lcm=bus),
        )
        builder.Connect(inbox.get_output_port(), watch.GetInputPort(f"{side}_command"))
        builder.Connect(
            watch.GetOutputPort(f"{side}_command_valid"), player.GetInputPort(f"{side}_valid")
        )
        builder.Connect(
            player.GetOutputPort(f"{side}_fresh"), lab.GetInputPort(f"cheat_{side}_arm_fresh")
        )
        sound = builder.AddNamedSystem(
            f"{side}_command_messages",
            LcmSubscriberSystem(
                channel=channel,
                serializer=GuardedSerializer(decoder, cpp_serializer(lcmt_panda_command)),
                lcm=bus,
            ),
        )
        command = builder.AddNamedSystem(
            f"{side}_command", PandaCommandReceiver(7, sum(wanted.values()))
        )
        builder.Connect(sound.get_output_port(), command.GetInputPort("lcmt_panda_command"))
        if "position" in wanted:
            builder.Connect(
                lab.GetOutputPort(f"{side}_arm.position_measured"),
                command.GetInputPort("position_measured"),
            )
        for name in wanted:
            builder.Connect(command.GetOutputPort(name), lab.GetInputPort(f"{side}_arm.{name}"))
        status = builder.AddNamedSystem(f"{side}_status", PandaStatusSender())
        for name in ARM_STATUS:
            builder.Connect(lab.GetOutputPort(f"{side}_arm.{name}"), status.GetInputPort(name))
        outbox = send(
            f"{side}_arm",
            to.of_arm("status", side),
            status.get_output_port(),
            cpp_serializer(lcmt_panda_status),
            lcmt_panda_status,
            h.status_rate,
            _ARM_SPOILS,
            StatusOutbox,
        )
        builder.Connect(lab.GetOutputPort(f"cheat_{side}_arm_stop"), outbox.GetInputPort("stop"))
    for name, count, ports in (
        ("garment", len(belief.rest_position), ("garment_position", "garment_velocity")),
        ("person", 6, ("joint_position",)),
    ):
        sender = builder.AddNamedSystem(f"{name}_points", PointSender(count, len(ports) > 1))
        for i, port in enumerate(ports):
            estimate = lab.GetOutputPort(f"estimate.{port}")
            if name == "person":
                noise = builder.AddNamedSystem(
                    "person_noise", PointNoise(count, scenario.lab.person_noise, scenario.seed)
                )
                builder.Connect(estimate, noise.get_input_port())
                estimate = noise.get_output_port()
            builder.Connect(estimate, sender.get_input_port(i))
        send(
            name,
            getattr(to, name),
            sender.get_output_port(),
            PySerializer(lcmt_point_cloud),
            lcmt_point_cloud,
            h.estimate_rate,
            _POINT_SPOILS,
        )
    for camera in station_cameras(scenario):
        if take is not None:
            elsewhere = builder.AddNamedSystem(
                f"camera_{camera.name}_outbox",
                CameraOutbox(
                    camera.name,
                    to.of_camera(camera.name),
                    take,
                    tuple(lab.GetOutputPort(n).size() for n in _PICTURED),  # type: ignore[arg-type]
                    lcm,
                    1.0 / camera.rate,
                    faults,
                ),
            )
            for name, port in zip(_PICTURED, ("plant_state", "garment_position"), strict=True):
                builder.Connect(lab.GetOutputPort(name), elsewhere.GetInputPort(port))
            builder.Connect(player.GetOutputPort("since"), elsewhere.GetInputPort("since"))
            continue
        send(
            f"camera_{camera.name}",
            to.of_camera(camera.name),
            add_picture_messages(builder, lab, camera.name),
            cpp_serializer(lcmt_image_array),
            lcmt_image_array,
            camera.rate,
            {},
        )
    if writer is not None:
        _record(builder, lab, station, player, mesh, belief, scenario, writer)
    diagram = builder.Build()
    diagram.set_name("lab")
    return Lab(diagram, station, watch, player, lcm)


def _record(
    builder: DiagramBuilder,
    lab: Diagram,
    station: SimulatedStation,
    player: FaultPlayer,
    mesh: GarmentMesh,
    belief: GarmentMesh,
    scenario: Scenario,
    writer: RunLogWriter,
) -> None:
    person = station.person
    recorder = builder.AddNamedSystem(
        "run_recorder",
        RunRecorder(
            writer,
            mesh,
            len(belief.rest_position),
            [(int(person.body_indices[c.body]), c) for c in person.capsules],
            1.0 / scenario.log.rate,
            1.0 / scenario.controller.command_rate,
            arm_period=scenario.plant.body_time_step,
            has_control=False,
        ),
    )
    to = {f"cheat_{n}": n for n in ("garment_position", "contact", "contact_force", "body_poses")}
    to |= {
        "cheat_joint_position": "joint_position",
        "estimate.garment_position": "estimated_position",
        "estimate.joint_position": "estimated_joint_position",
    }
    for side in SIDES:
        to |= {f"{side}_gripper.{q}_measured": f"{side}_gripper_{q}" for q in ("position", "force")}
        to |= {
            f"{side}_arm.position_measured": f"{side}_arm_position",
            f"{side}_arm.velocity_measured": f"{side}_arm_velocity",
            f"{side}_arm.position_commanded": f"{side}_arm_command",
            f"{side}_arm.torque_measured": f"{side}_arm_torque",
        }
    for name, port in to.items():
        builder.Connect(lab.GetOutputPort(name), recorder.GetInputPort(port))
    # recorded from the first command on
    builder.Connect(player.GetOutputPort("since"), recorder.GetInputPort("active"))


def _play(
    lab: Lab, scenario: Scenario, realtime_rate: float, writer: RunLogWriter
) -> tuple[bool, str | Interrupt, float]:
    """Runs until commands have ended.

    Returns whether there were any, why it ended or the signal that ended it, and how long the run
    took, s.
    """
    simulator = Simulator(lab.diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    root = simulator.get_context()
    at = lab.player.GetMyContextFromRoot(root)
    station = lab.station.diagram
    inside = station.GetMyContextFromRoot(root)
    console = Console(stderr=True)
    begun_at: float | None = None
    now, told, stops = 0.0, 0.0, dict.fromkeys(SIDES, Stop.NONE)
    events: list[tuple[float, str]] = []
    ended: str | None = None
    with caught_interrupt() as interrupt:
        # before statuses are sent: what steps first anywhere may take a minute, to be compiled
        lab.station.cloth.rehearse(lab.station.cloth.GetMyContextFromRoot(root))
        simulator.Initialize()
        while not interrupt.is_set() and ended is None:
            now += _CHUNK
            simulator.AdvanceTo(now)
            if now == _CHUNK:
                print(f"{OPEN}: {scenario.station.hardware.lcm_url}", flush=True)
                simulator.ResetStatistics()
            since = float(lab.player.GetOutputPort("since").Eval(at)[0])
            idle = float(lab.player.GetOutputPort("idle").Eval(at)[0])
            if since < 0.0:
                if now >= scenario.lab.wait:
                    ended = f"no commands came for {scenario.lab.wait:g} s"
                continue
            if begun_at is None:
                begun_at = clock.perf_counter()
                console.print("commands come", highlight=False)
            for side in SIDES:
                stop = Stop(int(station.GetOutputPort(f"cheat_{side}_arm_stop").Eval(inside)[0]))
                if stop is not stops[side]:
                    line = f"{side} arm: " + (
                        "follows" if stop is Stop.NONE else f"holds, {stop.name.lower()}"
                    )
                    events.append((since, line))
                    stops[side] = stop
            if since - told >= 5.0 - 1e-9:
                told = since
                print(f"{since:5.1f} s", file=sys.stderr, flush=True)
            if idle >= scenario.lab.rest:
                ended = "commands ended"
    writer.note("events", "\n".join(f"{t:.3f} {line}" for t, line in events))
    wall = 0.0 if begun_at is None else clock.perf_counter() - begun_at
    return begun_at is not None, interrupt if ended is None else ended, wall


def _command_check(mode: int) -> Check:
    """Returns what tells what is wrong with a `lcmt_panda_command`."""

    def check(message: Any) -> Finding:
        # Drake's sender writes what it sends
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
