"""A station whose estimate of the garment comes from its cameras."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.diagrams.setup import Setup
from drake_dress.diagrams.station import Station, hung_garment
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.models.human.body import arm_points
from drake_dress.models.perception.delayed_tracking import DelayedTracker, Motion, Tracking
from drake_dress.models.perception.garment_filter import GarmentFilter
from drake_dress.models.sides import SIDES
from drake_dress.systems.garment_geometry import GARMENT_LABEL
from drake_dress.systems.garment_tracker import GarmentTracker, TrackerTiming

AnyStation = TypeVar("AnyStation", bound=Station)
# Output ports of the tracker, which replace the station's own.
_ESTIMATES = ("garment_position", "garment_velocity")


def with_tracker(station: AnyStation, setup: Setup, policy: DressingPolicy) -> AnyStation:
    """Returns a station with the same ports, whose garment is tracked in its images.

    It exports `estimate.garment_age` as well, and what an inner station estimates of the garment
    as `cheat_estimated_garment_position`.

    Args:
        station: with cameras whose images have labels and times.
        setup: with a tracked garment.
        policy: of the controller.
    """
    builder = DiagramBuilder()
    inner = builder.AddNamedSystem("station", station.diagram)
    tracker = builder.AddNamedSystem("garment_tracker", garment_tracker(station, setup, policy))
    for side in SIDES:
        grippers = inner.GetOutputPort(f"{side}_gripper.position_measured")
        builder.Connect(grippers, tracker.GetInputPort(f"{side}_gripper_position"))
    joints = inner.GetOutputPort("estimate.joint_position")
    builder.Connect(joints, tracker.GetInputPort("joint_position"))
    builder.Connect(inner.GetOutputPort("grippers_open"), tracker.GetInputPort("grippers_open"))
    for camera in setup.station.cameras:
        for name in ("depth_image", "label_image", "image_time"):
            port = f"{camera.name}.{name}"
            builder.Connect(inner.GetOutputPort(port), tracker.GetInputPort(port))
    _export_all(builder, inner)
    for name in _ESTIMATES:
        builder.ExportOutput(tracker.GetOutputPort(name), f"estimate.{name}")
    builder.ExportOutput(tracker.GetOutputPort("age"), "estimate.garment_age")
    diagram = builder.Build()
    diagram.set_name("station")
    return replace(station, diagram=diagram)


def garment_tracker(station: Station, setup: Setup, policy: DressingPolicy) -> GarmentTracker:
    """Returns the tracker of a scenario as a system, which starts with the garment as it hangs.

    Args:
        station: whose images it sees.
        setup: with a tracked garment.
        policy: of the controller.
    """
    p, s = setup.scenario.perception, setup.station
    tracker = delayed_tracker(setup, policy)
    joints = [arm_points(s.measures, s.posture, side, s.arms[side]) for side in SIDES]
    motion = Motion(0.0, station.start_grippers, np.concatenate(joints), False)
    return GarmentTracker(
        tracker,
        start_of_tracking(tracker, setup, motion),
        barycentric_transfer(_tracked(setup), policy.mesh),
        {camera.name: camera.pinhole for camera in s.cameras},
        GARMENT_LABEL,
        TrackerTiming(p.period, p.delay, waits=not station.in_real_time),
    )


def delayed_tracker(setup: Setup, policy: DressingPolicy) -> DelayedTracker:
    """Returns the tracker of a scenario.

    Args:
        setup: with a tracked garment.
        policy: of the controller, with its model of the person.
    """
    mesh, p = _tracked(setup), setup.scenario.perception
    settings, material = model_of(p.filter), Material(**vars(p.material))
    holding, free = (GarmentFilter(mesh, material, settings, holds) for holds in (True, False))
    return DelayedTracker(holding, free, mesh.held_offsets, policy.person, p.memory)


def start_of_tracking(tracker: DelayedTracker, setup: Setup, motion: Motion) -> Tracking:
    """Returns the state at the start of a run, with the garment as it hangs.

    Args:
        tracker: of the setup.
        setup: with a tracked garment.
        motion: of grippers and person at the start.
    """
    return tracker.begun(hung_garment(replace(setup.station, mesh=_tracked(setup))), motion)


def _tracked(setup: Setup) -> GarmentMesh:
    if setup.garments.tracked is None:
        raise ValueError("the setup has no tracked garment")
    return setup.garments.tracked


def _export_all(builder: DiagramBuilder, inner: Diagram) -> None:
    """Exports the ports of an inner station under their names."""
    for i in range(inner.num_input_ports()):
        port = inner.get_input_port(i)
        builder.ExportInput(port, port.get_name())
    for i in range(inner.num_output_ports()):
        port = inner.get_output_port(i)
        name = port.get_name()
        if name == "estimate.garment_position":
            name = "cheat_estimated_garment_position"
        if name != "estimate.garment_velocity":
            builder.ExportOutput(port, name)
