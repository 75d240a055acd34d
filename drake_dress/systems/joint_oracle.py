"""A perfect estimator of the person's arm pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.effects.composition import seen_points
from drake_dress.models.effects.effect import Effect
from drake_dress.systems.body_frames import world_points


class JointOracle(LeafSystem):
    """Outputs shoulder, elbow and hand of both arms of the true person.

    .. pydrake_system::

        name: JointOracle
        input_ports:
        - body_poses
        output_ports:
        - joint_position

    joint_position: (18,) row-major (6,3): shoulder, elbow, hand of left, then of right, m, world.

    Args:
        points: Body index and point in the body's frame (3,), m, for each of the six joints.
        effects: Physical effects; those of cameras displace the observed joints.
    """

    def __init__(
        self, points: list[tuple[int, np.ndarray]], effects: Sequence[Effect] = ()
    ) -> None:
        super().__init__()
        self._effects = tuple(effects)
        self._bodies = [body for body, _ in points]
        self._points = np.array([p for _, p in points])
        self.DeclareAbstractInputPort("body_poses", Value[list[RigidTransform]]())
        self.DeclareVectorOutputPort("joint_position", 18, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        poses = self.get_input_port(0).Eval(context)
        joints = world_points(poses, self._bodies, self._points)
        output.SetFromVector(seen_points(joints, self._effects).ravel())
