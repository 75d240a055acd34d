"""A person whose arms follow the garment."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.human.arm import Arms
from drake_dress.models.human.following import FollowingParameters, following_rate


class PassivePerson(LeafSystem):
    """Holds both arms where the garment has moved them; see `models/human/following.py`.

    .. pydrake_system::

        name: PassivePerson
        input_ports:
        - person_state
        output_ports:
        - set_point

    person_state: (2k,) angles, rad, then rates, rad/s, of the person's k joints. set_point: (8,)
    abduction, extension, rotation, elbow of the left, then the right arm, rad; it depends on state
    only.

    Args:
        arms: Kinematics, joints and rest pose; the set-point starts at the rest pose. That of an
            arm without tone stays there.
        joint_count: k.
        arm_dofs: (8,) indices of the arms' joints among the k joints.
        parameters: How the arms follow the garment.
        period: Period of the discrete update, s.
    """

    def __init__(
        self,
        arms: Arms,
        joint_count: int,
        arm_dofs: np.ndarray,
        parameters: FollowingParameters,
        period: float,
    ) -> None:
        super().__init__()
        self._arms = arms
        self._dofs = np.asarray(arm_dofs)
        self._parameters = parameters
        self._period = period
        self._state = self.DeclareDiscreteState(arms.rest.ravel())
        self.DeclareVectorInputPort("person_state", 2 * joint_count)
        self.DeclareVectorOutputPort(
            "set_point", 8, self._calc, {self.discrete_state_ticket(self._state)}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        angles = self.get_input_port(0).Eval(context)[self._dofs].reshape(2, 4)
        set_point = context.get_discrete_state(self._state).value().reshape(2, 4).copy()
        a = self._arms
        for i, arm in enumerate(a.arms):
            if not a.has_tone[i]:
                continue
            rate = following_rate(
                set_point[i],
                angles[i],
                a.rest[i],
                a.stiffness[i],
                arm.gravity_stiffness(set_point[i]),
                self._parameters,
            )
            set_point[i] = np.clip(set_point[i] + self._period * rate, *a.limits[i])
        discrete.set_value(self._state, set_point.ravel())

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._state).value())
