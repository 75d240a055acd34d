"""Stage costs of a plan: each cost is an object with a value and a gradient.

A `SleeveCost` is evaluated for one side at a time, a `GarmentCost` for the whole garment. Each cost
adds its gradient to the `Slope` of the step: with respect to nodes, held nodes, grippers, forces,
and the centres and directions of the sleeves. `StageCosts` propagates the last two to the nodes of
the armholes. A new cost is a class with `value` and `add_slope`;
`tests/models/control/test_costs.py` checks all of them against finite differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.control.corridor import corridor_cost
from drake_dress.models.control.situation import HeldGarment, Situation, SleeveTarget
from drake_dress.models.dressing.sleeve import (
    Entry,
    SleeveState,
    entry_direction,
    entry_direction_vjp,
    sleeve_state_vjp,
)


@dataclass(frozen=True)
class Weights:
    """Diagonal weights of the stage costs.

    Attributes:
        position: W, weight of a sleeve's distance from its target, 1/m².
        direction: Q, weight of a sleeve's deviation from its direction.
        speed: R, weight of the gripper displacement in a step, 1/m².
        safety: w_s, weight of the gripper force beyond `free_force`, 1/N².
        free_force: gripper force that costs nothing, N.
        separation: weight of the grippers' distance beyond the rest span of the garment between
            them, 1/m². It acts before the garment is taut, while the force carries no information.
            It also weighs the shortfall of the distance below `least_spread` of that span, where
            the garment collapses.
        least_spread: smallest distance of the grippers that costs nothing, as a share of the rest
            span.
        entering_spread: replaces `least_spread` while a hand enters a sleeve. A stretched garment
            holds the armhole open and turns it to the hand; a slack one hangs, and the hand pushes
            it away.
        level: weight of the shortfall of the left gripper's lateral lead, to the person's left,
            below `least_level` of the rest span, 1/m². A garment on edge turns its openings away
            from both hands and does not recover by itself.
        least_level: lateral lead of the left gripper that costs nothing, as a share of the rest
            span.
        clearance: weight of the shortfall of a gripper's distance to the person below
            `free_clearance`, 1/m².
        free_clearance: distance of a gripper from the person's skin that costs nothing, m.
        corridor: weight of cloth that hangs ahead of a hand about to enter, 1/m²; see corridor.py.
        corridor_radius: radius of the cylinder ahead of that hand, m.
        corridor_length: length of the cylinder ahead of that hand, m.
        passage: weight of cloth that would cross the forearm if the hand were in the armhole now,
            1/m².
        passage_radius: radius of the cylinder that stands for the forearm, m.
        passage_length: length of the cylinder that stands for the forearm, m.
        collar: weight of the collar's distance from the nape, and of the grippers' deviation from
            a level line just above the shoulders, while the coat is laid, 1/m².
        leading: weight of the collar's distance from its place beside a hanging arm, 1/m².
        leading_level: replaces `least_level` meanwhile; the garment comes partly on edge.
    """

    position: float = 1.0
    direction: float = 0.05
    speed: float = 0.125
    safety: float = 3e-4
    free_force: float = 5.0
    separation: float = 1.0
    least_spread: float = 0.5
    entering_spread: float = 0.85
    level: float = 20.0
    least_level: float = 0.5
    clearance: float = 10.0
    free_clearance: float = 0.05
    corridor: float = 3.0
    corridor_radius: float = 0.06
    corridor_length: float = 0.12
    passage: float = 3.0
    passage_radius: float = 0.06
    passage_length: float = 0.25
    collar: float = 10.0
    leading: float = 0.5
    leading_level: float = 0.3


@dataclass(frozen=True)
class Grip:
    """The nodes that the grippers hold.

    Attributes:
        nodes: (k,) held nodes of the garment: left, then right gripper.
        of_side: indices into `nodes`, for the left and for the right gripper.
        span: largest distance between the grippers at which the garment is taut, m.
    """

    nodes: IndexArray
    of_side: tuple[IndexArray, IndexArray]
    span: float

    def centers(self, x: FloatArray) -> FloatArray:
        """Returns the centres (2,3) of left and right grasp of nodes `x` (n,3), m."""
        return np.stack([x[self.nodes[of]].mean(axis=0) for of in self.of_side])

    def left_from_right(self, x: FloatArray) -> FloatArray:
        """Returns the vector (3,) from the right to the left grasp of nodes `x` (n,3), m."""
        left, right = self.centers(x)
        between: FloatArray = left - right
        return between


@dataclass(frozen=True)
class PlannedStep:
    """One time step of a plan, the input of the costs.

    Attributes:
        index: index of the step, from 0.
        x: (n,3) nodes at the end of the step, m.
        reaction: (k,3) force of the garment on the grippers at the held nodes, N.
        sleeves: states of left and right sleeve.
        situation: situation that the plan is computed for.
        grip: the nodes that the grippers hold.
    """

    index: int
    x: FloatArray
    reaction: FloatArray
    sleeves: tuple[SleeveState, SleeveState]
    situation: Situation
    grip: Grip

    def target(self, side: int) -> SleeveTarget:
        """Returns the target of a sleeve."""
        return self.situation.targets[side]

    def force(self, side: int) -> FloatArray:
        """Returns the force (3,) of the garment on a gripper, N."""
        total: FloatArray = self.reaction[self.grip.of_side[side]].sum(axis=0)
        return total


@dataclass
class Slope:
    """Gradient of the costs of one step; each cost adds to it.

    Attributes:
        x: (n,3) with respect to the nodes.
        held: (k,3) with respect to the held nodes, in addition to `x`.
        grippers: (2,3) with respect to the mean of the nodes that left and right gripper hold.
        reaction: (k,3) with respect to the forces.
        p_c, v_c: (2,3) with respect to the centres and directions of the sleeves.
    """

    x: FloatArray
    held: FloatArray
    grippers: FloatArray
    reaction: FloatArray
    p_c: FloatArray
    v_c: FloatArray

    @classmethod
    def onto(cls, x: FloatArray, held_count: int) -> Slope:
        """Returns a gradient that accumulates in `x` (n,3) in place and is zero otherwise."""
        held, pair = (held_count, 3), (2, 3)
        zeros = [np.zeros(shape) for shape in (held, pair, held, pair, pair)]
        return cls(x, *zeros)


class GarmentCost(Protocol):
    """A cost of the whole garment at one step."""

    def value(self, step: PlannedStep) -> float:
        """Returns the cost, which is not negative."""

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """Adds the gradient of `value` to `slope`."""


class SleeveCost(Protocol):
    """A cost of one sleeve at one step."""

    def value(self, step: PlannedStep, side: int) -> float:
        """Returns the cost of a side, which is not negative."""

    def add_slope(self, step: PlannedStep, side: int, slope: Slope) -> None:
        """Adds the gradient of `value` to `slope`."""


@dataclass(frozen=True)
class SleevePosition:
    """w ‖p_c − p̄‖²: draws the armhole's centre to its target."""

    weight: float

    def value(self, step: PlannedStep, side: int) -> float:
        """See `SleeveCost`."""
        target = step.target(side)
        off = step.sleeves[side].p_c - target.position[step.index]
        return self.weight * target.position_weight * float(np.sum(off**2))

    def add_slope(self, step: PlannedStep, side: int, slope: Slope) -> None:
        """See `SleeveCost`."""
        target = step.target(side)
        off = step.sleeves[side].p_c - target.position[step.index]
        slope.p_c[side] += 2.0 * self.weight * target.position_weight * off


@dataclass(frozen=True)
class SleeveDirection:
    """w ‖d − d̄‖²: turns the armhole's direction, or that to the garment's entry, to its target."""

    weight: float
    entry: Entry

    def value(self, step: PlannedStep, side: int) -> float:
        """See `SleeveCost`."""
        off = self._off(step, side)
        return self.weight * step.target(side).direction_weight * float(np.sum(off**2))

    def add_slope(self, step: PlannedStep, side: int, slope: Slope) -> None:
        """See `SleeveCost`."""
        target = step.target(side)
        by_direction = 2.0 * self.weight * target.direction_weight * self._off(step, side)
        if not target.entering:
            slope.v_c[side] += by_direction
            return
        by_entry, by_center = entry_direction_vjp(
            step.x, step.sleeves[side].p_c, self.entry, by_direction
        )
        slope.x[self.entry.nodes] += by_entry
        slope.p_c[side] += by_center

    def _off(self, step: PlannedStep, side: int) -> FloatArray:
        target, sleeve = step.target(side), step.sleeves[side]
        way = sleeve.v_c
        if target.entering:
            way = entry_direction(step.x, sleeve.p_c, self.entry)
        return way - target.direction[step.index]


@dataclass(frozen=True)
class _Cylinder:
    """w times the cost of cloth in a cylinder, see corridor.py; lengths in m."""

    weight: float
    radius: float
    length: float

    def value(self, step: PlannedStep, side: int) -> float:
        """See `SleeveCost`."""
        return self.weight * self._found(step, side)[0] if self._counts(step, side) else 0.0

    def add_slope(self, step: PlannedStep, side: int, slope: Slope) -> None:
        """See `SleeveCost`."""
        if self._counts(step, side):
            self._add(self._found(step, side)[1], side, slope)

    def _counts(self, step: PlannedStep, side: int) -> bool:
        return self.weight > 0.0 and self._place(step, side) is not None

    def _found(self, step: PlannedStep, side: int) -> tuple[float, FloatArray]:
        place = self._place(step, side)
        assert place is not None
        return corridor_cost(step.x, *place, self.radius, self.length)

    def _place(self, step: PlannedStep, side: int) -> tuple[FloatArray, FloatArray] | None:
        """Returns the cylinder's start (3,), m, and axis (3,), a unit vector; None without one."""
        raise NotImplementedError

    def _add(self, crossing: FloatArray, side: int, slope: Slope) -> None:
        """Adds the gradient; `crossing` (n,3) is the derivative of `corridor_cost`."""
        slope.x += self.weight * crossing


@dataclass(frozen=True)
class HandCorridor(_Cylinder):
    """Cloth that hangs ahead of a hand about to enter."""

    def _place(self, step: PlannedStep, side: int) -> tuple[FloatArray, FloatArray] | None:
        way = step.target(side).corridor
        return None if way is None else (way.hand[step.index], way.into[step.index])


@dataclass(frozen=True)
class ForearmPassage(_Cylinder):
    """Cloth that would cross the forearm if the hand were in the armhole now."""

    def _place(self, step: PlannedStep, side: int) -> tuple[FloatArray, FloatArray] | None:
        into = step.target(side).passage
        return None if into is None else (step.sleeves[side].p_c, -into[step.index])

    def _add(self, crossing: FloatArray, side: int, slope: Slope) -> None:
        super()._add(crossing, side, slope)
        slope.p_c[side] -= self.weight * crossing.sum(axis=0)


@dataclass(frozen=True)
class GripperForce:
    """w max(0, ‖f‖ − free)²: penalizes gripper force above `free`, N."""

    weight: float
    free: float

    def value(self, step: PlannedStep, side: int) -> float:
        """See `SleeveCost`."""
        force = float(np.linalg.norm(step.force(side)))
        return self.weight * max(0.0, force - self.free) ** 2

    def add_slope(self, step: PlannedStep, side: int, slope: Slope) -> None:
        """See `SleeveCost`."""
        total = step.force(side)
        force = float(np.linalg.norm(total))
        excess = force - self.free
        if excess > 0.0:
            mine = step.grip.of_side[side]
            slope.reaction[mine] += 2.0 * self.weight * excess * total / force


@dataclass(frozen=True)
class GripperSpread:
    """w e²: e, m, is by how much the grippers are too far apart or too close to each other.

    They are too far apart beyond their rest distance, and too close below the share `least` of it.
    `entering` replaces `least` while a hand enters a sleeve.
    """

    weight: float
    least: float
    entering: float

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        distance = float(np.linalg.norm(step.grip.left_from_right(step.x)))
        return self.weight * self._error(step, distance) ** 2

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        between = step.grip.left_from_right(step.x)
        distance = float(np.linalg.norm(between))
        error = self._error(step, distance)
        if error != 0.0:
            pull = 2.0 * self.weight * error * between / distance
            slope.grippers[0] += pull
            slope.grippers[1] -= pull

    def _error(self, step: PlannedStep, distance: float) -> float:
        """Returns the distance error, m: positive if too far apart, negative if too close."""
        span = step.grip.span
        entering = any(t.entering and t.position_weight > 0.0 for t in step.situation.targets)
        short = distance - (self.entering if entering else self.least) * span
        return max(0.0, distance - span) + min(0.0, short)


@dataclass(frozen=True)
class GripperLevel:
    """w e²: e, m, is the shortfall of the left gripper's lateral lead over the right one.

    `least` is the required lead, as a share of the grippers' rest distance; `leading` that while
    the garment comes along a hanging arm.
    """

    weight: float
    least: float
    leading: float

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        return self.weight * self._error(step) ** 2

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        leftward, error = step.situation.leftward, self._error(step)
        if leftward is not None and error != 0.0:
            push = 2.0 * self.weight * error * leftward[step.index]
            slope.grippers[0] -= push
            slope.grippers[1] += push

    def _error(self, step: PlannedStep) -> float:
        leftward = step.situation.leftward
        if leftward is None:
            return 0.0
        between = step.grip.left_from_right(step.x)
        least = self.least if step.situation.leading is None else self.leading
        return max(0.0, least * step.grip.span - float(between @ leftward[step.index]))


@dataclass(frozen=True)
class PersonClearance:
    """w e², mean over the nodes of a gripper: e is the shortfall of skin distance below `free`.

    `free` is in m.
    """

    weight: float
    free: float

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        return self._found(step)[0]

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        slope.held += self._found(step)[1]

    def _found(self, step: PlannedStep) -> tuple[float, FloatArray]:
        """Returns the cost, and its gradient with respect to the held nodes (k,3)."""
        grip, situation = step.grip, step.situation
        person = situation.obstacles if situation.kept_away is None else situation.kept_away
        obstacles = person[step.index]
        if not obstacles.count:
            return 0.0, np.zeros((len(grip.nodes), 3))
        count = np.empty(len(grip.nodes))
        for of in grip.of_side:
            count[of] = len(of)
        near = find_proximity(step.x[grip.nodes], obstacles, self.free)
        short = np.maximum(0.0, -near.gap)
        cost = self.weight * float(np.sum(short**2 / count))
        return cost, (-2.0 * self.weight * short / count * near.slope)[:, None] * near.normal


@dataclass(frozen=True)
class StageCosts:
    """All costs of a step.

    Attributes:
        of_sleeves, of_garment: costs of each sleeve, and of the garment.
        armholes: loop nodes of left and right armhole. signs: their orientation signs.
    """

    of_sleeves: Sequence[SleeveCost]
    of_garment: Sequence[GarmentCost]
    armholes: tuple[IntArray, IntArray]
    signs: tuple[float, float]

    def values(self, step: PlannedStep) -> list[float]:
        """Returns the costs of the step: left sleeve, right sleeve, then garment."""
        of_sleeves = [cost.value(step, side) for side in (0, 1) for cost in self.of_sleeves]
        return of_sleeves + [cost.value(step) for cost in self.of_garment]

    def add_slope(self, step: PlannedStep, x_bar: FloatArray) -> FloatArray:
        """Adds the gradient in the nodes to `x_bar` (n,3); returns that in the forces (k,3)."""
        slope = Slope.onto(x_bar, len(step.grip.nodes))
        for side in (0, 1):
            for of_sleeve in self.of_sleeves:
                of_sleeve.add_slope(step, side, slope)
            loop, sign = self.armholes[side], self.signs[side]
            of_loop = sleeve_state_vjp(step.x, loop, sign, slope.p_c[side], slope.v_c[side])
            np.add.at(x_bar, loop, of_loop)
        for of_garment in self.of_garment:
            of_garment.add_slope(step, slope)
        for side, of in enumerate(step.grip.of_side):
            x_bar[step.grip.nodes[of]] += slope.grippers[side] / len(of)
        x_bar[step.grip.nodes] += slope.held
        return slope.reaction


def dressing_costs(
    weights: Weights, garment: HeldGarment, more: Sequence[GarmentCost] = ()
) -> StageCosts:
    """Returns the stage costs of the dressing; `more` extends the garment costs."""
    w = weights
    return StageCosts(
        (
            SleevePosition(w.position),
            SleeveDirection(w.direction, garment.entry),
            HandCorridor(w.corridor, w.corridor_radius, w.corridor_length),
            ForearmPassage(w.passage, w.passage_radius, w.passage_length),
            GripperForce(w.safety, w.free_force),
        ),
        (
            GripperSpread(w.separation, w.least_spread, w.entering_spread),
            GripperLevel(w.level, w.least_level, w.leading_level),
            PersonClearance(w.clearance, w.free_clearance),
            *more,
        ),
        garment.armholes,
        garment.signs,
    )
