"""Joint rates of two arms for commanded gripper motions (the paper's arm law).

The paper uses J⁺ v for a gripper's velocity v and adds, in the null space of J, a motion of link 3
outward, away from the other arm. Here a quadratic programme does both, since a pseudoinverse knows
no limits. Grippers move exactly in the commanded direction, at the commanded speed unless a limit
prevents it. The remaining freedom of the joints turns the hands as commanded and moves the arms
outward and home, with explicit gains. Joint limits always hold. Distances between arms and to the
person hold unless joints cannot stop in time. Near a singular pose, grippers slow down instead of
joints speeding up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import daqp
import numba as nb
import numpy as np

from drake_dress.models.arm.chain import (
    SerialArm,
    find_tool_jacobian,
    moved_by,
    place_links,
    rotation_error,
)
from drake_dress.models.arm.clearance import (
    ArmShape,
    Capsules,
    find_gap,
    find_gap_rates,
    place_capsules,
)
from drake_dress.models.arm.joint_bounds import find_rate_bounds
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.round_cone import both_radii
from drake_dress.models.vector3 import length

# DAQP's kinds of rows.
_BOUND, _EQUAL, _SOFT = 0, 5, 8
_NOBODY = Capsules(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


class RateParameters(NamedTuple):
    """Settings of the arms' control: plain numbers, for compiled kernels.

    Attributes:
        position_gain: gain on a gripper's position error, 1/s.
        rotation_gain: gain on a hand's rotation error, 1/s.
        outward_gain: gain of link 3 away from the other arm, 1/s (implicitly 1/s in the paper).
        outward_distance: distance of both links 3 beyond which they are not moved outward, m.
        home_gain: gain of the joints toward home, 1/s.
        max_turning: largest turning speed of a hand, rad/s.
        rotation_weight: weight of the hands' turning rates relative to that of the joint rates.
        slowdown_weight: weight of a gripper's relative slowdown.
        least_distance: least distance between the arms, and from arm to person, m.
        seen_distance: distance below which a pair is constrained, m.
        approach_acceleration: deceleration that ends an approach at the least distance, m/s².
    """

    position_gain: float = 10.0
    rotation_gain: float = 2.0
    outward_gain: float = 0.5
    outward_distance: float = 0.8
    home_gain: float = 0.2
    max_turning: float = 0.5
    rotation_weight: float = 20.0
    slowdown_weight: float = 50.0
    least_distance: float = 0.06
    seen_distance: float = 0.25
    approach_acceleration: float = 1.0


@dataclass(frozen=True)
class GripperGoal:
    """Commanded pose and velocity of a gripper.

    Attributes:
        position: (3,) p_WT, m. velocity: (3,) m/s. rotation: (3,3) R_WT.
    """

    position: FloatArray
    velocity: FloatArray
    rotation: FloatArray


@dataclass(frozen=True)
class Rates:
    """Joint rates of both arms for the next step.

    Attributes:
        rate: (2,J) rad/s, left, then right.
        share: (2,) fraction of the commanded speed that each gripper has.
        between_arms: least distance of the arms, m; to_person: of each arm (2,), m; infinite if
            there is no person.
        kept: whether the programme was solved; if not, joints brake (their limits still hold).
    """

    rate: FloatArray
    share: FloatArray
    between_arms: float
    to_person: FloatArray
    kept: bool


@dataclass(frozen=True)
class ArmPair:
    """Two arms that hold one garment.

    Attributes:
        arms: left, then right. shapes: of both, hands included.
        home: (2,J) preferred joint positions, rad.
        free_links: number of links, from the tool back, that may touch the person, since they hold
            the garment on it.
        parameters: settings.
    """

    arms: tuple[SerialArm, SerialArm]
    shapes: tuple[ArmShape, ArmShape]
    home: FloatArray
    free_links: int = 2
    parameters: RateParameters = field(default_factory=RateParameters)
    _compiled: tuple[_Arm, _Arm] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        compiled = tuple(_compiled(a, s) for a, s in zip(self.arms, self.shapes, strict=True))
        object.__setattr__(self, "_compiled", compiled)

    def rates(
        self,
        q: FloatArray,
        rate: FloatArray,
        goals: tuple[GripperGoal, GripperGoal],
        step: float,
        person: Capsules | None = None,
    ) -> Rates:
        """Returns the joint rates for the next step.

        Args:
            q: (2,J) currently commanded positions, rad.
            rate: (2,J) rates commanded in the previous step, rad/s.
            goals: goals of the left and the right gripper.
            step: time step, s.
            person: capsules of the person, if there is one.
        """
        seen = _NOBODY if person is None else person
        cost, slope, rows, upper, lower, kinds, between, to_person = _programme(
            self._compiled,
            np.ascontiguousarray(self.home, dtype=np.float64),
            self.parameters,
            np.array(q, dtype=np.float64),
            np.array(rate, dtype=np.float64),
            np.stack([goal.position for goal in goals]),
            np.stack([goal.velocity for goal in goals]),
            np.stack([goal.rotation for goal in goals]),
            step,
            (seen.first, seen.second, both_radii(seen.radius)),
            self.free_links,
        )
        solution, _, flag, _ = daqp.solve(cost, slope, rows, upper, lower, kinds)
        joints = q.size
        low, high = lower[:joints], upper[:joints]
        if flag < 1 or not np.isfinite(solution).all():
            # brake: the rates nearest to 0 within the bounds
            still = np.clip(0.0, low, high).reshape(q.shape)
            return Rates(still, np.zeros(2), between, to_person, False)
        found = np.clip(solution[:joints], low, high).reshape(q.shape)
        return Rates(found, 1.0 - solution[joints:], between, to_person, True)


class _Arm(NamedTuple):
    """An arm for compiled kernels: fields of `SerialArm`, its limits, and `ArmShape`."""

    base: FloatArray
    joints: FloatArray
    tool: FloatArray
    lower: FloatArray
    upper: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    first: FloatArray
    second: FloatArray
    radius: FloatArray
    owner: IndexArray


def _compiled(arm: SerialArm, shape: ArmShape) -> _Arm:
    limits, capsules = arm.limits, shape.capsules
    of_arm = (arm.base, arm.joints, arm.tool)
    of_limits = (limits.lower, limits.upper, limits.speed, limits.acceleration)
    of_shape = (capsules.first, capsules.second, both_radii(capsules.radius))
    # one layout in memory, for which kernels are compiled once
    plain = [np.ascontiguousarray(v, dtype=np.float64) for v in (*of_arm, *of_limits, *of_shape)]
    owner = np.ascontiguousarray(shape.link, dtype=np.int64)
    return _Arm._make([*plain, owner])


@nb.njit(cache=True, nogil=True)
def _programme(arms, home, p, q, rate, position, velocity, rotation, step, person, free_links):  # type: ignore[no-untyped-def]
    """Returns the quadratic programme as DAQP takes it, and the least distances.

    Its unknowns are the joint rates of the left and the right arm, and the relative slowdown of
    each gripper. Rows: the grippers' velocities (6), then the rates of distances.

    position, velocity (2,3) and rotation (2,3,3) are the goals'; person is first (K,3), second
    (K,3), radius (K,2) of its capsules; other arguments as in `ArmPair` and `ArmPair.rates`.
    """
    n = q.shape[1]
    size = 2 * n + 2
    links = np.empty((2, n + 2, 4, 4))
    for i in range(2):
        links[i] = place_links(arms[i].base, arms[i].joints, arms[i].tool, q[i])
    most = len(arms[0].radius) * len(arms[1].radius)
    most += (len(arms[0].radius) + len(arms[1].radius)) * len(person[2])
    cost, slope = np.zeros((size, size)), np.zeros(size)
    rows = np.zeros((6 + most, size))
    lower, upper = np.zeros(size + 6 + most), np.full(size + 6 + most, 1e30)
    kinds = np.full(size + 6 + most, _SOFT, dtype=np.int32)
    kinds[:size], kinds[size : size + 6] = _BOUND, _EQUAL
    for i in range(2):
        arm, own, slower = arms[i], slice(i * n, i * n + n), 2 * n + i
        tool = links[i, n + 1]
        jacobian = find_tool_jacobian(links[i])
        turning = p.rotation_gain * rotation_error(tool[:3, :3], rotation[i])
        turning *= min(1.0, p.max_turning / max(length(turning), 1e-12))
        turn = jacobian[3:]
        cost[own, own] = np.eye(n) + p.rotation_weight * (turn.T @ turn)
        slope[own] = p.home_gain * (q[i] - home[i]) - p.rotation_weight * (turn.T @ turning)
        _add_outward(links[i], links[1 - i], p, slope[own])
        cost[slower, slower] = p.slowdown_weight
        for k in range(3):
            asked = velocity[i, k] + p.position_gain * (position[i, k] - tool[k, 3])
            rows[3 * i + k, own] = jacobian[k]
            rows[3 * i + k, slower] = asked
            lower[size + 3 * i + k] = upper[size + 3 * i + k] = asked
        find_rate_bounds(
            q[i],
            rate[i],
            step,
            arm.lower,
            arm.upper,
            arm.speed,
            arm.acceleration,
            lower[own],
            upper[own],
        )
        upper[slower] = 1.0
    near, between, to_person = _keep_apart(
        arms, links, person, free_links, p, step, rows[6:], lower[size + 6 :]
    )
    count = 6 + near
    return (
        cost,
        slope,
        rows[:count],
        upper[: size + count],
        lower[: size + count],
        kinds[: size + count],
        between,
        to_person,
    )


@nb.njit(cache=True, nogil=True)
def _add_outward(links, other, p, slope):  # type: ignore[no-untyped-def]
    """Subtracts from `slope` (J,) the rates that move link 3 away from that of the other arm."""
    way = links[3, :3, 3] - other[3, :3, 3]
    apart = length(way)
    if apart >= p.outward_distance:
        return
    way *= p.outward_gain * (p.outward_distance - apart) / max(apart, 1e-9)
    jacobian = np.zeros((3, len(slope)))
    moved_by(links, links[3, :3, 3], 3, jacobian)
    # damped: link 3 of a stretched arm cannot move in some directions
    force = np.linalg.solve(jacobian @ jacobian.T + 0.01 * np.eye(3), way)
    for j in range(len(slope)):
        for k in range(3):
            slope[j] -= jacobian[k, j] * force[k]


@nb.njit(cache=True, nogil=True)
def _keep_apart(arms, links, person, free_links, p, step, rows, least):  # type: ignore[no-untyped-def]
    """Writes a row for each pair within `seen_distance`; returns their count, the least distances.

    rows (M,2J+2) receives the rates of distances, least (M,) the lowest rates, m/s, from which an
    approach still stops; links (2,J+2,4,4); other arguments as in `_programme`.
    """
    n = links.shape[1] - 2
    count, between = 0, np.inf
    to_person = np.full(2, np.inf)
    here, there, away = np.empty(3), np.empty(3), np.empty(3)
    left = np.empty((2, len(arms[0].radius), 3))
    right = np.empty((2, len(arms[1].radius), 3))
    place_capsules(links[0], arms[0].owner, arms[0].first, arms[0].second, left)
    place_capsules(links[1], arms[1].owner, arms[1].first, arms[1].second, right)
    for k in range(left.shape[1]):
        for m in range(right.shape[1]):
            apart = find_gap(
                left[0, k],
                left[1, k],
                arms[0].radius[k],
                right[0, m],
                right[1, m],
                arms[1].radius[m],
                here,
                there,
                away,
            )
            between = min(between, apart)
            if apart < p.seen_distance:
                find_gap_rates(links[0], here, arms[0].owner[k], away, 1.0, rows[count, :n])
                owner = arms[1].owner[m]
                find_gap_rates(links[1], there, owner, away, -1.0, rows[count, n : 2 * n])
                least[count] = _approach(apart, p, step)
                count += 1
    first, second, radius = person
    for i in range(2):
        own, placed = slice(i * n, i * n + n), left if i == 0 else right
        for k in range(placed.shape[1]):
            if arms[i].owner[k] > n - free_links:
                continue
            for m in range(len(radius)):
                apart = find_gap(
                    placed[0, k],
                    placed[1, k],
                    arms[i].radius[k],
                    first[m],
                    second[m],
                    radius[m],
                    here,
                    there,
                    away,
                )
                to_person[i] = min(to_person[i], apart)
                if apart < p.seen_distance:
                    owner = arms[i].owner[k]
                    find_gap_rates(links[i], here, owner, away, 1.0, rows[count, own])
                    least[count] = _approach(apart, p, step)
                    count += 1
    return count, between, to_person


@nb.njit(cache=True, nogil=True)
def _approach(distance, p, step):  # type: ignore[no-untyped-def]
    """Returns the lowest rate of a distance, m/s, from which an approach still stops."""
    room = distance - p.least_distance
    stops = np.sqrt(2.0 * p.approach_acceleration * max(room, 0.0))
    inside = min(room, 0.0) / (10.0 * step)
    return -min(stops, max(room, 0.0) / step) - inside
