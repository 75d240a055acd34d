"""Checks whether an arm's joint reports are plausible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arrays import FloatArray
from drake_dress.models.supervision.fault import SOUND, Fault, Finding

# Tolerance of measurements: rad beyond a position limit, and multiple of a speed limit.
_ROOM, _SHARE = 0.005, 1.05


@dataclass(frozen=True)
class JointReport:
    """Joint measurements that an arm reports: (J,) each.

    Attributes:
        position: rad. velocity: rad/s. torque: external torque, N·m.
        stamp: time stamp of the report, s.
    """

    position: npt.ArrayLike
    velocity: npt.ArrayLike
    torque: npt.ArrayLike
    stamp: float = 0.0


@dataclass(frozen=True)
class JointBounds:
    """Bounds of plausible reports.

    Attributes:
        limits: limits of the joints, (J,).
        leap: largest motion between reports beyond what a joint's speed limit allows, rad.
        torque_share: largest external torque on a joint, as a multiple of its torque limit.
    """

    limits: JointLimits
    leap: float = 0.05
    torque_share: float = 2.0


def judge_joints(report: JointReport, before: JointReport | None, bounds: JointBounds) -> Finding:
    """Returns what is wrong with a report.

    Args:
        report: the new report.
        before: the last sound report; None if there was none.
        bounds: bounds of plausible reports.
    """
    limits = bounds.limits
    q, v, t = (
        np.asarray(x, dtype=float) for x in (report.position, report.velocity, report.torque)
    )
    if not q.shape == v.shape == t.shape == limits.lower.shape:
        return Finding(Fault.WRONG_SIZE, f"expected {len(limits.lower)} joints")
    if not (np.isfinite(q).all() and np.isfinite(v).all() and np.isfinite(t).all()):
        return Finding(Fault.NOT_FINITE)
    fault, reasons = Fault.NONE, []
    beyond = np.maximum(limits.lower - q, q - limits.upper)
    if np.any(beyond > _ROOM):
        k = int(np.argmax(beyond))
        fault |= Fault.JOINT_LIMIT
        reasons.append(
            f"joint {k + 1} at {q[k]:.3g} rad, expected {limits.lower[k]:g} to {limits.upper[k]:g}"
        )
    share = np.abs(v) / limits.speed
    if np.any(share > _SHARE):
        k = int(np.argmax(share))
        fault |= Fault.SPEED_LIMIT
        reasons.append(f"joint {k + 1} at {v[k]:.3g} rad/s, expected ±{limits.speed[k]:g} at most")
    if fault:
        return Finding(fault, "; ".join(reasons))
    load = np.abs(t) / limits.torque
    if np.any(load > bounds.torque_share):
        k = int(np.argmax(load))
        most = bounds.torque_share * limits.torque[k]
        return Finding(
            Fault.IMPOSSIBLE,
            f"external torque on joint {k + 1} {t[k]:.3g} N·m, expected ±{most:g} at most",
        )
    return SOUND if before is None else _leap(q, report.stamp, before, bounds)


def _leap(q: FloatArray, stamp: float, before: JointReport, bounds: JointBounds) -> Finding:
    time = max(stamp - before.stamp, 0.0)
    moved = np.abs(q - np.asarray(before.position))
    allowed = bounds.leap + _SHARE * bounds.limits.speed * time
    k = int(np.argmax(moved - allowed))
    if moved[k] <= allowed[k]:
        return SOUND
    return Finding(
        Fault.SPEED_LIMIT,
        f"joint {k + 1} moved {moved[k]:.3g} rad in {time:.3f} s, expected {allowed[k]:.2g} rad "
        "at most",
    )
