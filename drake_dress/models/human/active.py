"""An active arm: its next goal, and its set-point on the way there.

An arm without a goal follows the garment (`following.py`). A goal moves the hand along a smooth
path (`hand_tracking.py`) in the torso's frame, so that the motion continues while the body turns:

    follow ──armhole near──▶ reach ──hand through it──▶ follow
                               └──armhole gone──▶ return ──▶ follow
    any ──its time──▶ withdraw ──time over──▶ return;   a wave is added to the hand's path

While reaching, a hand that the garment holds off its path pushes a little harder, within limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.armhole import Armhole
from drake_dress.models.human.following import FollowingParameters, following_rate
from drake_dress.models.human.hand_tracking import (
    HandPath,
    eased,
    planned_time,
    rate_bounds,
    tracking_rate,
)
from drake_dress.models.human.motions import Motion, Reach, Turn, Wave, Withdraw

# A reach is given up once the armhole is farther from the hand's anchor than this times `within`.
_LOST = 1.4
_REACHABLE = 1.1  # largest distance of the armhole from the shoulder, over the arm's length
# A hand `_BESIDE` off the armhole's axis aims at a point before the opening. A hand within
# `_IN_LINE` aims through the opening; the targets are blended in between.
_BESIDE, _IN_LINE = 0.10, 0.05  # m
_BEFORE = 0.08  # that point's distance before the opening, m
_ENTERED = 0.6  # fraction of the push beyond which the hand has entered
_HARDER = 1.0  # 1/s, gain from the hand's path error to the rate of the target's shift
_HARDEST = 0.10  # m, largest shift
_MOVING = 0.03  # rad/s: an arm whose joints are slower is not seen to move
_ARRIVED, _STILL, _STUCK = 0.003, 0.01, 0.02  # m, m/s, rad/s
_UNPLANNED = -1.0
_LEFTWARD = np.array([0.0, 1.0, 0.0])


class Want(IntEnum):
    """Goal of an arm."""

    FOLLOW = 0
    REACH = 1
    WITHDRAW = 2
    RETURN = 3


@dataclass(frozen=True)
class ActiveParameters:
    """Limits of an active person's arms.

    Attributes:
        following: parameters of an arm without a goal.
        max_hand_speed: largest hand speed, m/s; people reach at 0.5 to 1 m/s at most when not in a
            hurry.
        max_joint_speed: largest joint speed, rad/s.
    """

    following: FollowingParameters = field(default_factory=FollowingParameters)
    max_hand_speed: float = 0.5
    max_joint_speed: float = 2.5


@dataclass(frozen=True)
class ArmState:
    """State of an active arm.

    Attributes:
        set_point: (4,), rad. rate: (4,), rad/s.
        path: reference path of the hand.
        shift: (3,) offset of the target that makes the hand push harder, m.
        anchor: (3,) point that the hand returns to, m.
        want: current goal.
        through: whether a reach has passed through the armhole.
    """

    set_point: FloatArray
    rate: FloatArray
    path: HandPath
    shift: FloatArray
    anchor: FloatArray
    want: Want = Want.FOLLOW
    through: bool = False

    SIZE = 26

    def flat(self) -> FloatArray:
        """Returns the state as (26,) numbers."""
        path = self.path
        return np.concatenate(
            [
                self.set_point,
                self.rate,
                path.position,
                path.velocity,
                path.acceleration,
                self.shift,
                self.anchor,
                [path.remaining, float(self.want), float(self.through)],
            ]
        )

    @classmethod
    def of(cls, flat: FloatArray) -> ArmState:
        """Returns the state from `flat`'s numbers."""
        vectors = flat[8:23].reshape(5, 3).copy()
        return cls(
            flat[:4].copy(),
            flat[4:8].copy(),
            HandPath(vectors[0], vectors[1], vectors[2], float(flat[23])),
            vectors[3],
            vectors[4],
            Want(int(flat[24])),
            bool(flat[25]),
        )


class ActiveArm:
    """Steps the set-point of one arm.

    Args:
        arm: its kinematics.
        comfort: rest pose (4,), rad.
        limits: (2,4) lower and upper joint limits, rad.
        stiffness: stiffness of its joints (4,), N·m/rad.
        motions: motions of the person; those of the other arm are ignored. Turns move both arms.
        parameters: limits.
    """

    def __init__(
        self,
        arm: Arm,
        comfort: FloatArray,
        limits: FloatArray,
        stiffness: FloatArray,
        motions: Sequence[Motion],
        parameters: ActiveParameters,
    ) -> None:
        mine = [m for m in motions if arm.side in m.sides]
        self.arm, self._p = arm, parameters
        self._comfort, self._limits, self._stiffness = comfort, limits, stiffness
        self._reach = next((m for m in mine if isinstance(m, Reach)), None)
        self._withdrawals = [m for m in mine if isinstance(m, Withdraw)]
        self._waves = [m for m in mine if isinstance(m, Wave)]
        self._turns = [m for m in motions if isinstance(m, Turn)]

    def initial_state(self) -> ArmState:
        """Returns the state at time 0: at rest in the comfortable pose."""
        hand = self.arm.hand(self._comfort)
        still = np.zeros(3)
        path = HandPath(hand, still, still)
        return ArmState(self._comfort, np.zeros(4), path, still, hand)

    def has_intent(self, state: ArmState, time: float) -> bool:
        """Returns whether the arm moves by the person's own will.

        It does while it is on its way to a goal, while it waves, and while the body turns.
        Otherwise it rests, is held where it was moved, or follows the garment.

        Args:
            state: current state.
            time: current time, s.
        """
        turning = any(t.is_on(time) for t in self._turns)
        moving = state.want is not Want.FOLLOW and float(np.max(np.abs(state.rate))) > _MOVING
        return moving or self._is_waving(time) or turning

    def step(
        self, state: ArmState, angles: FloatArray, armhole: Armhole, time: float, step: float
    ) -> ArmState:
        """Returns the state one step later.

        Args:
            state: current state.
            angles: true joint angles (4,), rad.
            armhole: current armhole of this side.
            time: current time, s.
            step: time step, s.
        """
        state = self._decide(state, armhole, time)
        waving = sum((np.array(w.offset(time)) for w in self._waves), np.zeros(2))
        if state.want is Want.FOLLOW:
            rate = following_rate(
                state.set_point,
                angles,
                self._comfort,
                self._stiffness,
                self.arm.gravity_stiffness(state.set_point),
                self._p.following,
            )
        else:
            shift = self._pushed_harder(state, armhole.joints[2], step)
            target = self._target(state, armhole, time) + shift
            path = state.path
            if path.remaining == _UNPLANNED:
                way = float(np.linalg.norm(target - path.position))
                path = replace(path, remaining=planned_time(way, self._p.max_hand_speed))
            path = path.toward(target, self._p.max_hand_speed, step)
            state = replace(state, path=path, shift=shift)
            rate = tracking_rate(
                self.arm,
                state.set_point,
                path.position + waving[0] * _LEFTWARD,
                path.velocity + waving[1] * _LEFTWARD,
                self._comfort,
                rate_bounds(state.set_point, self._limits, self._p.max_joint_speed),
                self._p.max_hand_speed,
            )
        rate = eased(rate, state.rate, step)
        set_point = np.clip(state.set_point + step * rate, *self._limits)
        return replace(state, set_point=set_point, rate=(set_point - state.set_point) / step)

    def _decide(self, state: ArmState, armhole: Armhole, time: float) -> ArmState:
        want = state.want
        if self._withdrawal(time) is not None:
            return state if want is Want.WITHDRAW else self._begin(state, Want.WITHDRAW)
        if want is Want.WITHDRAW:
            return self._begin(state, Want.RETURN)
        if want is Want.REACH:
            if armhole.depth >= self._push * _ENTERED and armhole.is_entered:
                return replace(state, want=Want.FOLLOW, through=True, shift=np.zeros(3))
            if not self._is_near(armhole, state.anchor, _LOST):
                return self._begin(state, Want.RETURN)
            return state
        waving = self._is_waving(time)
        reaches = self._reach is not None and not state.through and time >= self._reach.start
        place = state.anchor if want is Want.RETURN else armhole.joints[2]
        if reaches and self._is_near(armhole, place, 1.0):
            return self._begin(state, Want.REACH)
        if want is Want.RETURN and not waving and self._has_returned(state):
            return replace(state, want=Want.FOLLOW)
        if want is Want.FOLLOW and waving:
            return self._begin(state, Want.RETURN)
        return state

    def _begin(self, state: ArmState, want: Want) -> ArmState:
        """Returns the state with a new goal; the hand's path continues without a jump.

        A hand that stops following will return to that place, whatever it does meanwhile.
        """
        path, anchor = state.path, state.anchor
        if state.want is Want.FOLLOW:
            anchor = self.arm.hand(state.set_point)
            velocity = self.arm.jacobian(state.set_point) @ state.rate
            path = HandPath(anchor, velocity, np.zeros(3))
        path = replace(path, remaining=_UNPLANNED)
        return replace(state, want=want, anchor=anchor, path=path, shift=np.zeros(3))

    def _has_returned(self, state: ArmState) -> bool:
        """Returns whether the hand is back, or as close as the joints allow."""

        def near(point: FloatArray) -> bool:
            return float(np.linalg.norm(state.anchor - point)) < _ARRIVED

        still = float(np.linalg.norm(state.path.velocity)) < _STILL
        stuck = float(np.max(np.abs(state.rate))) < _STUCK
        there = near(self.arm.hand(state.set_point)) or stuck
        return near(state.path.position) and still and there

    def _target(self, state: ArmState, armhole: Armhole, time: float) -> FloatArray:
        if state.want is Want.REACH:
            aside = min(1.0, max(0.0, (armhole.beside - _IN_LINE) / (_BESIDE - _IN_LINE)))
            along = (1.0 - aside) * self._push - aside * _BEFORE
            target: FloatArray = armhole.center + along * armhole.into
            return target
        withdrawal = self._withdrawal(time)
        if state.want is not Want.WITHDRAW or withdrawal is None:
            return state.anchor
        way = (self.arm.shoulder - state.anchor) * [1.0, 1.0, 0.0]
        length = max(float(np.linalg.norm(way)), 1e-9)
        drawn: FloatArray = state.anchor + min(withdrawal.distance / length, 1.0) * way
        return drawn

    def _withdrawal(self, time: float) -> Withdraw | None:
        return next((w for w in self._withdrawals if w.is_on(time)), None)

    def _is_waving(self, time: float) -> bool:
        return any(w.is_on(time) for w in self._waves)

    def _pushed_harder(self, state: ArmState, hand: FloatArray, step: float) -> FloatArray:
        if state.want is not Want.REACH:
            return np.zeros(3)
        shift = state.shift + step * _HARDER * (state.path.position - state.shift - hand)
        size = float(np.linalg.norm(shift))
        limited: FloatArray = shift * min(1.0, _HARDEST / size) if size > 0.0 else shift
        return limited

    @property
    def _push(self) -> float:
        return self._reach.push if self._reach is not None else 0.0

    def _is_near(self, armhole: Armhole, place: FloatArray, slack: float) -> bool:
        if self._reach is None:
            return False
        away = float(np.linalg.norm(armhole.center - place))
        reach = float(np.linalg.norm(armhole.center - self.arm.shoulder))
        return away <= slack * self._reach.within and reach <= _REACHABLE * self.arm.length
