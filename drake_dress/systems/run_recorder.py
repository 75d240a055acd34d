"""Writes the run log while the diagram runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem

from drake_dress.models.control.person_model import PersonModel, person_capsules
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.linking import arm_linking_number, torso_interior
from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import Capsule
from drake_dress.models.human.learned.forecast import Forecast
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.arm_extremes import ArmExtremes
from drake_dress.report.log_schema import FORECAST_AHEAD
from drake_dress.report.log_writer import ArmSample, ForecastSample, RunLogWriter, Sample
from drake_dress.systems.body_frames import world_points

# Ports of an arm, in the order of `ArmSample`.
_OF_ARM = ("position", "velocity", "command", "torque")


class RunRecorder(LeafSystem):
    """Appends a sample to the log at a fixed rate.

    .. pydrake_system::

        name: RunRecorder
        input_ports:
        - garment_position
        - contact
        - contact_force
        - body_poses
        - intent
        - joint_position
        - left_gripper_position
        - left_gripper_force
        - right_gripper_position
        - right_gripper_force
        - stage
        - solve_time
        - estimated_position
        - estimated_joint_position
        - verdict
        - local_solve_time
        - left_arm_position
        - left_arm_velocity
        - left_arm_command
        - left_arm_torque
        - right_arm_position
        - right_arm_velocity
        - right_arm_command
        - right_arm_torque
        - clearance
        - forecast
        - active

    Sizes and units are those of the ports of station and controllers. A sample combines the flags
    of all verdicts (2,) since the previous sample. local_solve_time exists only with a local
    controller; a sample holds its last solve time. The arm ports and clearance exist only with
    arms. A sample holds the least clearance since the previous sample, and the extremes of joint
    positions, speeds and torques, observed every `arm_period`. contact, contact_force, body_poses
    and intent exist only if the truth is known; stage, solve_time, verdict and clearance only with
    controllers; forecast, a `Forecast`, only with `has_forecast`. If active (1,) is connected,
    samples are taken only while it is positive, and time counts from the first sample.

    Args:
        writer: The open log.
        mesh: The plant's garment.
        estimate_count: Number of nodes of the controller's garment.
        capsules: Capsules of the person, each with the index of its body; or, if the truth is not
            known, the controllers' model of the person.
        period: Time between samples, s.
        verdict_period: Time between verdicts, s.
        has_local: Whether there is a local controller.
        arm_period: Time between observations of the arms, s; None without arms.
        has_control: Whether there are controllers.
        has_forecast: Whether their predictor forecasts the person.
    """

    def __init__(
        self,
        writer: RunLogWriter,
        mesh: GarmentMesh,
        estimate_count: int,
        capsules: Sequence[tuple[int, Capsule]] | PersonModel,
        period: float,
        verdict_period: float,
        has_local: bool = False,
        arm_period: float | None = None,
        has_control: bool = True,
        has_forecast: bool = False,
    ) -> None:
        super().__init__()
        self._writer = writer
        self._mesh = mesh
        self._model = capsules if isinstance(capsules, PersonModel) else None
        shapes = [] if isinstance(capsules, PersonModel) else list(capsules)
        self._bodies = [body for body, _ in shapes]
        self._capsule_ends = [np.array([getattr(c, e) for _, c in shapes]) for e in ("a_B", "b_B")]
        self._has_control, self._has_forecast = has_control, has_forecast
        self._begun: float | None = None
        self._heard = False
        self._signs = [loop_orientation(mesh, side) for side in SIDES]
        self._solves = {"solve_time": 0.0, "local_solve_time": 0.0}
        self._has_local = has_local
        self._has_arms = arm_period is not None
        self._extremes = {side: ArmExtremes() for side in SIDES}
        self._clearance = np.full(3, np.inf)
        self._verdict = np.zeros(2, dtype=int)
        self._declare_inputs(len(mesh.rest_position), estimate_count)
        if has_control:
            self.DeclarePeriodicPublishEvent(verdict_period, 0.0, self._collect)
        if arm_period is not None:
            self.DeclarePeriodicPublishEvent(arm_period, 0.0, self._watch_arms)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._append)

    def _declare_inputs(self, n: int, estimate_count: int) -> None:
        self.DeclareVectorInputPort("garment_position", 3 * n)
        if self._model is None:
            self.DeclareVectorInputPort("contact", n)
            self.DeclareVectorInputPort("contact_force", 3 * n)
            self.DeclareAbstractInputPort("body_poses", Value[list[RigidTransform]]())
            self.DeclareVectorInputPort("intent", 2)
        self.DeclareVectorInputPort("joint_position", 18)
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_gripper_position", 3)
            self.DeclareVectorInputPort(f"{side}_gripper_force", 3)
        if self._has_control:
            self.DeclareVectorInputPort("stage", 2)
            self.DeclareVectorInputPort("solve_time", 2)
            self.DeclareVectorInputPort("verdict", 2)
        if self._has_local:
            self.DeclareVectorInputPort("local_solve_time", 2)
        self.DeclareVectorInputPort("estimated_position", 3 * estimate_count)
        self.DeclareVectorInputPort("estimated_joint_position", 18)
        if self._has_arms:
            for side in SIDES:
                for name in _OF_ARM:
                    self.DeclareVectorInputPort(f"{side}_arm_{name}", 7)
            if self._has_control:
                self.DeclareVectorInputPort("clearance", 3)
        if self._has_forecast:
            self.DeclareAbstractInputPort("forecast", Value[object](None))
        self.DeclareVectorInputPort("active", 1)

    def _collect(self, context: Context) -> None:
        self._verdict |= self.GetInputPort("verdict").Eval(context).astype(int)
        if self._has_arms:
            now = self.GetInputPort("clearance").Eval(context)
            self._clearance = np.minimum(self._clearance, now)

    def _watch_arms(self, context: Context) -> None:
        for side, extremes in self._extremes.items():
            extremes.see(
                *(
                    self.GetInputPort(f"{side}_arm_{name}").Eval(context)
                    for name in ("position", "velocity", "torque")
                )
            )

    def _append(self, context: Context) -> None:
        if not (self._is_active(context) and self._has_heard(context)):
            return
        if self._begun is None:
            has_signal = self.GetInputPort("active").HasValue(context)
            self._begun = context.get_time() if has_signal else 0.0
        self._writer.append(self._sample(context, context.get_time() - self._begun))

    def _is_active(self, context: Context) -> bool:
        """Returns whether to take samples: always, if `active` is not connected."""
        active = self.GetInputPort("active")
        return not active.HasValue(context) or bool(active.Eval(context)[0] > 0.0)

    def _has_heard(self, context: Context) -> bool:
        """Returns whether gripper positions are known: on hardware, after the first messages."""
        if self._model is None or self._heard:
            return True
        grippers = [self._value(context, f"{side}_gripper_position") for side in SIDES]
        self._heard = bool(np.isfinite(grippers).all())
        return self._heard

    def _sample(self, context: Context, time: float) -> Sample:
        """Returns the current sample and resets what was collected since the last one."""

        def value(name: str) -> np.ndarray:
            return self._value(context, name)

        x = value("garment_position").reshape(-1, 3)
        joints = value("joint_position").reshape(6, 3)
        dressing = self._dressing(x, joints)
        if self._has_control:
            self._collect(context)
        capsule_a, capsule_b = self._ends(context, joints)
        verdict, self._verdict = self._verdict, np.zeros(2, dtype=int)
        clearance, self._clearance = self._clearance, np.full(3, np.inf)
        spent, solves = self._ended(context, "solve_time")
        local_spent, local_solves = self._ended(context, "local_solve_time")
        has_truth = self._model is None
        return Sample(
            time=time,
            garment_position=x,
            contact=value("contact") if has_truth else None,
            contact_force=value("contact_force").reshape(-1, 3) if has_truth else None,
            joint_position=joints,
            gripper_position={side: value(f"{side}_gripper_position") for side in SIDES},
            gripper_force={side: value(f"{side}_gripper_force") for side in SIDES},
            dressing=dressing,
            stage=value("stage") if self._has_control else np.zeros(2),
            safety=verdict,
            global_solve_time=spent,
            local_solve_time=local_spent,
            global_solves=solves,
            local_solves=local_solves,
            estimate_garment_position=value("estimated_position").reshape(-1, 3),
            estimate_joint_position=value("estimated_joint_position").reshape(6, 3),
            capsule_a=capsule_a,
            capsule_b=capsule_b,
            arms=self._arms(context),
            clearance=clearance if self._has_control else None,
            intent=value("intent") if has_truth else None,
            forecast=self._forecast(context),
        )

    def _forecast(self, context: Context) -> ForecastSample | None:
        if not self._has_forecast:
            return None
        forecast: Forecast = self.GetInputPort("forecast").Eval(context)
        soon = np.array([context.get_time() + FORECAST_AHEAD])
        return ForecastSample(
            forecast.mean_at(soon)[0],
            forecast.radius_at(soon)[0],
            forecast.intent,
            int(forecast.is_linear),
        )

    def _value(self, context: Context, name: str) -> np.ndarray:
        return self.GetInputPort(name).Eval(context)

    def _dressing(
        self, x: np.ndarray, joints: np.ndarray
    ) -> dict[Side, tuple[float, float, float]]:
        """Returns (s, l, theta) of both sleeves, from the garment (n,3) and joints (6,3)."""
        interior = torso_interior(joints[0], joints[3])
        dressing = {}
        for i, side in enumerate(SIDES):
            shoulder, elbow, hand = joints[3 * i : 3 * i + 3]
            axis = ArmAxis(hand=hand, elbow=elbow, shoulder=shoulder)
            loop = self._mesh.loops[f"{side}_armhole"]
            s, l, theta = axis.coordinates(sleeve_state(x, loop, self._signs[i]).p_c)
            inside = arm_linking_number(x[loop], shoulder, elbow, hand, interior)
            # a sleeve that does not enclose its arm has no progress, wherever its centre is
            dressing[side] = (s if inside else 0.0, l, theta)
        return dressing

    def _arms(self, context: Context) -> dict[Side, ArmSample] | None:
        if not self._has_arms:
            return None
        self._watch_arms(context)
        return {side: self._arm(context, side) for side in SIDES}

    def _arm(self, context: Context, side: Side) -> ArmSample:
        q, v, command, torque = (
            self.GetInputPort(f"{side}_arm_{name}").Eval(context) for name in _OF_ARM
        )
        least, most, fastest, strongest = self._extremes[side].taken()
        return ArmSample(q, v, command, torque, least, most, fastest, strongest)

    def _ends(self, context: Context, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self._model is not None:
            a, b, _ = person_capsules(self._model, joints)
            return a, b
        poses = self.GetInputPort("body_poses").Eval(context)
        a, b = (world_points(poses, self._bodies, ends) for ends in self._capsule_ends)
        return a, b

    def _ended(self, context: Context, name: str) -> tuple[float, int]:
        """Returns the last solve time, s, and the number of solves since the last sample.

        The time is NaN if there were none.
        """
        if not self._has_control or (name == "local_solve_time" and not self._has_local):
            return np.nan, 0
        spent, count = self.GetInputPort(name).Eval(context)
        ended = round(count - self._solves[name])
        self._solves[name] = float(count)
        return (float(spent) if ended > 0 else np.nan), max(ended, 0)
