"""A person who lets the garment lead: where the arms are held drifts to where they are drawn.

Model: an arm is held at a set-point s by springs K about it and by tone that carries its weight
there (equilibrium-point control: Feldman 1986, "Once more on the equilibrium-point hypothesis").
Led to angles q, its muscles feel the torque

    e = (K + ∂²U(s)) (q − s),

their springs' and, to first order, what tone does not carry of the weight at q. Who cooperates with
least effort gives way to it: the set-point yields as a dashpot T·K behind a friction element θ does
(compliant following, as by an admittance with a dead zone),

    ds/dt = sign(e) max(|e| − θ, 0) / (T K)           each joint by itself,

and tone is that of the new s, so that the weight stays carried. What is led by less than θ comes
back. Where nobody leads (|e| < θ), a person with a comfortable pose c goes slowly back to it:
ds/dt += (1 − |e|/θ) (c − s)/T_c.

The set-point never does net work on who leads. With W(q,s) = ½(q−s)ᵀK(q−s) + U(q) − U(s) −
∂U(s)·(q−s), held in springs and weight, the leader's work is dW + e·ds and e·ds ≥ 0 for each joint
that is led; a joint that goes back gives at most θ|ds| and was led away against at least θ|ds|. So
over a closed cycle the leader never gains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# A joint without a spring would follow infinitely fast, N·m/rad.
_LEAST_STIFFNESS = 0.1


@dataclass(frozen=True)
class FollowingParameters:
    """How a person follows.

    Attributes:
        time_constant: T, with which the set-point follows a displaced joint, s.
        threshold: θ, the torque up to which a joint keeps its set-point, N·m.
        return_time_constant: T_c of the return to the comfortable pose, s. None: the arm stays
            where it was led.
        max_speed: greatest speed of a set-point, rad/s.

    Raises:
        UserError: a value is not as said here.
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
    """Returns ds/dt (k,), rad/s, of one arm; all joints slow down alike for the fastest one.

    Args:
        set_point: s (k,), rad.
        angles: q (k,) of the arm, rad.
        comfort: c (k,), rad.
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
