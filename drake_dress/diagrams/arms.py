"""Two Panda arms in a MultibodyPlant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, PdControllerGains

from drake_dress.models.arm.chain import SerialArm
from drake_dress.models.arm.clearance import Capsules
from drake_dress.models.arm.description import panda_urdf
from drake_dress.models.arm.panda import LIMITS, SHAPE, panda
from drake_dress.models.arm.resolved_rate import ArmPair, GripperGoal, RateParameters
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.arm_stand import STAND_COLOR, arm_stand

# Gains of the joint drives, as stiff as the maker's position control, N·m/rad and N·m·s/rad.
_STIFFNESS = np.array([6000.0, 6000.0, 5000.0, 5000.0, 3000.0, 2000.0, 1500.0])
_DAMPING = 2.0 * np.sqrt(_STIFFNESS) * np.array([1.2, 1.2, 0.8, 0.8, 0.3, 0.3, 0.2])


# Preferred joint angles: elbows bent, wrists in the middle of their range, rad.
HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])
# Fraction of the speed and acceleration limits in use; margin to the position limits, rad.
_SPEED_SHARE, _ROOM = 0.85, 0.02
# Time step of a search for joint angles, s.
_SEARCH_STEP = 0.01


@dataclass(frozen=True)
class _Search:
    """Length of a search for joint angles, and its tolerances.

    Attributes:
        steps: largest number of steps.
        reached: distance of both grippers from their goals at which the search ends, m.
        allowed: largest admissible distance of a gripper from its goal at the end, m.
    """

    steps: int
    reached: float
    allowed: float


# For the start of a run, and for the later goals of a dressing, where the garment compensates for
# larger errors.
_TO_START = _Search(steps=1500, reached=0.0, allowed=1e-3)
_ON_THE_WAY = _Search(steps=800, reached=0.01, allowed=0.05)


class ArmReachError(ValueError):
    """An arm cannot reach the goal of its gripper."""


@dataclass(frozen=True)
class ArmPlacement:
    """Placement of two arms behind a person or in front, and orientation of their hands.

    Attributes:
        distance_behind: of the bases, m. spread: between them, m. height: of both, m.
        tilt: angle of the hands below the horizontal, rad.
        control: settings of the control of the joints.
        in_front: whether they stand in front of the person, at the same distance, and face it. The
            left arm holds the person's left sleeve on either side.
    """

    distance_behind: float
    spread: float
    height: float
    tilt: float
    control: RateParameters = RateParameters()
    in_front: bool = False

    def base(self, side: Side) -> np.ndarray:
        """Returns X_WB (4,4) of an arm."""
        pose = np.eye(4)
        pose[:3, :3] = self._turn
        half = 0.5 * self.spread
        ahead = self.distance_behind if self.in_front else -self.distance_behind
        pose[:3, 3] = ahead, half if side == "left" else -half, self.height
        return pose

    @property
    def hand(self) -> np.ndarray:
        """R_WT (3,3): z to the person and down; x to the arms' left, along the gripped seam."""
        c, s = np.cos(self.tilt), np.sin(self.tilt)
        return self._turn @ np.array([[0.0, s, c], [1.0, 0.0, 0.0], [0.0, c, -s]])

    @property
    def _turn(self) -> np.ndarray:
        return np.diag([-1.0, -1.0, 1.0]) if self.in_front else np.eye(3)


@dataclass(frozen=True)
class ArmSetup:
    """Two arms and their joint angles (2,7) at the start, rad."""

    pair: ArmPair
    start: np.ndarray


def _add_stand(plant: MultibodyPlant, side: Side, X_WB: RigidTransform) -> None:
    """Adds the column that an arm's base stands on, for pictures; nothing collides with it."""
    stand = arm_stand(X_WB)
    if stand is None or not plant.geometry_source_is_registered():
        return
    shape, pose = stand
    color = np.array([*STAND_COLOR, 1.0])
    plant.RegisterVisualGeometry(plant.world_body(), pose, shape, f"{side}_arm_stand", color)


def arm_bases(setup: ArmSetup | None) -> dict[Side, np.ndarray] | None:
    """Returns X_WB (4,4) of each arm; None without arms."""
    if setup is None:
        return None
    return {side: arm.base for side, arm in zip(SIDES, setup.pair.arms, strict=True)}


def set_up_arms(
    placement: ArmPlacement,
    grippers: np.ndarray,
    person: Capsules,
) -> ArmSetup:
    """Returns two arms whose grippers are at `grippers` (2,3), p_WG, m.

    Args:
        placement: of the arms.
        grippers: left, then right.
        person: obstacle for the arms.

    Raises:
        ArmReachError: one cannot get there; the message tells which and by how much.
    """
    # tighter limits, so that the overshoot of the drives stays within the true ones
    left, right = (
        replace(arm, limits=arm.limits.within(_SPEED_SHARE, _ROOM))
        for arm in (panda(placement.base(side)) for side in SIDES)
    )
    pair = ArmPair((left, right), (SHAPE, SHAPE), np.stack([HOME, HOME]), 2, placement.control)
    still = np.zeros_like(pair.home)
    goals = _goals(grippers, placement)
    what = "its gripper's place at the start"
    q, _ = _sent(pair, pair.home, still, goals, what, person, _TO_START)
    return ArmSetup(pair, q)


def _goals(grippers: np.ndarray, placement: ArmPlacement) -> tuple[GripperGoal, GripperGoal]:
    """Returns goals with grippers at rest at `grippers` (2,3), m, and hands as in `placement`."""
    left, right = (GripperGoal(p, np.zeros(3), placement.hand) for p in grippers)
    return left, right


def _sent(
    pair: ArmPair,
    q: np.ndarray,
    rate: np.ndarray,
    goals: tuple[GripperGoal, GripperGoal],
    what: str,
    person: Capsules,
    search: _Search,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns joint angles and rates (2,7) of the arms after a search for their goals.

    Args:
        pair: the arms.
        q: (2,7) initial joint angles, rad.
        rate: (2,7) initial joint rates, rad/s.
        goals: of left and right gripper.
        what: description of the goals, for messages.
        person: obstacle for the arms.
        search: length and tolerances.

    Raises:
        ArmReachError: an arm ends farther from its goal than the search allows.
    """
    grippers = np.stack([goal.position for goal in goals])
    short = np.full(2, np.inf)
    for _ in range(search.steps):
        rate = pair.rates(q, rate, goals, _SEARCH_STEP, person).rate
        q = q + _SEARCH_STEP * rate
        at = [arm.tool_position(row) for arm, row in zip(pair.arms, q, strict=True)]
        short = np.linalg.norm(np.stack(at) - grippers, axis=1)
        if short.max() < search.reached:
            break
    for i, side in enumerate(SIDES):
        if short[i] > search.allowed:
            raise ArmReachError(
                f"the {side} arm does not reach {what}, {np.round(grippers[i], 3).tolist()} m: "
                f"it ends {100.0 * short[i]:.1f} cm short"
            )
    return q, rate


def check_reach(
    setup: ArmSetup, placement: ArmPlacement, places: Mapping[str, np.ndarray], person: Capsules
) -> None:
    """Checks that the arms can reach a sequence of gripper goals, by kinematics alone.

    Args:
        setup: arms at the start.
        placement: of the arms.
        places: p_WG (2,3) of left and right, m, by a description for messages.
        person: obstacle for the arms.

    Raises:
        ArmReachError: an arm stays farther away than a garment can compensate for; the message
            tells which arm, its goal, and the remaining distance.
    """
    q, rate = setup.start, np.zeros_like(setup.start)
    for what, grippers in places.items():
        goals = _goals(grippers, placement)
        q, rate = _sent(setup.pair, q, rate, goals, what, person, _ON_THE_WAY)


@dataclass(frozen=True)
class PlantArm:
    """One arm in a plant.

    Attributes:
        model: its model instance; its joints are the plant's actuated ones there.
        arm: its kinematic model.
        tool: body between the fingertips.
    """

    model: ModelInstanceIndex
    arm: SerialArm
    tool: BodyIndex


def add_arms(plant: MultibodyPlant, bases: Mapping[Side, np.ndarray]) -> dict[Side, PlantArm]:
    """Adds a Panda for each side, with joint drives that follow desired positions and velocities.

    Gravity is off for a Panda, because its maker's control compensates its weight. Its torques are
    limited. The plant's discrete solver treats the drives implicitly, so they can be stiff at the
    plant's time step.

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
        _add_stand(plant, side, RigidTransform(bases[side]))
        plant.set_gravity_enabled(model, False)
        for i in range(len(LIMITS.torque)):
            joint = plant.GetJointByName(f"panda_joint{i + 1}", model)
            joint.set_acceleration_limits([-LIMITS.acceleration[i]], [LIMITS.acceleration[i]])
            actuator = plant.AddJointActuator(f"{side}_panda_joint{i + 1}", joint, LIMITS.torque[i])
            actuator.set_controller_gains(PdControllerGains(p=_STIFFNESS[i], d=_DAMPING[i]))
        tool = plant.GetBodyByName("panda_hand_tcp", model).index()
        arms[side] = PlantArm(model, panda(bases[side]), tool)
    return arms
