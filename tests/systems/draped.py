"""A station whose coat hangs close behind the person, so that it drapes over the arms."""

from typing import Any

import numpy as np

from drake_dress.diagrams.station import (
    SimulatedStation,
    StationParameters,
    make_simulated_station,
)
from drake_dress.models.cloth.material import Material
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.body import ArmPose, BodyMeasures
from drake_dress.models.human.joints import JointParameters

H = 0.005


def draped_station(**changes: Any) -> SimulatedStation:
    """Returns it, with changes of its parameters."""
    return make_simulated_station(draped(**changes))


def draped(**changes: Any) -> StationParameters:
    """Returns its parameters."""
    pose = ArmPose(np.deg2rad(40.0), np.deg2rad(40.0), 0.0, np.deg2rad(10.0))
    values: dict[str, Any] = {
        "mesh": make_coat(CoatParameters(), 0.05),
        "material": Material(stretch_stiffness=300.0),
        "time_step": H,
        "body_time_step": H,
        "measures": BodyMeasures(),
        "posture": "standing",
        "arms": {"left": pose, "right": pose},
        "joints": JointParameters(2.0, 1.0, 1.5, 0.4),
        "gripper_max_speed": 0.25,
        "gripper_max_acceleration": 2.0,
        "distance_behind": 0.35,
        "integrator": "implicit",
        "iterations": 40,
        "tolerance": 5e-3,
        "implicitness": 1.0,
        "buckling_wavelength": 0.0,
        "self_collision": False,
        "grasp_stiffness": 3000.0,
        "mode": "position_velocity",
    }
    return StationParameters(**values | changes)
