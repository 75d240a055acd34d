"""Two Panda arms in a MultibodyPlant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, PdControllerGains

from drake_dress.models.arm.chain import SerialArm
from drake_dress.models.arm.description import panda_urdf
from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.sides import SIDES, Side

# Of the drives at the joints: stiff as the maker's own position control, N·m/rad and N·m·s/rad.
_STIFFNESS = np.array([6000.0, 6000.0, 5000.0, 5000.0, 3000.0, 2000.0, 1500.0])
_DAMPING = 2.0 * np.sqrt(_STIFFNESS) * np.array([1.2, 1.2, 0.8, 0.8, 0.3, 0.3, 0.2])


@dataclass(frozen=True)
class PlantArm:
    """One arm in a plant.

    Attributes:
        model: its model instance; its joints are the plant's actuated ones there.
        arm: the same in plain numbers.
        tool: body between the fingertips.
    """

    model: ModelInstanceIndex
    arm: SerialArm
    tool: BodyIndex


def add_arms(plant: MultibodyPlant, bases: dict[Side, np.ndarray]) -> dict[Side, PlantArm]:
    """Adds a Panda for each side, with drives that hold positions and speeds asked for.

    A Panda carries its own weight (its maker's control does), so gravity is off for it. Its torques
    are limited. The plant has a discrete solver that takes drives implicitly, so that they are
    stiff at the garment's time step.

    Args:
        plant: not finalised.
        bases: X_WB (4,4) of each.
    """
    urdf = str(panda_urdf())
    arms: dict[Side, PlantArm] = {}
    for side in SIDES:
        parser = Parser(plant, f"{side}_arm")
        parser.SetAutoRenaming(True)
        (model,) = parser.AddModels(urdf)
        plant.RenameModelInstance(model, f"{side}_arm")
        plant.WeldFrames(
            plant.world_frame(),
            plant.GetFrameByName("panda_link0", model),
            RigidTransform(bases[side]),
        )
        plant.set_gravity_enabled(model, False)
        for i in range(len(LIMITS.torque)):
            joint = plant.GetJointByName(f"panda_joint{i + 1}", model)
            joint.set_acceleration_limits([-LIMITS.acceleration[i]], [LIMITS.acceleration[i]])
            actuator = plant.AddJointActuator(f"{side}_panda_joint{i + 1}", joint, LIMITS.torque[i])
            actuator.set_controller_gains(PdControllerGains(p=_STIFFNESS[i], d=_DAMPING[i]))
        tool = plant.GetBodyByName("panda_hand_tcp", model).index()
        arms[side] = PlantArm(model, panda(bases[side]), tool)
    return arms
