"""What each sleeve is asked to do, and where it shall be for it: facts, stages, targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drake_dress.models.cloth.elements import FloatArray
from drake_dress.models.control.corridor import Corridor
from drake_dress.models.control.global_mpc import SleeveTarget
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.linking import arm_linking_number, torso_interior
from drake_dress.models.dressing.sight import (
    distance_to_opening,
    free_sight,
    move_into_sight,
)
from drake_dress.models.dressing.sleeve import SleeveState, loop_orientation, sleeve_state
from drake_dress.models.dressing.stages import (
    Place,
    SleeveFacts,
    StageParameters,
    StageState,
    Task,
    advance_stages,
    eases,
    retreats,
    swings,
    withdraws,
)
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.heading import Heading, heading

# How much further up its arm the next place of a sleeve that is on it is, as s.
_NEXT = 0.04


@dataclass(frozen=True)
class Approach:
    """A way to go about a hand; shares are between inward across the body (0) and forearm (1).

    Attributes:
        share: of the direction in which an armhole is drawn over the hand.
        orientation: of the direction from the armhole to the garment's entry.
        emphasis: factor on Q.
        tilt: how much of the forearm's slope the latter direction has. The garment turns about the
            vertical as far as it is asked to; turned up toward a steep forearm it hangs on edge.
    """

    share: float
    orientation: float
    emphasis: float = 1.0
    tilt: float = 1.0

    def direction(self, axis: ArmAxis, to: Heading, side: int) -> FloatArray:
        """Returns the unit vector along which an armhole is drawn over the hand."""
        return _between(_inward(to, side), axis.D(0.0), self.share)

    def entry(self, axis: ArmAxis, to: Heading, side: int) -> FloatArray:
        """Returns the unit vector from an armhole to the garment's entry, as it is asked for."""
        forearm = axis.D(0.0) * np.array([1.0, 1.0, self.tilt])
        forearm /= np.linalg.norm(forearm)
        return _between(_inward(to, side), forearm, self.orientation)


@dataclass(frozen=True)
class TaskParameters:
    """Where sleeves are asked to go.

    Attributes:
        progress_rate: advance of s asked for, 1/s (k in a step of the prediction).
        approach_distance: cap of l_h, m.
        tethered_approach_distance: the same with the other sleeve on, m.
        approach_slope: l_h per distance beside the line of approach; 1 as printed.
        approaches: how a hand is gone about; after each attempt that missed it the next, in turn.
            The first is tried first, but the second for a flat forearm, the third for a steep one.
        tethered_approaches: the same with the other sleeve on, begun with the first.
        flat, steep: level part of a forearm's direction from which on it is flat; up to which it
            is steep.
        led_inward: inward part of a forearm's direction, hand to elbow, below which the hand has
            been led inward. led_approach: to such an arm.
        behind_distance: cap of how far behind the hand a sleeve that is not in line yet waits, m.
        tethered_behind_distance: the same with the other sleeve on, m.
        retreat_distance: how much further back a sleeve goes that missed the hand, m.
        withdrawal_distance: behind the shoulders, to where both sleeves are taken back, m.
        swing_reach: how far from the first armhole the second one is swung back, as a share of the
            distance between both at rest.
        swing_outward: outward part of the way there, for each part backward.
        widening: growth of the cap of l_h with each attempt that missed the hand.
        outlook_distance: from the hand, within which a tethered sleeve goes where it is seen, m.
        outlook_reach: share of the distance between both armholes at rest at which it stays then.
        clear_sight: share from which on a tethered sleeve is drawn straight at the hand, wherever
            the hand is before the opening.
        funnel_wide: hand this far beside the normal of an opening that it sees clearly: the opening
            is brought in line first, `funnel_distance` before the hand, m.
        funnel_narrow: this far beside it is drawn on, m.
        funnel_distance: m.
        aside_free: distance beside that does not count, m.
        overshoot: how far past the hand an armhole in line is asked to go, m.
        inside_radius: a hand beyond an armhole's plane and this close to its centre is in it, m.
        touch_distance: a hand this close to the surface that spans an armhole is about to go in:
            the armhole is drawn along the forearm, whatever bars the hand's sight of it, m.
        near_distance: from the hand, from which on an armhole's place counts more than its
            direction, m.
        near_position, near_direction: factors on W and Q then.
        dressing_direction: factor on Q while a sleeve is drawn up its arm.
        dressing_position: factor on W once both are: the last centimetres cost less than what the
            armhole lies askew on the shoulder.
        waiting_reach: share of the distance between both armholes at rest that a waiting sleeve
            lets the other one use.
        final_progress: s that is asked for in the end; at 2 the armhole would be drawn into the
            armpit, and both sleeves would pull against each other. A sleeve whose other one is not
            there yet stays where it just counts as done, and leaves the garment to it.
        largest_lead: advance of s that one of two sleeves on their arms may have on the other.
        stages: thresholds of the switching.
    """

    progress_rate: float = 0.4
    approach_distance: float = 0.20
    tethered_approach_distance: float = 0.15
    approach_slope: float = 3.0
    approaches: tuple[Approach, ...] = (
        Approach(0.25, 0.6),
        Approach(0.5, 1.0, 3.0),
        Approach(0.25, 0.6, tilt=0.3),
        Approach(0.25, 0.75, 3.0),
        Approach(0.5, 0.85, 3.0),
    )
    tethered_approaches: tuple[Approach, ...] = (
        Approach(0.25, 0.75, 3.0),
        Approach(0.25, 0.6),
        Approach(0.25, 0.85, 3.0),
        Approach(0.5, 0.85, 3.0),
    )
    led_inward: float = -0.03
    led_approach: Approach = Approach(0.9, 0.9, 3.0)
    flat: float = 0.65
    steep: float = 0.47
    behind_distance: float = 0.30
    tethered_behind_distance: float = 0.15
    retreat_distance: float = 0.15
    withdrawal_distance: float = 0.65
    swing_reach: float = 0.9
    swing_outward: float = 0.5
    widening: float = 0.1
    outlook_distance: float = 0.35
    outlook_reach: float = 1.04
    clear_sight: float = 0.9
    funnel_wide: float = 0.07
    funnel_narrow: float = 0.03
    funnel_distance: float = 0.08
    aside_free: float = 0.02
    overshoot: float = 0.12
    inside_radius: float = 0.08
    touch_distance: float = 0.03
    near_distance: float = 0.2
    near_position: float = 3.0
    near_direction: float = 0.3
    dressing_direction: float = 0.1
    dressing_position: float = 4.0
    waiting_reach: float = 0.9
    final_progress: float = 1.99
    largest_lead: float = 0.6
    stages: StageParameters = field(default_factory=StageParameters)


@dataclass(frozen=True)
class Assignment:
    """What both sleeves are asked to do, left, then right, and what that was decided from.

    Attributes:
        tasks: of each. facts: of each. retreat: whether it keeps away from the hand. ease: whether
            it gives way. attempts: how often it has missed the hand. outlook: place from the hand
            at which the hand sees the armhole of a tethered sleeve, (3,) m. withdraw: whether both
            are taken back behind the person. swing: whether it is, with the other one on its arm.
    """

    tasks: tuple[Task, Task]
    facts: tuple[SleeveFacts, SleeveFacts]
    retreat: tuple[bool, bool] = (False, False)
    ease: tuple[bool, bool] = (False, False)
    attempts: tuple[int, int] = (0, 0)
    outlook: tuple[FloatArray | None, FloatArray | None] = (None, None)
    withdraw: bool = False
    swing: tuple[bool, bool] = (False, False)


def arm_axes(joints: FloatArray) -> tuple[ArmAxis, ArmAxis]:
    """Returns the axes of left and right arm; joints (6,3), m: shoulder, elbow, hand of each."""
    q = joints
    return (
        ArmAxis(hand=q[2], elbow=q[1], shoulder=q[0]),
        ArmAxis(hand=q[5], elbow=q[4], shoulder=q[3]),
    )


class TaskPlanner:
    """Assigns tasks, and tells where they lead.

    Args:
        mesh: the controller's garment.
        parameters: settings.
    """

    def __init__(self, mesh: GarmentMesh, parameters: TaskParameters) -> None:
        self.mesh = mesh
        self.parameters = parameters
        self.armholes = (
            np.asarray(mesh.loops["left_armhole"]),
            np.asarray(mesh.loops["right_armhole"]),
        )
        self.signs = (float(loop_orientation(mesh, "left")), float(loop_orientation(mesh, "right")))
        centers = [mesh.rest_position[loop].mean(axis=0) for loop in self.armholes]
        self._reach = float(np.linalg.norm(centers[0] - centers[1]))

    def sleeves(self, x: FloatArray) -> tuple[SleeveState, SleeveState]:
        """Returns the states of left and right sleeve of the garment at `x` (n,3), m."""
        return (
            sleeve_state(x, self.armholes[0], self.signs[0]),
            sleeve_state(x, self.armholes[1], self.signs[1]),
        )

    def assign(
        self, stages: StageState, x: FloatArray, joints: FloatArray, time: float
    ) -> tuple[StageState, Assignment]:
        """Returns the stages now, and what follows from them.

        Args:
            stages: so far.
            x: (n,3) the garment now, m.
            joints: (6,3) shoulder, elbow, hand of left, then right arm now, m.
            time: now, s.
        """
        p = self.parameters
        axes, to, sleeves = arm_axes(joints), heading(joints), self.sleeves(x)
        missed = stages.attempts
        linked = [self._linked(x, joints, side) for side in (0, 1)]
        ways = [self._approach(axes[i], to, i, missed[i], linked[1 - i]) for i in (0, 1)]
        facts = (
            self._facts(x, joints, axes[0], to, sleeves[0], 0, linked[0], ways[0]),
            self._facts(x, joints, axes[1], to, sleeves[1], 1, linked[1], ways[1]),
        )
        goals = [self._waypoint(axes[i], to, facts[i], i, ways[i]) for i in (0, 1)]
        distance = float(np.linalg.norm(goals[0] - goals[1]))
        stages, tasks = advance_stages(stages, facts, p.stages, distance, time)
        return stages, Assignment(
            tasks,
            facts,
            (retreats(stages, 0, p.stages, time), retreats(stages, 1, p.stages, time)),
            (eases(stages, 0, p.stages, time), eases(stages, 1, p.stages, time)),
            stages.attempts,
            (
                self._outlook(x, joints[2], to, sleeves, 0, linked, missed[0]),
                self._outlook(x, joints[5], to, sleeves, 1, linked, missed[1]),
            ),
            withdraws(stages, facts, p.stages, time),
            (
                swings(stages, 0, facts, p.stages, time),
                swings(stages, 1, facts, p.stages, time),
            ),
        )

    def renewed(
        self, given: Assignment, sleeves: Sequence[SleeveState], joints: FloatArray
    ) -> Assignment:
        """Returns an assignment with the progress that sleeves have made on joints (6,3), m, now.

        Who is on which arm, and who sees whom, is as it was.
        """
        s = [
            float(axis.coordinates(sleeve.p_c).s) if fact.linked else 0.0
            for axis, sleeve, fact in zip(arm_axes(joints), sleeves, given.facts, strict=True)
        ]
        left, right = (replace(f, s=value) for f, value in zip(given.facts, s, strict=True))
        return replace(given, facts=(left, right))

    def targets(
        self,
        assignment: Assignment,
        sleeves: Sequence[SleeveState],
        joints: FloatArray,
        time_step: float,
    ) -> tuple[SleeveTarget, SleeveTarget]:
        """Returns where both sleeves shall be at each of N steps.

        Args:
            assignment: what they are to do.
            sleeves: where they are now.
            joints: (N+1,6,3) predicted, m; row 0 is now.
            time_step: between rows, s.
        """
        axes = [arm_axes(q) for q in joints]
        headings = [heading(q) for q in joints]
        return (
            self._target(assignment, 0, axes, headings, sleeves, time_step),
            self._target(assignment, 1, axes, headings, sleeves, time_step),
        )

    def _approach(
        self, axis: ArmAxis, to: Heading, side: int, attempts: int, tethered: bool
    ) -> Approach:
        """Returns how to go about a hand that was missed so often.

        What misses a hand once mostly misses it again: an arm that another approach suits gets it.
        A flat forearm goes into an armhole that is turned toward it about the vertical, a steep one
        into one that comes from the side. From the side an armhole that misses also pushes an arm
        that follows further inward each time, where it is led behind the back in the end: such an
        arm is gone about along its forearm every other time.
        """
        p = self.parameters
        if attempts % 2 and _opening(axis, to, side) < p.led_inward:
            return p.led_approach
        if tethered:
            return p.tethered_approaches[attempts % len(p.tethered_approaches)]
        level = float(np.linalg.norm(axis.D(0.0)[:2]))
        best = 1 if level >= p.flat else 2 if level <= p.steep else 0
        turn = attempts % len(p.approaches)
        # the best goes first, the others keep their order
        return p.approaches[best if turn == 0 else turn - 1 if turn <= best else turn]

    def _linked(self, x: FloatArray, joints: FloatArray, side: int) -> bool:
        """Returns whether an arm passes through its armhole."""
        shoulder, elbow, hand = joints[3 * side : 3 * side + 3]
        interior = torso_interior(joints[0], joints[3])
        loop = x[self.armholes[side]]
        return abs(arm_linking_number(loop, shoulder, elbow, hand, interior)) == 1

    def _outlook(
        self,
        x: FloatArray,
        hand: FloatArray,
        to: Heading,
        sleeves: Sequence[SleeveState],
        side: int,
        linked: Sequence[bool],
        missed: int,
    ) -> FloatArray | None:
        """Returns where, from the hand, a sleeve is seen by it, (3,) m, if it is near.

        A tethered one, for it does not reach any further, or one that missed the hand.
        """
        p, sleeve, other = self.parameters, sleeves[side], sleeves[1 - side]
        near = np.linalg.norm(hand - sleeve.p_c) < p.outlook_distance
        tethered = linked[1 - side]
        if linked[side] or not near or not (tethered or missed > 0):
            return None
        reach = p.outlook_reach * self._reach if tethered else np.inf
        loop, normal = self.armholes[side], sleeve.v_c
        move = move_into_sight(
            x, self.mesh.faces, loop, normal, hand, other.p_c, reach, to.rotation.T
        )
        place: FloatArray = sleeve.p_c + move - hand
        return place

    def _waypoint(
        self, axis: ArmAxis, to: Heading, fact: SleeveFacts, side: int, way: Approach
    ) -> FloatArray:
        """Returns where a sleeve has to be able to go next: outside the hand, or up its arm."""
        p = self.parameters
        if fact.linked:
            return axis.G(min(2.0, fact.s + _NEXT))
        return axis.G(0.0) - p.approach_distance * way.direction(axis, to, side)

    def _facts(
        self,
        x: FloatArray,
        joints: FloatArray,
        axis: ArmAxis,
        to: Heading,
        sleeve: SleeveState,
        side: int,
        linked: bool,
        way: Approach,
    ) -> SleeveFacts:
        _, elbow, hand = joints[3 * side : 3 * side + 3]
        s, _, _ = axis.coordinates(sleeve.p_c)
        offset = hand - sleeve.p_c
        aside = _aside(offset, way.direction(axis, to, side))
        loop = self.armholes[side]
        sight = free_sight(x, self.mesh.faces, loop, hand)
        touches = not linked and distance_to_opening(x[loop], hand) < self.parameters.touch_distance
        return SleeveFacts(
            linked=linked,
            sight=1.0 if touches else sight,
            s=float(s) if linked else 0.0,
            hand_distance=float(np.linalg.norm(offset)),
            prepared_error=max(aside, 0.5 * float(np.linalg.norm(offset))),
            passed=0.0 if linked else float(s) * float(np.linalg.norm(elbow - hand)),
            opening=_opening(axis, to, side),
            touches=touches,
            hand=_place(hand),
            away=_place(offset / max(float(np.linalg.norm(offset)), 1e-12)),
        )

    def _prepared(
        self,
        given: Assignment,
        side: int,
        axis: ArmAxis,
        to: Heading,
        sleeve: SleeveState,
        retreat: bool = False,
    ) -> FloatArray:
        """Returns where a sleeve is prepared (Eq. Jpi).

        The opening is drawn over the hand mostly from outside inward. Before, it waits a cap of l_h
        outside the hand, and further back (against v_f) until it is in line: so the hand comes in
        by the open front. An arm that comes from anywhere else meets the outside of the front
        panel, with the armhole's centre at the hand and the hand not in it; so an opening that the
        hand does not see stays outside. The garment does not reach that far with its other sleeve
        on an arm: the second one goes where the hand comes to see it. One that faces the hand is
        drawn along its own normal, and along the forearm once the hand is in it: further inward it
        would be pulled past it.
        """
        p = self.parameters
        fact, tethered = given.facts[side], given.facts[1 - side].linked
        attempts, outlook = given.attempts[side], given.outlook[side]
        hand = axis.G(0.0)
        way = self._approach(axis, to, side, attempts, tethered)
        direction = way.direction(axis, to, side)
        offset = hand - sleeve.p_c
        # Depth of the hand behind the opening, and how far it is beside the opening's normal.
        depth = float(offset @ -sleeve.v_c)
        beside = float(np.linalg.norm(offset + depth * sleeve.v_c))
        barred = _ramp(fact.sight, p.stages.least_sight, p.stages.lost_sight)
        facing = (1.0 - barred) * _ramp(beside, 1.5 * p.inside_radius, p.inside_radius)
        if outlook is not None:
            facing = max(facing, _ramp(fact.sight, p.stages.least_sight, p.clear_sight))
        inside = facing * _ramp(depth, -0.02, 0.02)
        aside = (1.0 - facing) * _aside(offset, direction)
        cap = p.tethered_approach_distance if tethered else p.approach_distance
        cap *= 1.0 + p.widening * min(attempts, 3)
        distance = min(p.approach_slope * max(0.0, aside - p.aside_free), cap)
        distance = max(distance, barred * cap)
        if retreat:
            return hand - cap * direction - p.retreat_distance * to.front
        # not over the hand before it is in line: what is beside goes first
        ahead = _ramp(beside, p.funnel_wide, p.funnel_narrow) if depth < 0.0 else 1.0
        if outlook is not None:
            onward = (1.0 - inside) * sleeve.v_c + inside * axis.D(0.0)
            onward = ahead * p.overshoot * onward - (1.0 - ahead) * p.funnel_distance * sleeve.v_c
            there: FloatArray = hand + (1.0 - facing) * outlook + facing * onward
            return there
        onward = (facing - inside) * sleeve.v_c + inside * axis.D(0.0)
        onward = p.overshoot * ((1.0 - facing) * direction + ahead * onward)
        onward = onward - (1.0 - ahead) * facing * p.funnel_distance * sleeve.v_c
        goal = hand - distance * direction + (1.0 - barred) * onward
        behind = p.tethered_behind_distance if tethered else p.behind_distance
        if distance == cap:
            error = sleeve.p_c - (hand - cap * direction)
            error = error - to.front * (to.front @ error)
            wait = p.approach_slope * max(0.0, float(np.linalg.norm(error)) - 2.0 * p.aside_free)
            goal = hand - cap * direction - min(wait, behind) * to.front
        return goal

    def _target(
        self,
        given: Assignment,
        side: int,
        axes: Sequence[tuple[ArmAxis, ArmAxis]],
        headings: Sequence[Heading],
        sleeves: Sequence[SleeveState],
        time_step: float,
    ) -> SleeveTarget:
        p, n = self.parameters, len(axes) - 1
        facts = given.facts
        task, step = given.tasks[side], (-1.0 if given.ease[side] else 1.0) * p.progress_rate
        position, direction = np.empty((n, 3)), np.empty((n, 3))
        way = self._approach(
            axes[0][side], headings[0], side, given.attempts[side], facts[1 - side].linked
        )
        entering = task in (Task.PREPARE, Task.REST) or not facts[side].linked
        away = given.retreat[side] or given.swing[side] or given.withdraw
        for j in range(n):
            axis, to = axes[j + 1][side], headings[j + 1]
            if entering:
                if given.withdraw:
                    position[j] = axis.G(2.0) - p.withdrawal_distance * to.front
                elif given.swing[side]:
                    position[j] = self._swung(to, side, sleeves[1 - side])
                elif facts[side].touches and not away:
                    position[j] = axis.G((j + 1) * time_step * p.progress_rate)
                else:
                    position[j] = self._prepared(
                        given, side, axis, to, sleeves[side], given.retreat[side]
                    )
                direction[j] = way.entry(axis, to, side)
                continue
            if task == Task.HOLD:
                s = max(facts[side].s, p.stages.done_progress)
            elif task == Task.DRESS:
                s = facts[side].s + (j + 1) * time_step * step
                other_fact = facts[1 - side]
                if other_fact.linked:
                    s = min(s, max(facts[side].s, other_fact.s + p.largest_lead))
                    if other_fact.s < p.stages.kept_progress:
                        s = min(s, p.stages.done_progress)
            else:
                k = 1 - side
                other = self._prepared(given, k, axes[j + 1][k], to, sleeves[k])
                s = self._waiting_progress(axis, other)
            s = min(p.final_progress, max(0.0, s))
            position[j], direction[j] = axis.G(s), axis.D(s)
        if task == Task.HOLD and not entering:
            # as far beside the arm as it is
            position = position + sleeves[side].p_c - axes[0][side].G(facts[side].s)
        if task == Task.REST:
            return SleeveTarget(position, direction, 0.0, 0.0)
        if entering:
            target = SleeveTarget(position, direction, direction_weight=way.emphasis, entering=True)
            if away:
                return target
            ahead = _ahead([a[side] for a in axes[1:]])
            target = replace(target, passage=ahead.into)
            if facts[side].hand_distance > p.near_distance:
                return target
            return replace(
                target,
                position_weight=p.near_position,
                direction_weight=p.near_direction * way.emphasis,
                corridor=ahead,
            )
        weight = p.dressing_position if facts[0].linked and facts[1].linked else 1.0
        return SleeveTarget(position, direction, weight, p.dressing_direction)

    def _swung(self, to: Heading, side: int, other: SleeveState) -> FloatArray:
        """Returns where a sleeve is swung back to, (3,) m, with the other one on its arm.

        Behind the first one, where the coat hangs free of the hand that was missed.
        """
        p = self.parameters
        way = -to.front - p.swing_outward * _inward(to, side)
        place: FloatArray = other.p_c + p.swing_reach * self._reach * way / np.linalg.norm(way)
        return place

    def _waiting_progress(self, axis: ArmAxis, other: FloatArray) -> float:
        """Returns the largest s from which the garment reaches `other` (3,), m (J_w).

        Higher up than that the garment holds the other sleeve back; lower down it could slip off.
        Never on the upper arm: an armhole whose coat hangs from there lies across its forearm.
        """
        p = self.parameters
        least = p.stages.waiting_progress
        steps = np.linspace(max(p.stages.highest_waiting_progress, least), least, 41)
        offset = axis.points(steps) - other
        reached = np.einsum("ij,ij->i", offset, offset) < (p.waiting_reach * self._reach) ** 2
        return float(steps[np.argmax(reached)]) if reached.any() else least


def _ahead(axes: Sequence[ArmAxis]) -> Corridor:
    """Returns the way ahead of a hand whose arm is predicted."""
    return Corridor(np.stack([a.G(0.0) for a in axes]), -np.stack([a.D(0.0) for a in axes]))


def _place(point: FloatArray) -> Place:
    x, y, z = (float(value) for value in point)
    return x, y, z


def _inward(to: Heading, side: int) -> FloatArray:
    """Returns the unit vector from a side of the person to the other."""
    return to.leftward * (-1.0 if side == 0 else 1.0)


def _opening(axis: ArmAxis, to: Heading, side: int) -> float:
    """Returns the inward part of a forearm's direction from hand to elbow."""
    return float(axis.D(0.0) @ _inward(to, side))


def _aside(offset: FloatArray, direction: FloatArray) -> float:
    """Returns the length of `offset` across the unit vector `direction`."""
    return float(np.linalg.norm(offset - direction * (direction @ offset)))


def _ramp(value: float, zero: float, one: float) -> float:
    """Returns 0 beyond `zero`, 1 beyond `one`, linear between."""
    return min(1.0, max(0.0, (value - zero) / (one - zero)))


def _between(a: FloatArray, b: FloatArray, share: float) -> FloatArray:
    """Returns the unit vector between unit vectors `a` (share 0) and `b` (share 1)."""
    mixed = (1.0 - share) * a + share * b
    unit: FloatArray = mixed / np.linalg.norm(mixed)
    return unit
