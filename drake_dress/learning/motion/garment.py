"""Motion of both sleeves of a coat that two grippers hold, by the local model.

As in the paper, the local problem with its constraints makes the garment's motion: where a person
follows, only the distances that the garment allows bind the sleeves, and they move as if no arm
were in them. Where a person moves by will, a sleeve on the arm is also bound to that arm.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.control.constrained_ddp import solve
from drake_dress.models.control.local_model import (
    LocalParameters,
    Nominal,
    SleeveGoal,
    is_coupled,
    local_problem,
)
from drake_dress.models.control.solution import Solution
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.garment.geodesics import Reach
from drake_dress.models.human.tremor import Wandering

STEP = 0.1  # s, between solves
_HORIZON = 8
_OFF_ARM = {"approach": 0.6, "roam": 0.2, "stay": 0.2}
_ON_ARM = {"draw": 0.35, "aside": 0.55, "stay": 0.1}
_LASTS = 2.0, 6.0  # s, of a goal
# Distance within which a sleeve that approaches is over the hand; before it, the point in line
# with the forearm that it passes, and how near it must come, m.
_OVER, _BEFORE, _NEAR = 0.05, 0.10, 0.06
_FARTHEST_ASIDE, _ROAMS = 0.45, 0.35  # m
_SLIPPED = 0.04  # m beyond the hand: the sleeve has come off
_TAUT = 0.09  # largest distance of an armhole's centre from the axis of an arm in it, m
_TURNS = 0.4  # time constant of a sleeve's direction, s
_SWAYS = 0.2  # standard deviation of the sideways part of its unit direction
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class GarmentDraw:
    """What is drawn of a garment and of the robot that moves it.

    Attributes:
        reach: of the coat.
        max_speed: of the grippers, m/s.
        beside: largest distance of a sleeve from its arm's axis before it moves it, m.
        carried: share of an arm's motion along itself that a sleeve on it takes part in.
        share: share of its gripper's motion that a sleeve takes.
        rate: progress of a sleeve that is drawn up its arm, 1/s.
    """

    reach: Reach
    max_speed: float
    beside: float
    carried: float
    share: float
    rate: float

    @classmethod
    def drawn(cls, rng: np.random.Generator, reach: Reach) -> GarmentDraw:
        """Returns drawn values for a coat."""
        return cls(
            reach,
            float(rng.uniform(0.06, 0.22)),
            float(rng.uniform(0.01, 0.05)),
            float(rng.uniform(0.0, 0.7)),
            float(rng.uniform(0.8, 1.0)),
            float(rng.uniform(0.05, 0.35)),
        )


@dataclass
class _Goal:
    """What a sleeve is led to: `kind`, a place (3,), m, and the time until it holds, s."""

    kind: str
    place: FloatArray
    until: float


@dataclass
class Sleeves:
    """Both sleeves and grippers, which move step by step.

    Attributes:
        of: drawn values.
        center, direction, gripper: (2,3), m, unit vectors from cuff to armhole, m.
        on: whether each arm is in its sleeve.
        progress: s of each sleeve on its arm.
    """

    of: GarmentDraw
    rng: np.random.Generator
    center: FloatArray
    direction: FloatArray
    gripper: FloatArray
    on: BoolArray
    progress: FloatArray
    goals: list[_Goal | None] = field(default_factory=lambda: [None, None])
    coupled: bool = False
    sideways: list[Wandering] = field(default_factory=list)

    @classmethod
    def drawn(cls, rng: np.random.Generator, of: GarmentDraw, joints: FloatArray) -> Sleeves:
        """Returns sleeves in a drawn phase of a dressing of joints (6,3), m."""
        on = np.array([[False, False], [True, False], [False, True], [True, True]])[
            rng.choice(4, p=[0.2, 0.2, 0.2, 0.4])
        ]
        progress = np.where(on, rng.uniform(0.05, 1.9, 2), 0.0)
        center, direction = np.zeros((2, 3)), np.zeros((2, 3))
        for i in (0, 1):
            axis = axis_of(joints, i)
            hand, way = axis.G(0.0), axis.D(0.0)
            if on[i]:
                center[i], direction[i] = axis.G(progress[i]), axis.D(progress[i])
                continue
            away = _unit(-way + 0.7 * rng.normal(size=3) - 0.3 * _UP)
            center[i] = hand + rng.uniform(0.08, 0.45) * away
            direction[i] = _unit(hand - center[i] + 0.2 * rng.normal(size=3))
        gap = center[1] - center[0]
        far = float(np.linalg.norm(gap)) / (0.95 * of.reach.between_sleeves)
        if far > 1.0:
            # the sleeve that is off comes closer to the other
            free = [i for i in (0, 1) if not on[i]] or [0, 1]
            for i in free:
                sign = 1.0 if i == 0 else -1.0
                center[i] += sign * gap * (1.0 - 1.0 / far) / len(free)
        near = np.array(of.reach.to_near_gripper)[:, None]
        over = np.stack([_unit(_UP + 0.5 * rng.normal(size=3)) for _ in (0, 1)])
        gripper = center + 0.9 * near * over
        return cls(of, rng, center, direction, gripper, on, progress).with_sway()

    def with_sway(self) -> Sleeves:
        """Returns itself, with drawn sideways motion of the sleeves' directions."""
        self.sideways = [Wandering(self.rng) for _ in range(6)]
        return self

    def advance(self, joints: FloatArray, willed: BoolArray, time: float) -> FloatArray:
        """Moves the sleeves by one `STEP`; returns their motion (2,3), m.

        Args:
            joints: (6,3) of both arms, m.
            willed: which arms move by will.
            time: s.
        """
        axes = [axis_of(joints, i) for i in (0, 1)]
        goals = tuple(self._goal(axes[i], i, bool(willed[i]), time) for i in (0, 1))
        nominal = Nominal(
            np.tile(self.center, (_HORIZON + 1, 1, 1)),
            np.tile(self.gripper, (_HORIZON + 1, 1, 1)),
            np.zeros((_HORIZON, 2, 3)),
        )
        p = LocalParameters(
            time_step=STEP,
            horizon=_HORIZON,
            max_speed=self.of.max_speed,
            beside=self.of.beside,
            beside_speed=max(0.05, self.of.max_speed),
        )
        apart = float(np.linalg.norm(self.center[0] - self.center[1]))
        self.coupled = is_coupled(self.coupled, apart, self.of.reach, p)
        problem = local_problem(nominal, (goals[0], goals[1]), self.coupled, self.of.reach, p)
        found: Solution = solve(problem)
        moved = (problem.input_matrix @ found.v[0]).reshape(4, 3)
        if not np.all(np.isfinite(moved)):
            moved = np.zeros((4, 3))
        way = self.of.share * moved[:2]
        self.center = self.center + way
        self.gripper = self.gripper + moved[2:]
        self._turn(axes, time)
        return way

    def meet(self, joints: FloatArray, before: FloatArray) -> None:
        """Keeps sleeves on the arms that have moved from `before` to `joints`, (6,3), m."""
        for i in (0, 1):
            axis = axis_of(joints, i)
            if self.on[i]:
                old = axis_of(before, i)
                carried = axis.G(self.progress[i]) - old.G(self.progress[i])
                along = axis.D(self.progress[i])
                self.center[i] += self.of.carried * (carried @ along) * along
                place = axis.coordinates(self.center[i])
                point = axis.G(place.s)
                off = self.center[i] - point
                if place.l > _TAUT:
                    self.center[i] = point + off * (_TAUT / place.l)
                self.progress[i] = place.s
                beyond = float((axis.G(0.0) - self.center[i]) @ axis.D(0.0))
                self.on[i] = not (place.s <= 0.0 and beyond > _SLIPPED)
                if not self.on[i]:
                    self.goals[i] = None
            elif self._enters(axis, i):
                self.on[i], self.progress[i], self.goals[i] = True, 0.02, None
        self._hold()

    def _enters(self, axis: ArmAxis, i: int) -> bool:
        hand = axis.G(0.0)
        return float(np.linalg.norm(hand - self.center[i])) < _OVER

    def _hold(self) -> None:
        """Draws the grippers along where an arm carries a sleeve beyond the garment's reach."""
        for i in (0, 1):
            off = self.gripper[i] - self.center[i]
            length = float(np.linalg.norm(off))
            largest = 1.4 * self.of.reach.to_near_gripper[i]
            if length > largest:
                self.gripper[i] = self.center[i] + off * (largest / length)

    def _goal(self, axis: ArmAxis, i: int, willed: bool, time: float) -> SleeveGoal:
        goal = self.goals[i]
        if goal is None or time >= goal.until:
            goal = self.goals[i] = self._draw_goal(axis, i, time)
        after = STEP * np.arange(_HORIZON + 1)
        bound = bool(self.on[i]) and willed
        s = float(self.progress[i])
        arm = axis.points(np.full(_HORIZON + 1, s))
        if goal.kind == "draw":
            target = axis.points(s + self.of.rate * after)
            if bound:
                arm = target
        else:
            target = self._led(self._place(goal, axis, i), i, after)
        direction = np.tile(axis.D(s), (_HORIZON + 1, 1))
        return SleeveGoal(target, 1.0, bound, arm, direction)

    def _place(self, goal: _Goal, axis: ArmAxis, i: int) -> FloatArray:
        """Returns the place (3,), m, that a sleeve is led to now."""
        if goal.kind == "stay":
            return axis.G(self.progress[i]) if self.on[i] else self.center[i]
        if goal.kind == "approach":
            hand, way = axis.G(0.0), axis.D(0.0)
            before = hand - _BEFORE * way
            aside = self.center[i] - hand
            aside = aside - (aside @ way) * way
            return hand if np.linalg.norm(aside) < _NEAR else before
        return goal.place

    def _led(self, place: FloatArray, i: int, after: FloatArray) -> FloatArray:
        """Returns targets (N+1,3), m, that go straight to `place` within the speed limit."""
        way = place - self.center[i]
        length = float(np.linalg.norm(way))
        share = np.minimum(1.0, self.of.max_speed * after / max(length, 1e-9))
        target: FloatArray = self.center[i] + share[:, None] * way
        return target

    def _draw_goal(self, axis: ArmAxis, i: int, time: float) -> _Goal:
        kinds = _ON_ARM if self.on[i] else _OFF_ARM
        kind = str(self.rng.choice(list(kinds), p=list(kinds.values())))
        until = time + self.rng.uniform(*_LASTS)
        place = self.center[i].copy()
        if kind == "aside":
            way = self.rng.normal(size=3) * [1.0, 1.0, 0.6]
            place = place + self.rng.uniform(0.08, _FARTHEST_ASIDE) * _unit(way)
        elif kind == "roam":
            place = axis.G(0.0) + _ROAMS * self.rng.normal(size=3) * [1.0, 1.0, 0.5]
        return _Goal(kind, place, until)

    def _turn(self, axes: list[ArmAxis], time: float) -> None:
        sway = _SWAYS * np.array([w.value(time) for w in self.sideways]).reshape(2, 3)
        for i in (0, 1):
            pull = self.gripper[i] - self.center[i]
            if self.on[i]:
                wanted = axes[i].D(float(self.progress[i])) + pull
            else:
                to_hand = axes[i].G(0.0) - self.center[i]
                near = float(np.exp(-np.linalg.norm(to_hand) / 0.2))
                wanted = near * axes[i].D(0.0) + _unit(to_hand + 0.1 * _UP) + 2.0 * pull
            share = 1.0 - np.exp(-STEP / _TURNS)
            turned = (1.0 - share) * self.direction[i] + share * _unit(wanted + sway[i])
            self.direction[i] = _unit(turned)


def axis_of(joints: FloatArray, side: int) -> ArmAxis:
    """Returns the axis of an arm of joints (6,3), m."""
    shoulder, elbow, hand = joints[3 * side : 3 * side + 3]
    return ArmAxis(hand, elbow, shoulder)


def _unit(vector: FloatArray) -> FloatArray:
    length = max(float(np.linalg.norm(vector)), 1e-9)
    unit: FloatArray = vector / length
    return unit
