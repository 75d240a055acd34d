"""A person who moves on their own: reaches, withdraws, waves and turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.dressing.sleeve import loop_orientation
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.active import ActiveArm, ActiveParameters, ArmState
from drake_dress.models.human.arm import Arms
from drake_dress.models.human.armhole import find_armhole
from drake_dress.models.human.motions import Motion, Turn, stance
from drake_dress.models.sides import SIDES


class ActivePerson(LeafSystem):
    """Generates voluntary motion of both arms and the torso; see `models/human/active.py`.

    .. pydrake_system::

        name: ActivePerson
        input_ports:
        - person_state
        - garment_position
        output_ports:
        - set_point
        - set_point_rate
        - stance
        - intent

    person_state: (2k,) angles, rad, then rates, rad/s, of the person's k joints. garment_position:
    (3n,) of the true garment, m, world; the person knows where the armholes are. set_point,
    set_point_rate: (8,) abduction, extension, rotation, elbow of the left, then the right arm, rad,
    rad/s; they depend on state only. stance: (2,) yaw of the torso, rad, and its rate; it depends
    on time only. intent: (2,) 1 if the left, the right arm moves by the person's own will, 0 if it
    rests or follows the garment; it depends on state and time.

    Args:
        arms: Kinematics, joints and rest pose; the set-point starts at the rest pose.
        joint_count: k.
        arm_dofs: (8,) indices of the arms' joints among the k joints.
        yaw_dof: Index of the joint that turns the torso; None if the torso does not turn.
        origin: (3,) origin of the torso's frame, m, world.
        mesh: The true garment.
        motions: Motions that the person makes.
        parameters: Limits of the motions.
        period: Period of the discrete update, s.
    """

    def __init__(
        self,
        arms: Arms,
        joint_count: int,
        arm_dofs: np.ndarray,
        yaw_dof: int | None,
        origin: np.ndarray,
        mesh: GarmentMesh,
        motions: Sequence[Motion],
        parameters: ActiveParameters,
        period: float,
    ) -> None:
        super().__init__()
        self._dofs, self._yaw_dof, self._origin = np.asarray(arm_dofs), yaw_dof, origin
        self._loops = [np.asarray(mesh.loops[f"{side}_armhole"]) for side in SIDES]
        self._signs = [float(loop_orientation(mesh, side)) for side in SIDES]
        self._turns = tuple(m for m in motions if isinstance(m, Turn))
        self._has_tone = arms.has_tone
        self._period = period
        self._arms = [
            ActiveArm(arm, arms.rest[i], arms.limits[i], arms.stiffness[i], motions, parameters)
            for i, arm in enumerate(arms.arms)
        ]
        self._states = [self.DeclareDiscreteState(arm.initial_state().flat()) for arm in self._arms]
        self.DeclareVectorInputPort("person_state", 2 * joint_count)
        self.DeclareVectorInputPort("garment_position", 3 * len(mesh.rest_position))
        for name, rows in (("set_point", slice(0, 4)), ("set_point_rate", slice(4, 8))):
            self.DeclareVectorOutputPort(name, 8, self._show(rows), {self.xd_ticket()})
        self.DeclareVectorOutputPort("stance", 2, self._calc_stance, {self.time_ticket()})
        self.DeclareVectorOutputPort(
            "intent", 2, self._calc_intent, {self.xd_ticket(), self.time_ticket()}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        joints = self.get_input_port(0).Eval(context)
        x = self.get_input_port(1).Eval(context).reshape(-1, 3)
        yaw = 0.0 if self._yaw_dof is None else float(joints[self._yaw_dof])
        angles = joints[self._dofs].reshape(2, 4)
        for i, index in enumerate(self._states):
            if not self._has_tone[i]:
                continue
            active = self._arms[i]
            armhole = find_armhole(
                x[self._loops[i]], self._signs[i], active.arm, angles[i], yaw, self._origin
            )
            state = ArmState.of(context.get_discrete_state(index).value())
            after = active.step(state, angles[i], armhole, context.get_time(), self._period)
            discrete.set_value(index, after.flat())

    def _show(self, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            states = [context.get_discrete_state(index).value()[rows] for index in self._states]
            output.SetFromVector(np.concatenate(states))

        return calc

    def _calc_stance(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(stance(self._turns, context.get_time()))

    def _calc_intent(self, context: Context, output: BasicVector) -> None:
        for i, index in enumerate(self._states):
            state = ArmState.of(context.get_discrete_state(index).value())
            wants = self._arms[i].has_intent(state, context.get_time())
            output[i] = float(wants and self._has_tone[i])
