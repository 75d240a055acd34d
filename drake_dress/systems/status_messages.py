"""Checks the plausibility of an arm driver's `lcmt_panda_status` messages."""

from __future__ import annotations

from typing import Any

import numpy as np
from drake import lcmt_panda_status

from drake_dress.models.arm.status_check import JointBounds, JointReport, judge_joints
from drake_dress.models.supervision.fault import TELLING, Fault, Finding
from drake_dress.systems.lcm_inbox import stamp

_MODE_NAMES = {
    getattr(lcmt_panda_status, name): name
    for name in vars(lcmt_panda_status)
    if name.startswith("k") and isinstance(getattr(lcmt_panda_status, name), int)
}
# Arrays that the check of joints does not cover but that ports output, too.
_OTHER_ARRAYS = (
    "joint_position_desired",
    "joint_velocity_desired",
    "joint_acceleration_desired",
    "joint_torque",
    "joint_torque_desired",
)


class StatusCheck:
    """Checks an arm's status messages in order of arrival.

    Args:
        bounds: Bounds on plausible statuses.
    """

    def __init__(self, bounds: JointBounds) -> None:
        self._bounds = bounds
        self._before: JointReport | None = None

    def __call__(self, message: Any) -> Finding:
        """Returns what is wrong with a `lcmt_panda_status`."""
        count = len(self._bounds.limits.lower)
        if message.num_joints != count:
            return Finding(
                Fault.WRONG_SIZE, f"num_joints is {message.num_joints}, expected {count}"
            )
        report = JointReport(
            np.array(message.joint_position),
            np.array(message.joint_velocity),
            np.array(message.joint_torque_external),
            stamp(message),
        )
        found = judge_joints(report, self._before, self._bounds)
        if not found.fault:
            found = _others_found(message)
        mode = mode_finding(message.robot_mode)
        found = Finding(found.fault | mode.fault, found.reason or mode.reason)
        if not found.fault & ~TELLING:
            self._before = report
        return found


def mode_finding(mode: int) -> Finding:
    """Returns whether an arm follows commands in a mode of `lcmt_panda_status`.

    It follows commands in kMove only. In kIdle it accepts commands that start at its position. In
    all other modes, known or unknown, it does not follow.
    """
    if mode == lcmt_panda_status.kMove:
        return Finding()
    if mode == lcmt_panda_status.kIdle:
        return Finding(Fault.IDLE)
    name = _MODE_NAMES.get(mode, "unknown")
    return Finding(
        Fault.STOPPED, f"robot_mode is {mode} ({name}), expected {lcmt_panda_status.kMove} (kMove)"
    )


def _others_found(message: Any) -> Finding:
    for name in _OTHER_ARRAYS:
        if not np.isfinite(getattr(message, name)).all():
            return Finding(Fault.NOT_FINITE, f"{name} is not finite")
    return Finding()
