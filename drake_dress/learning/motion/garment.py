"""Motion of both sleeves of a coat that two grippers hold, by the local model.

As in the paper, the local problem with its constraints makes the garment's motion: where a person
follows, only the distances that the garment allows bind the sleeves, and they move as if no arm
were in them. Where a person moves by will, a sleeve on the arm is also bound to that arm.

Limitation: an arm carries its sleeve along even where the garment, if it is held still, would
not reach so far. Grippers then follow the sleeve.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.learning.motion.garment_draw import GarmentDraw
from drake_dress.learning.motion.goals import Goal, draw_goal, place_of, unit
from drake_dress.learning.motion.sleeve_start import draw_start
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.control.constrained_ddp import solve
from drake_dress.models.control.local_model import (
    LocalParameters,
    Nominal,
    SleeveGoal,
    is_coupled,
    local_problem,
)
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.human.tremor import Wanderings

ArmAxes = tuple[ArmAxis, ArmAxis]
"""Axes of left and right arm."""

STEP = 0.1  # s, between solves
_HORIZON = 8  # steps
_SLOWEST_ACROSS = 0.05  # m/s, least bound on the speed of a sleeve across its arm
_OVER = 0.05  # m, distance of an armhole from the hand at which it is over it
_FIRST_PROGRESS = 0.02  # s of a sleeve that has just come over its hand
_SLIPPED = 0.08  # m beyond the hand: the sleeve has come off; more than `_OVER`
_TAUT = 0.09  # m, largest distance of an armhole's centre from the axis of an arm in it
# Largest distance of a gripper from its armhole, as a share of the geodesic distance: cloth of the
# coarse mesh stretches, and a gripper holds a patch.
_HELD = 1.4
_TURNS = 0.4  # s, time constant of a sleeve's direction
# The direction of a sleeve off its arm: that of the forearm near the hand (within this distance,
# m), a little up, and by this weight toward its gripper.
_ALIGNS, _LIFTED, _PULLED = 0.2, 0.1, 2.0
# Share of the pull across of a sleeve that is on its arm.
_ACROSS_ON = 0.3
_UP = np.array([0.0, 0.0, 1.0])


@dataclass
class Sleeves:
    """Both sleeves and grippers, which move step by step.

    Attributes:
        of: drawn values.
        rng: draws.
        center, gripper: (2,3), m.
        on: (2,) whether each arm is in its sleeve.
        progress: (2,) s of each sleeve on its arm.
        sideways: sway of the components of both directions.
        direction: (2,3) unit vectors from cuff to armhole.
        goals: what each sleeve is led to.
        coupled: whether the garment between the sleeves is taut.
    """

    of: GarmentDraw
    rng: np.random.Generator
    center: FloatArray
    gripper: FloatArray
    on: BoolArray
    progress: FloatArray
    sideways: Wanderings
    direction: FloatArray = field(init=False)
    goals: list[Goal | None] = field(default_factory=lambda: [None, None])
    coupled: bool = False

    @classmethod
    def drawn(cls, rng: np.random.Generator, of: GarmentDraw, axes: ArmAxes) -> Sleeves:
        """Returns sleeves in a drawn phase of a dressing of arms with `axes`."""
        start = draw_start(rng, of.reach, axes)
        sleeves = cls(of, rng, **vars(start), sideways=Wanderings(rng, 6))
        sleeves.direction = sleeves._pulled(axes, 0.0)
        return sleeves

    def advance(self, axes: ArmAxes, willed: BoolArray, time: float) -> FloatArray:
        """Moves the sleeves by one `STEP`; returns their motion (2,3), m.

        Args:
            axes: of both arms.
            willed: (2,) which arms move by will.
            time: s.
        """
        problem = self._problem(axes, willed, time)
        moved = (problem.input_matrix @ solve(problem).v[0]).reshape(4, 3)
        if not np.all(np.isfinite(moved)):
            moved = np.zeros((4, 3))
        way: FloatArray = self.of.share * moved[:2]
        self.center = self.center + way
        self.gripper = self.gripper + moved[2:]
        share = 1.0 - np.exp(-STEP / _TURNS)
        turned = (1.0 - share) * self.direction + share * self._pulled(axes, time)
        self.direction = np.stack([unit(row) for row in turned])
        return way

    def meet(self, axes: ArmAxes, before: ArmAxes) -> None:
        """Keeps sleeves on the arms that have moved from `before` to `axes`."""
        for i, axis in enumerate(axes):
            if self.on[i]:
                self._carry(i, axis, before[i])
            elif self._goes_over(axis.G(0.0), i):
                self.on[i], self.progress[i], self.goals[i] = True, _FIRST_PROGRESS, None
        self._hold()

    def _goes_over(self, hand: FloatArray, i: int) -> bool:
        """Returns whether a sleeve comes to be on the arm whose hand is at `hand` (3,), m."""
        if np.linalg.norm(hand - self.center[i]) >= _OVER:
            return False
        return bool(self.rng.random() < STEP / max(STEP, self.of.hinders))

    def _problem(self, axes: ArmAxes, willed: BoolArray, time: float) -> LocalProblem:
        """Returns the local problem whose solution is the sleeves' next motion."""
        left, right = (self._goal(axes, i, bool(willed[i]), time) for i in (0, 1))
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
            beside_speed=max(_SLOWEST_ACROSS, self.of.max_speed),
        )
        apart = float(np.linalg.norm(self.center[0] - self.center[1]))
        self.coupled = is_coupled(self.coupled, apart, self.of.reach, p)
        return local_problem(nominal, (left, right), self.coupled, self.of.reach, p)

    def _goal(self, axes: ArmAxes, i: int, willed: bool, time: float) -> SleeveGoal:
        """Returns the goal of a sleeve at the times of the horizon; draws one if none holds."""
        axis, goal, on = axes[i], self.goals[i], bool(self.on[i])
        if goal is None or time >= goal.until:
            waits = None if self.on[1 - i] else axes[1 - i].G(0.0)
            goal = draw_goal(self.rng, axis, self.center[i], on, time, waits)
            self.goals[i] = goal
        after = STEP * np.arange(_HORIZON + 1, dtype=np.float64)
        bound, s = on and willed, float(self.progress[i])
        arm = axis.points(np.full(_HORIZON + 1, s))
        if goal.kind == "draw":
            target = axis.points(s + self.of.rate * after)
            if bound:
                arm = target
        else:
            place = place_of(goal, axis, self.center[i], s if on else None)
            target = self._straight_to(place, i, after)
        direction = np.tile(axis.D(s), (_HORIZON + 1, 1))
        return SleeveGoal(target, 1.0, bound, arm, direction)

    def _straight_to(self, place: FloatArray, i: int, after: FloatArray) -> FloatArray:
        """Returns targets (N+1,3), m, that go straight to `place` within the speed limit."""
        way = place - self.center[i]
        length = float(np.linalg.norm(way))
        share = np.minimum(1.0, self.of.max_speed * after / max(length, 1e-9))
        target: FloatArray = self.center[i] + share[:, None] * way
        return target

    def _pulled(self, axes: ArmAxes, time: float) -> FloatArray:
        """Returns the directions (2,3) to which arm, hand, coat and gripper pull the sleeves."""
        sway = self.of.sways * self.sideways.value(time).reshape(2, 3)
        across = self.of.across * unit(self.center[1] - self.center[0])
        pulled = np.empty((2, 3))
        for i, (axis, other) in enumerate(zip(axes, (across, -across), strict=True)):
            pull = self.gripper[i] - self.center[i]
            if self.on[i]:
                wanted = axis.D(float(self.progress[i])) + _ACROSS_ON * other + pull
            else:
                to_hand = axis.G(0.0) - self.center[i]
                near = float(np.exp(-np.linalg.norm(to_hand) / _ALIGNS))
                wanted = near * axis.D(0.0) + self.of.toward * unit(to_hand) + other
                wanted = wanted + _LIFTED * _UP + _PULLED * pull
            pulled[i] = unit(unit(wanted) + sway[i])
        return pulled

    def _carry(self, i: int, axis: ArmAxis, old: ArmAxis) -> None:
        """Carries a sleeve along with its arm, which moved from `old` to `axis`."""
        s = self.progress[i]
        carried, along = axis.G(s) - old.G(s), axis.D(s)
        self.center[i] += self.of.carried * (carried @ along) * along
        place = axis.coordinates(self.center[i])
        if place.l > _TAUT:
            point = axis.G(place.s)
            self.center[i] = point + (self.center[i] - point) * (_TAUT / place.l)
        self.progress[i] = place.s
        beyond = float((axis.G(0.0) - self.center[i]) @ axis.D(0.0))
        if place.s <= 0.0 and beyond > _SLIPPED:
            self.on[i], self.goals[i] = False, None

    def _hold(self) -> None:
        """Draws the grippers along where an arm carries a sleeve beyond the garment's reach."""
        for i in (0, 1):
            off = self.gripper[i] - self.center[i]
            length = float(np.linalg.norm(off))
            largest = _HELD * self.of.reach.to_near_gripper[i]
            if length > largest:
                self.gripper[i] = self.center[i] + off * (largest / length)


def axes_of(joints: FloatArray) -> ArmAxes:
    """Returns the axes of left and right arm of joints (6,3), m."""
    return ArmAxis(*joints[2::-1]), ArmAxis(*joints[:2:-1])
