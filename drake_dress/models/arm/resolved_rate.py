"""Joint rates of two arms whose grippers shall move as asked (the paper's arm law).

The paper takes J⁺ v of a gripper's velocity and adds, in the null space of J, a motion of link 3
outward, away from the other arm. Here a quadratic programme does both, since a pseudoinverse knows
no limits: grippers go exactly in the direction that is asked, as fast as asked unless a limit is in
the way, and the joints' freedom that is left turns the hands as asked, goes outward and
home, at explicit gains. Limits of the joints hold in any case, distances between arms and to the
person unless joints could not stop in time. Near a singular pose grippers get slower instead
of joints faster.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import daqp
import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.chain import SerialArm, moved_by, rotation_error
from drake_dress.models.arm.clearance import (
    ArmShape,
    Capsules,
    Clearance,
    clearance,
    clearance_rates,
)
from drake_dress.models.arm.joint_bounds import rate_bounds

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
# DAQP's kinds of rows.
_BOUND, _EQUAL, _SOFT = 0, 5, 8


@dataclass(frozen=True)
class RateParameters:
    """Settings of the arms' control.

    Attributes:
        position_gain: of a gripper's error, 1/s. rotation_gain: of a hand's, 1/s.
        outward_gain: of link 3 away from the other arm, 1/s (the paper has none, that is 1/s).
        outward_distance: beyond which there is no need to, m.
        home_gain: of joints toward those of home, 1/s.
        max_turning: of a hand, rad/s.
        rotation_weight: of a hand's turning beside the joints' own motion, s²/rad² · rad²/s².
        slowdown_weight: of a gripper slower than asked, as a share.
        least_distance: between the arms, and from arm to person, m.
        seen_distance: from which on distances are bounded, m.
        approach_acceleration: with which an approach ends before the least distance, m/s².
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
    """Where a gripper shall be.

    Attributes:
        position: (3,) p_WT, m. velocity: (3,) m/s. rotation: (3,3) R_WT.
    """

    position: FloatArray
    velocity: FloatArray
    rotation: FloatArray


@dataclass(frozen=True)
class Rates:
    """What the joints of both arms shall do in the next step.

    Attributes:
        rate: (2,J) rad/s, left, then right.
        share: (2,) of the speed asked for that the grippers have.
        between_arms: least distance of the arms, m; to_person: of each arm (2,), m; infinite where
            nothing is near.
        kept: whether all was kept; if not, joints brake (limits hold all the same).
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
        home: (2,J) rad, joints that they like.
        free_links: links of an arm, from its tool back, that may touch the person: they hold the
            garment on it.
        parameters: settings.
    """

    arms: tuple[SerialArm, SerialArm]
    shapes: tuple[ArmShape, ArmShape]
    home: FloatArray
    free_links: int = 2
    parameters: RateParameters = field(default_factory=RateParameters)
    _pairs: IntArray = field(init=False)

    def __post_init__(self) -> None:
        left, right = (np.arange(len(shape.link)) for shape in self.shapes)
        object.__setattr__(self, "_pairs", _pairs(left, right))

    def rates(
        self,
        q: FloatArray,
        rate: FloatArray,
        goals: tuple[GripperGoal, GripperGoal],
        step: float,
        person: Capsules | None = None,
    ) -> Rates:
        """Returns the joints' rates for the next step.

        Args:
            q: (2,J) commanded now, rad.
            rate: (2,J) commanded in the step before, rad/s.
            goals: of left and right gripper.
            step: s.
            person: where it is.
        """
        p = self.parameters
        n = self.arms[0].count
        links = [arm.links(q[i]) for i, arm in enumerate(self.arms)]
        jacobians = [arm.tool_jacobian(links[i]) for i, arm in enumerate(self.arms)]
        # joints of left, of right, and by how much each gripper is slower than asked
        size = 2 * n + 2
        cost, slope = np.zeros((size, size)), np.zeros(size)
        moves, asked = np.zeros((6, size)), np.zeros(6)
        low, high = np.empty(size), np.empty(size)
        third = [x[3, :3, 3] for x in links]
        for i, (arm, goal, jacobian) in enumerate(zip(self.arms, goals, jacobians, strict=True)):
            own = slice(i * n, i * n + n)
            tool = links[i][-1]
            velocity = goal.velocity + p.position_gain * (goal.position - tool[:3, 3])
            turning = p.rotation_gain * rotation_error(tool[:3, :3], goal.rotation)
            turning *= min(1.0, p.max_turning / max(float(np.linalg.norm(turning)), 1e-12))
            liked = p.home_gain * (self.home[i] - q[i])
            liked += self._outward(links[i], third[i] - third[1 - i])
            turn = jacobian[3:]
            cost[own, own] = np.eye(n) + p.rotation_weight * turn.T @ turn
            slope[own] = -liked - p.rotation_weight * turn.T @ turning
            slower = 2 * n + i
            cost[slower, slower] = p.slowdown_weight
            moves[3 * i : 3 * i + 3, own] = jacobian[:3]
            moves[3 * i : 3 * i + 3, slower] = velocity
            asked[3 * i : 3 * i + 3] = velocity
            low[own], high[own] = rate_bounds(q[i], rate[i], step, arm.limits)
            low[slower], high[slower] = 0.0, 1.0
        near, closing, between, beside = self._distances(links, person)
        rows = np.vstack([moves, near])
        room = self._approach(closing, step)
        solution, _, flag, _ = daqp.solve(
            cost,
            slope,
            np.ascontiguousarray(rows),
            np.concatenate([high, asked, np.full(len(near), 1e30)]),
            np.concatenate([low, asked, room]),
            np.concatenate(
                [
                    np.full(size, _BOUND, dtype=np.int32),
                    np.full(6, _EQUAL, dtype=np.int32),
                    np.full(len(near), _SOFT, dtype=np.int32),
                ]
            ),
        )
        if flag < 1 or not np.isfinite(solution).all():
            # straight on, slower: always within the bounds
            still = np.clip(0.0, low[: 2 * n], high[: 2 * n]).reshape(2, n)
            return Rates(still, np.zeros(2), between, beside, False)
        found = np.clip(solution[: 2 * n], low[: 2 * n], high[: 2 * n]).reshape(2, n)
        return Rates(found, 1.0 - solution[2 * n :], between, beside, True)

    def _outward(self, links: FloatArray, from_other: FloatArray) -> FloatArray:
        """Returns (J,) rates of the joints that move link 3 away from that of the other arm."""
        p = self.parameters
        apart = float(np.linalg.norm(from_other))
        if apart >= p.outward_distance:
            return np.zeros(len(links) - 2)
        jacobian = moved_by(links, links[3:4, :3, 3], np.array([3]))[0, :, :3]
        way = p.outward_gain * (p.outward_distance - apart) * from_other / max(apart, 1e-9)
        # damped: a stretched arm has directions in which its link 3 does not go
        inverse = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + 0.01 * np.eye(3))
        rates: FloatArray = np.concatenate([inverse @ way, np.zeros(len(links) - 5)])
        return rates

    def _distances(
        self, links: list[FloatArray], person: Capsules | None
    ) -> tuple[FloatArray, FloatArray, float, FloatArray]:
        """Returns rows of distances' rates, distances (R,), the least of arms and of person."""
        n = self.arms[0].count
        placed = [shape.placed(x) for shape, x in zip(self.shapes, links, strict=True)]
        rows, distances = [], []

        def take(near: Clearance, sides: dict[int, int]) -> None:
            close = near.distance < self.parameters.seen_distance
            near = Clearance(
                near.pair[close],
                near.distance[close],
                near.here[close],
                near.there[close],
                near.away[close],
            )
            row = np.zeros((len(near.distance), 2 * n + 2))
            for i, side in sides.items():
                row[:, i * n : i * n + n] = clearance_rates(
                    near, self.arms[i], self.shapes[i], links[i], side
                )
            rows.append(row)
            distances.append(near.distance)

        both = clearance(placed[0], placed[1], self._pairs)
        take(both, {0: 0, 1: 1})
        beside = np.full(2, np.inf)
        if person is not None and len(person.radius):
            for i, shape in enumerate(self.shapes):
                kept = np.flatnonzero(shape.link <= n - self.free_links)
                near = clearance(placed[i], person, _pairs(kept, np.arange(len(person.radius))))
                take(near, {i: 0})
                beside[i] = near.distance.min()
        return np.vstack(rows), np.concatenate(distances), float(both.distance.min()), beside

    def _approach(self, distance: FloatArray, step: float) -> FloatArray:
        """Returns (R,) the least rates of distances, m/s: from them an approach still stops."""
        p = self.parameters
        room = distance - p.least_distance
        stops = np.sqrt(2.0 * p.approach_acceleration * np.maximum(room, 0.0))
        inside = np.minimum(room, 0.0) / (10.0 * step)
        least: FloatArray = -np.minimum(stops, np.maximum(room, 0.0) / step) - inside
        return least


def _pairs(first: IntArray, second: IntArray) -> IntArray:
    """Returns (M,2) each of the one with each of the other."""
    return np.stack([np.repeat(first, len(second)), np.tile(second, len(first))], axis=1)
