"""Joint commands of two arms from Cartesian gripper commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.arm.clearance import Capsules
from drake_dress.models.arm.resolved_rate import ArmPair, GripperGoal
from drake_dress.models.control.person_model import PersonModel, person_capsules
from drake_dress.models.sides import SIDES

# Joint deviation above which a stopped arm's command is reset to its measured position, rad.
_ELSEWHERE = 0.02


class ArmController(LeafSystem):
    """Converts gripper position commands into joint commands within the arms' limits.

    .. pydrake_system::

        name: ArmController
        input_ports:
        - left_position_command
        - right_position_command
        - left_velocity_command
        - right_velocity_command
        - joint_position
        - left_arm_position
        - right_arm_position
        - left_arm_stopped
        - right_arm_stopped
        output_ports:
        - left_arm_position_command
        - right_arm_position_command
        - left_arm_velocity_command
        - right_arm_velocity_command
        - clearance
        - speed_share

    Commands (3,) p_WG and v_WG, m, m/s. joint_position: (18,) estimated joints of the person's
    arms, m. *_arm_position: (7,) measured joint angles, rad. *_arm_stopped: (1,) positive while an
    arm's driver reports that it does not follow commands. Arm commands (7,) rad, rad/s.
    clearance: (3,) least distance between the two arms, from the left arm to the person and from
    the right arm to the person, m. speed_share: (2,) achieved share of each gripper's requested
    speed. Outputs depend on state only, without feedthrough. Non-finite commands are not followed:
    the arms come to rest.

    The controller integrates its own commands, starting at `start`. If an arm's driver has stopped,
    the command is reset to the arm's measured position, so that motion resumes from there.

    Args:
        arms: The two arms, with their limits and settings.
        start: (2,7) joints at time 0, left, then right, rad.
        period: Period of the commands, s.
        person: Shape of the person to keep away from.
        offset: Time of the first command, s: slightly after the gripper commands have changed.
    """

    def __init__(
        self,
        arms: ArmPair,
        start: np.ndarray,
        period: float,
        person: PersonModel,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        self._arms = arms
        self._period = period
        self._person = person
        self._rotation = [arm.links(start[i])[-1, :3, :3] for i, arm in enumerate(arms.arms)]
        self._joints = self.DeclareDiscreteState(np.concatenate([start.ravel(), np.zeros(14)]))
        self._shown = self.DeclareDiscreteState(np.concatenate([np.full(3, np.inf), np.ones(2)]))
        for name in ("position", "velocity"):
            for side in SIDES:
                self.DeclareVectorInputPort(f"{side}_{name}_command", 3)
        self.DeclareVectorInputPort("joint_position", 18)
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_arm_position", 7)
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_arm_stopped", 1)
        ticket = {self.discrete_state_ticket(self._joints)}
        for first, name in ((0, "position"), (14, "velocity")):
            for i, side in enumerate(SIDES):
                rows = slice(first + 7 * i, first + 7 * i + 7)
                self.DeclareVectorOutputPort(
                    f"{side}_arm_{name}_command", 7, self._show(self._joints, rows), ticket
                )
        ticket = {self.discrete_state_ticket(self._shown)}
        for name, rows in (("clearance", slice(0, 3)), ("speed_share", slice(3, 5))):
            self.DeclareVectorOutputPort(
                name, rows.stop - rows.start, self._show(self._shown, rows), ticket
            )
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)
        # compile now: the first cycle must not wait seconds for it
        left, right = (
            GripperGoal(arm.tool_position(q), np.zeros(3), r)
            for arm, q, r in zip(arms.arms, start, self._rotation, strict=True)
        )
        nobody = Capsules(*person_capsules(person, np.zeros((6, 3))))
        arms.rates(start, np.zeros((2, 7)), (left, right), period, nobody)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        state = context.get_discrete_state(self._joints).value()
        q, rate = state[:14].reshape(2, 7), state[14:].reshape(2, 7)
        q, rate = self._taken_over(context, q, rate)
        seen = self.GetInputPort("joint_position").Eval(context).reshape(6, 3)
        person = None
        if np.isfinite(seen).all():
            person = Capsules(*person_capsules(self._person, seen))
        left, right = (self._goal(context, i, side, q[i]) for i, side in enumerate(SIDES))
        found = self._arms.rates(q, rate, (left, right), self._period, person)
        new = q + self._period * found.rate
        discrete.set_value(self._joints, np.concatenate([new.ravel(), found.rate.ravel()]))
        discrete.set_value(
            self._shown, np.concatenate([[found.between_arms], found.to_person, found.share])
        )

    def _taken_over(
        self, context: Context, q: np.ndarray, rate: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns commands (2,7) and rates; a stopped arm gets its measured position at rest."""
        q, rate = q.copy(), rate.copy()
        for i, side in enumerate(SIDES):
            if not self.GetInputPort(f"{side}_arm_stopped").Eval(context)[0] > 0.0:
                continue
            measured = self.GetInputPort(f"{side}_arm_position").Eval(context)
            if np.abs(measured - q[i]).max() > _ELSEWHERE:
                limits = self._arms.arms[i].limits
                q[i], rate[i] = np.clip(measured, limits.lower, limits.upper), 0.0
        return q, rate

    def _goal(self, context: Context, i: int, side: str, q: np.ndarray) -> GripperGoal:
        position = self.GetInputPort(f"{side}_position_command").Eval(context)
        velocity = self.GetInputPort(f"{side}_velocity_command").Eval(context)
        if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
            return GripperGoal(self._arms.arms[i].tool_position(q), np.zeros(3), self._rotation[i])
        return GripperGoal(position, velocity, self._rotation[i])

    def _show(self, state: Any, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state(state).value()[rows])

        return calc
