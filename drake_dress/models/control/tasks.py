"""Tasks of the sleeves, and the targets that follow from them: facts, stages, targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.corridor import Corridor
from drake_dress.models.control.preparing import (
    Preparation,
    choose_approach,
    distance_aside,
    opening,
)
from drake_dress.models.control.situation import SleeveTarget
from drake_dress.models.control.task_parameters import Approach, TaskParameters, unit
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
    StageState,
    Task,
    advance_stages,
    eases,
    look,
    retreats,
    swings,
    withdraws,
)
from drake_dress.models.garment.geodesics import Reach, reach
from drake_dress.models.garment.mesh import GarmentMesh, loop_length
from drake_dress.models.human.ability import are_alike, room_for_second
from drake_dress.models.human.arm import Arms
from drake_dress.models.human.heading import Heading, heading, headings

# Advance of s to the next waypoint of a sleeve on its arm.
_NEXT = 0.04


@dataclass(frozen=True)
class Assignment:
    """Tasks of both sleeves, left, then right, and the facts from which they follow.

    Attributes:
        tasks: of each. facts: of each. retreat: whether it stays away from the hand. ease: whether
            it moves back on its arm. attempts: how often it has missed the hand. outlook: place
            relative to the hand at which the hand sees the armhole, (3,) m; None if not needed.
            withdraw: whether both withdraw behind the person. swing: whether it swings back behind
            the person while the other one is on its arm.
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


class _Arm:
    """An arm at N + 1 times.

    Args:
        joints: (N+1,6,3) predicted, m; row 0 is now.
        side: of the arm.

    Attributes:
        shoulder, hand: (N+1,3) m. forearm: (N+1,3) unit, from hand to elbow.
    """

    def __init__(self, joints: FloatArray, side: int) -> None:
        own = joints[:, 3 * side : 3 * side + 3]
        self.shoulder, self._elbow, self.hand = (own[:, i] for i in range(3))
        self.forearm = unit(self._elbow - self.hand)
        self._moved = np.any(own[1:] != own[:-1], axis=(1, 2))

    @cached_property
    def axes(self) -> list[ArmAxis]:
        """The arm's axis at each time; the same object while the arm does not move."""
        axes: list[ArmAxis] = []
        for k, (hand, elbow, shoulder) in enumerate(
            zip(self.hand, self._elbow, self.shoulder, strict=True)
        ):
            stays = k > 0 and not self._moved[k - 1]
            axes.append(axes[-1] if stays else ArmAxis(hand, elbow, shoulder))
        return axes


class TaskPlanner:
    """Assigns tasks to the sleeves and computes their targets.

    Args:
        mesh: the controller's garment.
        parameters: settings.
        from_front: whether the garment comes from in front of the person. All targets are then the
            mirror images of those from behind: where they say behind, it is in front.
        arms: of the person and what they can do; both can do the same if None.
    """

    def __init__(
        self,
        mesh: GarmentMesh,
        parameters: TaskParameters,
        from_front: bool = False,
        arms: Arms | None = None,
    ) -> None:
        self.mesh = mesh
        self._from_front = from_front
        self.parameters = parameters
        self.armholes = (
            np.asarray(mesh.loops["left_armhole"]),
            np.asarray(mesh.loops["right_armhole"]),
        )
        self.signs = (float(loop_orientation(mesh, "left")), float(loop_orientation(mesh, "right")))
        centers = [mesh.rest_position[loop].mean(axis=0) for loop in self.armholes]
        self._reach = float(np.linalg.norm(centers[0] - centers[1]))
        left, right = (loop_length(mesh.rest_position, loop) for loop in self.armholes)
        self._radii = (left / (2.0 * np.pi), right / (2.0 * np.pi))
        self._rooms = (0.0, 0.0)
        if arms is not None and not are_alike(arms):
            left, right = (room_for_second(arms, i, self._reach, from_front) for i in (0, 1))
            self._rooms = (left, right)

    @cached_property
    def reach(self) -> Reach:
        """Largest distances between armholes and grippers of the garment."""
        return reach(self.mesh)

    @property
    def are_alike(self) -> bool:
        """Whether both arms can do the same, so that either may go first."""
        return self._rooms == (0.0, 0.0) and self.parameters.stages.first == "auto"

    def sleeves(self, x: FloatArray) -> tuple[SleeveState, SleeveState]:
        """Returns the states of left and right sleeve of the garment at `x` (n,3), m."""
        return (
            sleeve_state(x, self.armholes[0], self.signs[0]),
            sleeve_state(x, self.armholes[1], self.signs[1]),
        )

    def assign(
        self, stages: StageState, x: FloatArray, joints: FloatArray, time: float
    ) -> tuple[StageState, Assignment]:
        """Returns the new stages, and the assignment that follows from them.

        Args:
            stages: stages so far.
            x: (n,3) nodes of the garment now, m.
            joints: (6,3) shoulder, elbow, hand of left, then right arm now, m.
            time: current time, s.
        """
        p = self.parameters
        axes, to, sleeves = arm_axes(joints), self._heading(heading(joints)), self.sleeves(x)
        missed = stages.attempts
        linked = [self.is_linked(x, joints, side) for side in (0, 1)]
        ways = [
            choose_approach(p, axes[i].D(0.0), to, i, missed[i], linked[1 - i], self.mesh.hold)
            for i in (0, 1)
        ]
        facts = (
            self._facts(x, joints, axes[0], to, sleeves[0], 0, linked[0], ways[0]),
            self._facts(x, joints, axes[1], to, sleeves[1], 1, linked[1], ways[1]),
        )
        stages, facts = look(stages, facts, p.stages, time)
        goals = [self._waypoint(axes[i], to, facts[i], i, ways[i]) for i in (0, 1)]
        distance = float(np.linalg.norm(goals[0] - goals[1]))
        stages, tasks = advance_stages(stages, facts, p.stages, distance, time)
        return stages, Assignment(
            tasks,
            facts,
            (retreats(stages, 0, p.stages, time), retreats(stages, 1, p.stages, time)),
            (eases(stages, 0, facts, p.stages, time), eases(stages, 1, facts, p.stages, time)),
            stages.attempts,
            (
                self._outlook(x, joints[2], to, sleeves[0], 0, linked, missed[0]),
                self._outlook(x, joints[5], to, sleeves[1], 1, linked, missed[1]),
            ),
            withdraws(stages, facts, p.stages, time),
            (
                swings(stages, 0, facts, p.stages, time),
                swings(stages, 1, facts, p.stages, time),
            ),
        )

    def is_linked(self, x: FloatArray, joints: FloatArray, side: int) -> bool:
        """Returns whether an arm passes through its armhole.

        Args:
            x: (n,3) nodes of the garment, m.
            joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
            side: of the arm.
        """
        shoulder, elbow, hand = joints[3 * side : 3 * side + 3]
        interior = torso_interior(joints[0], joints[3])
        loop = x[self.armholes[side]]
        return abs(arm_linking_number(loop, shoulder, elbow, hand, interior)) == 1

    def are_on(self, x: FloatArray, joints: FloatArray) -> bool:
        """Returns whether both sleeves are on their arms, with a progress of `kept_progress`.

        Args:
            x: (n,3) nodes of the garment now, m.
            joints: (6,3) shoulder, elbow, hand of left, then right arm now, m.
        """
        least = self.parameters.stages.kept_progress
        sides = zip((0, 1), arm_axes(joints), self.sleeves(x), strict=True)
        return all(
            float(axis.coordinates(sleeve.p_c).s) >= least and self.is_linked(x, joints, side)
            for side, axis, sleeve in sides
        )

    def renewed(
        self, given: Assignment, sleeves: Sequence[SleeveState], joints: FloatArray
    ) -> Assignment:
        """Returns an assignment with the current progress of the sleeves on joints (6,3), m.

        All other facts, such as linking and sight, stay as given.
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
        """Returns the targets of both sleeves at each of N steps.

        Args:
            assignment: tasks of the sleeves.
            sleeves: their current states.
            joints: (N+1,6,3) predicted, m; row 0 is now.
            time_step: time between rows, s.
        """
        arms = (_Arm(joints, 0), _Arm(joints, 1))
        to = self._heading(headings(joints))
        return (
            self._target(assignment, 0, arms, to, sleeves, time_step),
            self._target(assignment, 1, arms, to, sleeves, time_step),
        )

    def toward(self, joints: FloatArray) -> Heading:
        """Returns the directions of the targets for joints (6,3), m."""
        return self._heading(heading(joints))

    def _heading(self, of_person: Heading) -> Heading:
        """Returns the directions of the targets for a person's heading."""
        return of_person.reversed if self._from_front else of_person

    def _outlook(
        self,
        x: FloatArray,
        hand: FloatArray,
        to: Heading,
        sleeve: SleeveState,
        side: int,
        linked: Sequence[bool],
        missed: int,
    ) -> FloatArray | None:
        """Returns the place, relative to the hand, at which the hand sees the armhole, (3,) m.

        None for a sleeve that is far from the hand or has not missed it. None also while a sleeve
        is on an arm, because a tethered sleeve goes around the hand.
        """
        near = np.linalg.norm(hand - sleeve.p_c) < self.parameters.outlook_distance
        if linked[0] or linked[1] or not near or missed == 0:
            return None
        loop, normal = self.armholes[side], sleeve.v_c
        move = move_into_sight(x, self.mesh.faces, loop, normal, hand, to.rotation.T)
        place: FloatArray = sleeve.p_c + move - hand
        return place

    def _waypoint(
        self, axis: ArmAxis, to: Heading, fact: SleeveFacts, side: int, way: Approach
    ) -> FloatArray:
        """Returns the next place a sleeve must reach: outside the hand, or further up its arm."""
        p = self.parameters
        if fact.linked:
            return axis.G(min(2.0, fact.s + _NEXT))
        return axis.G(0.0) - p.approach_distance * way.direction(axis.D(0.0), to, side)

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
        aside = distance_aside(offset, way.direction(axis.D(0.0), to, side))
        loop = self.armholes[side]
        sight = free_sight(x, self.mesh.faces, loop, hand)
        p = self.parameters
        near = p.edge_touch if self.mesh.hold == "edges" else p.touch_distance
        touches = not linked and distance_to_opening(x[loop], hand) < near
        return SleeveFacts(
            linked=linked,
            sight=1.0 if touches else sight,
            s=float(s) if linked else 0.0,
            hand_distance=float(np.linalg.norm(offset)),
            prepared_error=max(float(aside), 0.5 * float(np.linalg.norm(offset))),
            passed=0.0 if linked else float(s) * float(np.linalg.norm(elbow - hand)),
            opening=opening(axis.D(0.0), to, side),
            touches=touches,
            room=self._rooms[side],
            hand=_place(hand),
            away=_place(offset / max(float(np.linalg.norm(offset)), 1e-12)),
        )

    def _target(
        self,
        given: Assignment,
        side: int,
        arms: tuple[_Arm, _Arm],
        to: Heading,
        sleeves: Sequence[SleeveState],
        time_step: float,
    ) -> SleeveTarget:
        task = given.tasks[side]
        if task == Task.LAY:
            return self._target_laid(arms[side])
        if task in (Task.PREPARE, Task.REST) or not given.facts[side].linked:
            target = self._target_off_arm(given, side, arms[side], to, sleeves, time_step)
            if task == Task.REST:
                return SleeveTarget(target.position, target.direction, 0.0, 0.0)
            return target
        return self._target_on_arm(given, side, arms, to, sleeves, time_step)

    def _target_off_arm(
        self,
        given: Assignment,
        side: int,
        arm: _Arm,
        to: Heading,
        sleeves: Sequence[SleeveState],
        time_step: float,
    ) -> SleeveTarget:
        """Returns the target of a sleeve that approaches its hand or moves back from it."""
        p, fact = self.parameters, given.facts[side]
        preparation = self._preparation(given, side, arm, to, given.retreat[side])
        away = given.retreat[side] or given.swing[side] or given.withdraw
        hand, forearm, soon = arm.hand[1:], arm.forearm[1:], Heading(to.rotation[1:])
        if given.withdraw:
            position = arm.shoulder[1:] - p.withdrawal_distance * soon.front
        elif given.swing[side]:
            position = self._swung(soon, side, sleeves[1 - side])
        elif fact.touches and not away and preparation.lifts(forearm[0]):
            position = preparation.through(hand, forearm, sleeves[side])
        elif fact.touches and not away:
            times = time_step * np.arange(1, len(hand) + 1)
            drawn = zip(arm.axes[1:], p.progress_rate * times, strict=True)
            position = np.stack([axis.G(s) for axis, s in drawn])
        else:
            position = preparation.places(hand, forearm, soon, sleeves[side])
        way = preparation.way
        target = SleeveTarget(
            position,
            way.entry(forearm, soon, side),
            direction_weight=way.emphasis,
            entering=True,
        )
        if away:
            return target
        corridor = Corridor(hand, -forearm)
        target = replace(target, passage=corridor.into)
        if fact.hand_distance > p.near_distance:
            return target
        return replace(
            target,
            position_weight=p.near_position,
            direction_weight=p.near_direction * way.emphasis,
            corridor=corridor,
        )

    def _target_on_arm(
        self,
        given: Assignment,
        side: int,
        arms: tuple[_Arm, _Arm],
        to: Heading,
        sleeves: Sequence[SleeveState],
        time_step: float,
    ) -> SleeveTarget:
        """Returns the target of a sleeve that is drawn up its arm, waits on it, or is held."""
        p, fact, task, mine = self.parameters, given.facts[side], given.tasks[side], arms[side].axes
        n = len(mine) - 1
        if task == Task.HOLD:
            progress = [max(fact.s, p.held_progress)] * n
        elif task == Task.DRESS:
            times = [j * time_step for j in range(1, n + 1)]
            outward = np.stack([a.outward(fact.s) for a in mine[1:]])
            bend = float(np.linalg.norm(outward[0]))
            progress = self._drawn_progress(given, side, times, bend)
        else:
            k = 1 - side
            other, soon = self._preparation(given, k, arms[k], to), Heading(to.rotation[1:])
            places = other.places(arms[k].hand[1:], arms[k].forearm[1:], soon, sleeves[k])
            if given.facts[k].hand_distance < p.near_distance:
                # moving up or down, it would draw the other armhole away from its hand
                stays = max(fact.s, p.stages.waiting_progress)
                reached = self._reaching(mine, places, p.longest_reach)
                progress = [min(s, stays) for s in reached]
            else:
                progress = self._reaching(mine, places, p.waiting_reach)
        progress = [min(p.final_progress, max(0.0, s)) for s in progress]
        position = np.stack([a.G(s) for a, s in zip(mine[1:], progress, strict=True)])
        direction = np.stack([a.D(s) for a, s in zip(mine[1:], progress, strict=True)])
        if task == Task.DRESS:
            position = position + p.elbow_outward * outward
        if task == Task.WAIT:
            position = position + self._aside(position, places)
        if task == Task.HOLD:
            # keeps its current offset from the arm
            position = position + sleeves[side].p_c - mine[0].G(fact.s)
        both = given.facts[0].linked and given.facts[1].linked
        slips = task == Task.WAIT and fact.s < p.stages.waiting_progress
        weight = p.dressing_position if both or slips else 1.0
        return SleeveTarget(position, direction, weight, p.dressing_direction)

    @staticmethod
    def _target_laid(arm: _Arm) -> SleeveTarget:
        """Returns the target of a sleeve while the coat is laid: none, at the shoulder."""
        direction = np.stack([axis.D(2.0) for axis in arm.axes[1:]])
        return SleeveTarget(arm.shoulder[1:], direction, 0.0, 0.0)

    def _drawn_progress(
        self, given: Assignment, side: int, times: Sequence[float], bend: float
    ) -> list[float]:
        """Returns the target s of a sleeve on its arm at `times` from now, s.

        It leads the other sleeve by at most `largest_lead`, and goes no further than
        `done_progress` until the other one reaches `kept_progress`. At a bent elbow, `bend` is the
        length of `ArmAxis.outward`, it goes little ahead. An easing sleeve moves back.
        """
        p, fact, other = self.parameters, given.facts[side], given.facts[1 - side]
        rate = -p.progress_rate if given.ease[side] else p.progress_rate
        largest = np.inf
        if other.linked:
            largest = max(fact.s, other.s + p.largest_lead)
            if other.s < p.stages.kept_progress:
                largest = min(largest, p.stages.done_progress)
        if bend > 0.0:
            largest = min(largest, fact.s + p.elbow_lead / bend)
        return [min(fact.s + t * rate, largest) for t in times]

    def _preparation(
        self, given: Assignment, side: int, arm: _Arm, to: Heading, retreat: bool = False
    ) -> Preparation:
        p, now = self.parameters, Heading(to.rotation[0])
        missed, tethered = given.attempts[side], given.facts[1 - side].linked
        return Preparation(
            p,
            side,
            given.facts[side],
            choose_approach(p, arm.forearm[0], now, side, missed, tethered, self.mesh.hold),
            tethered,
            missed,
            given.outlook[side],
            retreat,
            self.mesh.hold,
            self._radii[side],
        )

    def _swung(self, to: Heading, side: int, other: SleeveState) -> FloatArray:
        """Returns the places (N,3), m, to which a sleeve swings while the other is on its arm.

        They are behind the first sleeve, where the coat hangs free of the missed hand.
        """
        p = self.parameters
        way = -to.front - p.swing_outward * to.inward(side)
        place: FloatArray = other.p_c + p.swing_reach * self._reach * unit(way)
        return place

    def _aside(self, waiting: FloatArray, other: FloatArray) -> FloatArray:
        """Returns the lateral motion (N,3), m, of a waiting sleeve; the arm in it comes along.

        It is what the stretched garment lacks from `waiting` (N,3), m, to the target of the other
        sleeve, `other` (N,3), m.
        """
        p, way = self.parameters, other - waiting
        length = np.linalg.norm(way, axis=1, keepdims=True)
        lacking = np.clip(length - p.longest_reach * self._reach, 0.0, p.largest_aside)
        aside: FloatArray = way * (lacking / np.maximum(length, p.largest_aside))
        return aside

    def _reaching(self, axes: Sequence[ArmAxis], others: FloatArray, share: float) -> list[float]:
        """Returns the largest s at N times from which the garment reaches `others` (N,3), m.

        Higher up the arm, the garment would hold the other sleeve back. Below `waiting_progress`
        the sleeve could slip off (J_w).

        Args:
            axes: (N + 1) axes of the arm, the first one now.
            others: (N,3) targets of the other sleeve, m.
            share: reach of the garment, as a share of the distance between both armholes at rest.
        """
        steps = np.linspace(2.0, self.parameters.stages.waiting_progress, 41)
        progress: list[float] = []
        for j, (axis, place) in enumerate(zip(axes[1:], others, strict=True)):
            if j > 0 and axis is axes[j] and np.array_equal(place, others[j - 1]):
                progress.append(progress[-1])
                continue
            offset = axis.points(steps) - place
            reached = np.einsum("ij,ij->i", offset, offset) < (share * self._reach) ** 2
            progress.append(float(steps[np.argmax(reached)] if reached.any() else steps[-1]))
        return progress


def _place(point: FloatArray) -> Place:
    x, y, z = (float(value) for value in point)
    return x, y, z
