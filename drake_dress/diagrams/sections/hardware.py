"""The section `station.hardware`: channels, and bounds of plausible messages."""

from __future__ import annotations

import math

import numpy as np

from drake_dress.diagrams.hardware_station import Beliefs, HardwareParameters, Links
from drake_dress.diagrams.person import person_arms
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.station import StationParameters
from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.arm.status_check import JointBounds
from drake_dress.models.garment.edges import unique_edges
from drake_dress.models.garment.mesh import edge_lengths
from drake_dress.models.human.body import shoulder_joint
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.garment_belief import GarmentBounds
from drake_dress.models.supervision.garment_shape import ShapeBounds
from drake_dress.models.supervision.person_belief import PersonBounds
from drake_dress.models.supervision.person_pose import PoseBounds
from drake_dress.models.supervision.supervision import Patience


def links(section: schema.Station) -> Links:
    """Returns bus, channels and command period of a hardware station."""
    h = section.hardware
    return Links(
        lcm_url=h.lcm_url,
        status=h.status_channel,
        command=h.command_channel,
        garment=h.garment_channel,
        person=h.person_channel,
        camera=h.camera_channel,
        gripper_command=h.gripper_command_channel,
        gripper_status=h.gripper_status_channel,
        cue=h.cue_channel,
        command_period=1.0 / section.arms.rate,
    )


def hardware_parameters(section: schema.Station, p: StationParameters) -> HardwareParameters:
    """Returns the parameters of a hardware station.

    Args:
        section: with channels, time limits and bounds.
        p: parameters of the simulated twin, with the garment that estimates describe.

    Raises:
        ValueError: the grippers float.
    """
    if p.placement is None:
        raise ValueError("grippers float, expected arms")
    h = section.hardware
    left, right = (panda(p.placement.base(side)) for side in SIDES)
    return HardwareParameters(
        links=links(section),
        mode=p.mode,
        node_count=len(p.mesh.rest_position),
        arms=(left, right),
        beliefs=beliefs(h.beliefs, p),
        cameras=tuple(c.name for c in p.cameras),
        stale_status=h.stale_status,
        stale_estimate=h.stale_estimate,
        stale_camera=h.stale_camera,
        patience=Patience(h.settle_time, h.patience),
        wait=h.wait,
        start_distance=h.start_distance,
        start_angle=h.start_angle,
    )


def beliefs(b: schema.Beliefs, p: StationParameters) -> Beliefs:
    """Returns the bounds that messages about arms, person and garment are checked against."""
    body, mesh = p.measures, p.mesh
    pose = PoseBounds(
        shoulders=np.stack([shoulder_joint(body, p.posture, side) for side in SIDES]),
        limbs=tuple((own.upper_arm_length, own.forearm_length) for own in map(body.of, SIDES)),
        limits=person_arms(body, p.posture, p.arms, p.joints).limits,
        point_error=b.point_error,
        length_share=b.limb_share,
        shoulder_distance=b.shoulder_distance,
        turn=math.radians(b.turn_deg),
        joint_room=math.radians(b.joint_room_deg),
    )
    shape = ShapeBounds(
        edges=unique_edges(mesh.faces),
        rest_length=edge_lengths(mesh.rest_position, mesh.faces),
        grasp=(mesh.grasp["left"], mesh.grasp["right"]),
        extent=float(np.linalg.norm(np.ptp(mesh.rest_position, axis=0))),
        node_noise=b.node_noise,
        strain=b.strain,
        least_edge=b.least_edge,
        grasp_distance=b.grasp_distance,
    )
    return Beliefs(
        joints=JointBounds(LIMITS, b.joint_leap, b.torque_share),
        person=PersonBounds(pose, b.person_speed, b.frozen_time),
        garment=GarmentBounds(
            shape, b.garment_speed, b.garment_velocity, b.velocity_error, b.frozen_travel
        ),
    )
