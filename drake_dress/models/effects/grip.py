"""Effects on the grippers: latency, compliance and slip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import ClockEffect, MountEffect, norms, parameter


@dataclass(frozen=True)
class GripperLatency(ClockEffect):
    """Grippers lag their reports: at time t they are at the position reported for t − delay.

    Args:
        delay: delay of the grippers behind their report, s.
    """

    NAME = "gripper_latency"
    delay: float = parameter("s", -0.1, 0.5, 0.04)

    def apply(self, time: FloatArray) -> FloatArray:
        """Returns the times, s, whose reported positions are the true ones at `time`."""
        return time - self.delay

    def derivative(self, name: str, time: FloatArray) -> FloatArray:
        """Returns −1 for each time."""
        return np.full_like(time, -1.0)


@dataclass(frozen=True)
class GripperCompliance(MountEffect):
    """A gripper yields by c times the force on it, on a critically damped mount; see `mounts`.

    Args:
        compliance: c, displacement of a gripper per force, m/N.
    """

    NAME = "gripper_compliance"
    compliance: float = parameter("m/N", 0.0, 0.1, 0.006)

    def apply(self, force: FloatArray) -> FloatArray:
        """Returns the gripper's rest deflection (…,3), m, under forces (…,3), N."""
        return self.compliance * force

    def derivative(self, name: str, force: FloatArray) -> FloatArray:
        """Returns (…,3)."""
        return force


@dataclass(frozen=True)
class GripperSlip(MountEffect):
    """Cloth creeps out of a gripper: it slides along the pull at speed max(0, c (‖f‖ − f₀)).

    Args:
        rate: c, sliding speed per force beyond the threshold, m/(N·s).
        threshold: f₀, force below which the cloth does not slide, N.
    """

    NAME = "gripper_slip"
    rate: float = parameter("m/(N·s)", 0.0, 0.1, 0.004)
    threshold: float = parameter("N", 0.0, 50.0, 0.5, shape=0.0)

    def apply(self, force: FloatArray) -> FloatArray:
        """Returns the sliding velocity (…,3), m/s, under forces (…,3), N."""
        return self.rate * self.derivative("rate", force)

    def derivative(self, name: str, force: FloatArray) -> FloatArray:
        """Returns (…,3)."""
        size = norms(force)[..., None]
        unit = force / np.maximum(size, 1e-12)
        if name == "rate":
            return np.maximum(size - self.threshold, 0.0) * unit
        return np.where(size > self.threshold, -self.rate * unit, 0.0)
