"""A person who follows the garment: the arms' set-points drift to where they are drawn.

Model: springs K hold an arm at a set-point s, and muscle tone carries its weight there
(equilibrium-point control: Feldman 1986, "Once more on the equilibrium-point hypothesis"). When the
arm is led to angles q, its muscles feel the torque

    e = (K + ∂²U(s)) (q − s)

of the springs and, to first order, of the part of the weight at q that tone does not carry. A
person who cooperates with least effort yields to it. The set-point moves like a dashpot T·K behind
a friction element θ (compliant following, like an admittance with a dead zone),

    ds/dt = sign(e) max(|e| − θ, 0) / (T K)           for each joint separately,

and tone adapts to the new s, so that it still carries the weight. An arm that is led with less than
θ springs back. While nothing leads it (|e| < θ), the arm slowly returns to the comfortable pose c,
if there is one: ds/dt += (1 − |e|/θ) (c − s)/T_c.

The set-point never does net work on the leader. With the energy W(q,s) = ½(q−s)ᵀK(q−s) + U(q) −
U(s) − ∂U(s)·(q−s) stored in springs and weight, the leader's work is dW + e·ds, and e·ds ≥ 0 for
each joint that is led. A joint that returns gives back at most θ|ds|, and leading it away took at
least θ|ds|. So the leader never gains energy over a closed cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Least stiffness, since a joint without a spring would follow infinitely fast, N·m/rad.
_LEAST_STIFFNESS = 0.1


@dataclass(frozen=True)
class FollowingParameters:
    """Parameters of a person who follows the garment.

    Attributes:
        time_constant: T, time constant with which the set-point follows a displaced joint, s.
        threshold: θ, torque up to which a joint keeps its set-point, N·m.
        return_time_constant: T_c, time constant of the return to the comfortable pose, s. With None
            the arm stays where it was led.
        max_speed: largest speed of a set-point, rad/s.

    Raises:
        UserError: a value is out of range.
    """

    time_constant: float = 1.0
    threshold: float = 0.3
    return_time_constant: float | None = None
    max_speed: float = 1.0

    def __post_init__(self) -> None:
        for name in ("time_constant", "max_speed", "return_time_constant"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0.0):
                raise UserError("person.following", name, f"is {value}, expected more than 0")
        if not (np.isfinite(self.threshold) and self.threshold >= 0.0):
            raise UserError(
                "person.following", "threshold", f"is {self.threshold} N·m, expected 0 or more"
            )


def following_rate(
    set_point: FloatArray,
    angles: FloatArray,
    comfort: FloatArray,
    stiffness: FloatArray,
    gravity_stiffness: FloatArray,
    p: FollowingParameters,
) -> FloatArray:
    """Returns ds/dt (k,), rad/s, of one arm, scaled so that the fastest joint keeps `max_speed`.

    Args:
        set_point: s (k,), rad.
        angles: q (k,) of the arm, rad.
        comfort: c (k,), comfortable pose, rad.
        stiffness: the diagonal of K (k,), N·m/rad.
        gravity_stiffness: ∂²U(s) (k,k), N·m/rad.
        p: parameters.
    """
    led = angles - set_point
    felt = stiffness * led + gravity_stiffness @ led
    beyond = np.sign(felt) * np.maximum(np.abs(felt) - p.threshold, 0.0)
    rate = beyond / (p.time_constant * np.maximum(stiffness, _LEAST_STIFFNESS))
    if p.return_time_constant is not None and p.threshold > 0.0:
        free = np.maximum(1.0 - np.abs(felt) / p.threshold, 0.0)
        rate = rate + free * (comfort - set_point) / p.return_time_constant
    fastest = float(np.max(np.abs(rate)))
    slowed: FloatArray = rate * min(1.0, p.max_speed / fastest) if fastest > 0.0 else rate
    return slowed
