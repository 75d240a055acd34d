"""The safety layer between the controller and both arms."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.person_model import PersonModel, person_capsules
from drake_dress.models.control.safety import (
    GovernorState,
    Measurement,
    Request,
    SafetyLimits,
    Skin,
    step,
)
from drake_dress.models.sides import SIDES


class SafetyGovernor(LeafSystem):
    """Converts velocity requests into position commands that always obey the limits.

    .. pydrake_system::

        name: SafetyGovernor
        input_ports:
        - left_velocity_request
        - right_velocity_request
        - request_time
        - left_gripper_position
        - right_gripper_position
        - left_gripper_force
        - right_gripper_force
        - permission
        - joint_position
        output_ports:
        - left_position_command
        - right_position_command
        - left_velocity_command
        - right_velocity_command
        - verdict

    Requests (3,) m/s in W; request_time (1,) time of both requests, s, on the diagram's clock.
    Positions (3,) p_WG, m; forces (3,) of the garment on the gripper, N. verdict (2,): flags of
    `models.control.safety.Verdict` for left and right, as a number. joint_position (18,): shoulder,
    elbow, hand of left, then right arm in W, m; optional. Outputs depend on state only, without
    feedthrough. Any input may be NaN or infinite.

    The control law is in `models/control/safety.py`. The governor integrates its own commands and
    takes no position from a controller.

    Args:
        start: (2,3) p_WG of left and right at time 0, m.
        period: Period of the commands, s.
        limits: Limits to enforce.
        person: Shape of the person; with None, grippers may touch them.
        held: For left and right, (k,3) positions of the held cloth relative to the gripper, m.

    Raises:
        ValueError: The start is outside the position limits.
    """

    def __init__(
        self,
        start: np.ndarray,
        period: float,
        limits: SafetyLimits,
        person: PersonModel | None = None,
        held: Sequence[np.ndarray] = (),
    ) -> None:
        super().__init__()
        start = np.asarray(start, dtype=float).reshape(2, 3)
        broken = limits.broken_at(start)
        if broken is not None:
            raise ValueError(broken)
        self._period = period
        self._limits = limits
        self._person = person
        # offsets of each gripper and of its held cloth, which may come `nearer` to the person
        offsets = [np.vstack([np.zeros((1, 3)), *held[i : i + 1]]) for i in range(len(SIDES))]
        self._offset = np.vstack(offsets)
        self._side = np.repeat([0, 1], [len(k) for k in offsets])
        nearer = limits.person_distance - limits.held_distance
        self._nearer = np.concatenate([np.where(np.arange(len(k)), nearer, 0.0) for k in offsets])
        self._memory = self.DeclareDiscreteState(GovernorState(start).packed())
        self._verdict = self.DeclareDiscreteState(np.zeros(2))
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_velocity_request", 3)
        self.DeclareVectorInputPort("request_time", 1)
        for name in ("position", "force"):
            for side in SIDES:
                self.DeclareVectorInputPort(f"{side}_gripper_{name}", 3)
        self.DeclareVectorInputPort("permission", 1)
        self.DeclareVectorInputPort("joint_position", 18)
        ticket = {self.discrete_state_ticket(self._memory)}
        for offset, name in ((0, "position"), (6, "velocity")):
            for i, side in enumerate(SIDES):
                rows = slice(offset + 3 * i, offset + 3 * i + 3)
                self.DeclareVectorOutputPort(f"{side}_{name}_command", 3, self._show(rows), ticket)
        self.DeclareVectorOutputPort(
            "verdict", 2, self._calc_verdict, {self.discrete_state_ticket(self._verdict)}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        # compile now: the first limited request must not wait half a second for it
        too_fast = Request(np.full((2, 3), limits.max_speed), 0.0)
        step(GovernorState(start), too_fast, Measurement(start, 0.0 * start), limits, 0.0, period)
        if person is not None:
            self._beside(person, np.zeros((6, 3)), start)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        def of_both(name: str) -> np.ndarray:
            return np.stack([self.GetInputPort(f"{side}_{name}").Eval(context) for side in SIDES])

        memory = GovernorState.unpacked(context.get_discrete_state(self._memory).value())
        state, verdicts = step(
            memory,
            Request(
                of_both("velocity_request"),
                float(self.GetInputPort("request_time").Eval(context)[0]),
            ),
            Measurement(of_both("gripper_position"), of_both("gripper_force")),
            self._limits,
            context.get_time(),
            self._period,
            bool(self.GetInputPort("permission").Eval(context)[0] > 0.5),
            self._skin(context, memory.position),
        )
        discrete.set_value(self._memory, state.packed())
        discrete.set_value(self._verdict, [float(v) for v in verdicts])

    def _skin(self, context: Context, position: np.ndarray) -> Skin | None:
        """Returns the person's surface near `position` (2,3), m; None if the person is not seen."""
        joints = self.GetInputPort("joint_position")
        if self._person is None or not joints.HasValue(context):
            return None
        seen = joints.Eval(context).reshape(6, 3)
        if not np.isfinite(seen).all():
            return None
        return self._beside(self._person, seen, position)

    def _beside(self, person: PersonModel, joints: np.ndarray, position: np.ndarray) -> Skin:
        """Returns the surface of a person with joints (6,3) near `position` (2,3), m.

        Of each gripper and its held cloth, the point with the least clearance counts.
        """
        bodies = Obstacles.resting(*person_capsules(person, joints))
        near = find_proximity(position[self._side] + self._offset, bodies, 0.0)
        room = near.gap + self._nearer
        tightest = [
            rows[np.argmin(room[rows])]
            for rows in (np.flatnonzero(self._side == i) for i in (0, 1))
        ]
        return Skin(room[tightest], near.normal[tightest])

    def _show(self, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state(self._memory).value()[rows])

        return calc

    def _calc_verdict(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._verdict).value())
