"""Perfect trackers of garment and person, in place of real ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_dress.models.effects.composition import true_times
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.sensing import TimeOffset
from drake_dress.systems.cloth_plant import ClothPlant
from drake_dress.systems.delay import delayed
from drake_dress.systems.garment_oracle import GarmentOracle
from drake_dress.systems.joint_oracle import JointOracle


def export_oracles(
    builder: DiagramBuilder,
    cloth: ClothPlant,
    plant: MultibodyPlant,
    joint_points: list[tuple[int, np.ndarray]],
    transfer: sp.csr_array,
    effects: Sequence[Effect],
    period: float,
) -> None:
    """Adds the oracles of garment and person, and exports `estimate.…`.

    Args:
        builder: of the station.
        cloth: the true garment.
        plant: with the person.
        joint_points: the person's joints: body index, and point in the body's frame, m.
        transfer: (m,n) from the true garment's nodes to the controller's.
        effects: those on cameras and their clock are applied. A clock that is behind has no effect,
            because controllers do not read time stamps.
        period: to which the delay of the garment's estimate is rounded, s.
    """
    garment = builder.AddNamedSystem("garment_oracle", GarmentOracle(transfer, effects))
    joints = builder.AddNamedSystem("joint_oracle", JointOracle(joint_points, effects))
    builder.Connect(plant.get_body_poses_output_port(), joints.GetInputPort("body_poses"))
    builder.ExportOutput(joints.GetOutputPort("joint_position"), "estimate.joint_position")
    true = builder.AddNamedSystem("true_joints", JointOracle(joint_points))
    builder.Connect(plant.get_body_poses_output_port(), true.GetInputPort("body_poses"))
    builder.ExportOutput(true.GetOutputPort("joint_position"), "cheat_joint_position")
    late = -float(true_times(np.zeros(1), effects, TimeOffset.NAME)[0])
    for quantity in ("position", "velocity"):
        builder.Connect(
            cloth.GetOutputPort(f"garment_{quantity}"), garment.GetInputPort(f"garment_{quantity}")
        )
        port = garment.GetOutputPort(f"estimated_{quantity}")
        still = np.zeros(port.size())
        if quantity == "position":
            still = np.asarray(transfer @ cloth.start_position).ravel()
        port = delayed(builder, port, still, period, late)
        builder.ExportOutput(port, f"estimate.garment_{quantity}")
