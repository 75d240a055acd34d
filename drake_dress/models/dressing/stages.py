"""Stages of both sleeves, and the task of each sleeve that follows from them.

A sleeve is prepared (brought behind the hand), dressed (drawn up the arm), and done. With two
sleeves of one coat, the paper prepares only the nearer one while the garment cannot reach both
hands. That sleeve then waits on its arm while the other one is prepared, and both are drawn up
together. Once both are on, both are held. Drawn further, they pull against each other, and one
slips down again; released, they slip as well.

Three things differ from the paper, all based on measurements. The garment's reach is compared with
the distance of the two targets, not of the two armholes, which rises to the limit first and makes
the task flicker. The first sleeve is that of the arm that can do less, and of two able arms that of
the arm that opens less, not the nearer one: of eleven dressings exactly those failed in which that
arm came second. A sleeve counts as on its arm by the
linking number of its armhole, because the progress s alone also rises when the armhole slides up
beside the arm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

from drake_dress.models.sides import SIDES

FIRST = ("auto", *SIDES)


class Stage(IntEnum):
    """Stage of one sleeve, as written in the log."""

    PREPARE = 0
    DRESS = 1
    DONE = 2


class Task(IntEnum):
    """Task of one sleeve, which selects its cost."""

    REST = 0  # no cost: the gripper serves the other sleeve
    PREPARE = 1  # J_p
    DRESS = 2  # J_d
    WAIT = 3  # J_w
    HOLD = 4  # both are done: the sleeve keeps its place on the arm
    LAY = 5  # no cost of its own: the collar is brought to the nape


Place = tuple[float, float, float]


@dataclass(frozen=True)
class SleeveFacts:
    """Facts about one sleeve that determine its stage.

    Attributes:
        linked: whether the arm passes through the armhole.
        s: progress of the armhole along its arm; 0 where not linked.
        hand_distance: distance from the armhole centre to the hand, m.
        prepared_error: error of the armhole centre relative to its prepared position, m.
        passed: distance along the arm by which the armhole centre has passed the hand beside the
            arm, m; 0 before the hand.
        sight: share of the opening that the hand sees without the garment in between.
        opening: inward component of the forearm's direction from hand to elbow, -1 to 1: how far
            the arm opens sideways.
        touches: whether the hand is at the opening already, about to enter.
        room: volume in which the hand can come to a second sleeve, m³; 0 for both hands if the
            arms are alike.
        hand: position of the hand, m; away: unit vector from the armhole's centre to it.
    """

    linked: bool
    s: float
    hand_distance: float
    prepared_error: float
    passed: float
    sight: float = 1.0
    opening: float = 0.0
    touches: bool = False
    room: float = 0.0
    hand: Place = (0.0, 0.0, 0.0)
    away: Place = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class StageParameters:
    """Thresholds of the switching.

    Attributes:
        prepared_distance: distance from its prepared position below which a sleeve may be dressed,
            m (φ_p).
        least_sight: share of the opening that the hand must see before the sleeve is drawn over it.
        lost_sight: share below which the garment blocks the hand. It is lower than `least_sight`,
            because the visible share fluctuates while cloth moves, and an armhole that turned back
            each time would never arrive.
        sight_time: time for which a hand still counts as seeing an armhole that it is about to
            meet, s. At 10 cm the rim and the panel beside it hide most of what was seen from 15 cm.
        missed_distance: distance past the hand, without the arm inside, at which an armhole
            withdraws, m.
        waiting_progress: lowest s at which a sleeve waits for the other one (bound of ŝ_f).
        done_progress: progress s above which a sleeve is done.
        kept_progress: progress s above which a sleeve stays done, and above which a sleeve that
            makes no more progress is done.
        reach: greatest distance between the armholes, m (φ_c).
        meeting_distance: distance from the hand below which an armhole meets it, m.
        pushed_distance: distance that a hand moves ahead of an armhole above which the garment
            pushes the hand instead of enclosing it, m. The armhole then withdraws before the arm
            has been pushed to where no hand can enter.
        entering_distance: the same while the hand is at the opening already, m. An arm that yields
            has to be carried along until its hand slips in.
        lingering_distance: distance from the hand below which `lingering_timeout` counts, m.
        lingering_timeout: time near the hand after which an armhole withdraws, s. Of 22 hands that
            entered, 19 did so within 2.6 s.
        insertion_timeout: time after which a dressing without insertion withdraws, s.
        barred_distance: distance below which an armhole that is blocked from the hand withdraws, m.
        barred_timeout: shortest time that a sleeve is prepared before it may withdraw as blocked,
            s.
        stall_timeout: time without progress after which a sleeve eases, s. It doubles with each
            earlier stall at the same place; a sleeve that does not come free creeps on.
        stall_progress: advance of s that counts as progress.
        easing_time: time for which a stalled sleeve eases, s.
        creeping_progress: progress s above which a sleeve does not ease, because all sleeves crept
            on so near the shoulder.
        retreat_time: time for which a withdrawn sleeve stays away from the hand, s.
        withdrawal_after: both sleeves withdraw behind the person each time that the first hand has
            been missed this many times. A coat that hangs over an arm misses it again and again.
        withdrawal_time: duration of that withdrawal, s.
        swing_after: the second sleeve swings back behind the person each time that its hand has
            been missed this many times, while the first one stays on its arm.
        swing_time: duration of that swing, s.
        alike: difference in opening below which two arms are treated as equal.
        alike_room: ratio of the rooms in which two hands can come to the second sleeve above which
            both arms are treated as equal (models/human/ability.py).
        first: arm that goes first, `left`, `right`, or `auto`: the one that can do less, and if
            both can do the same, the one that opens less sideways.
    """

    prepared_distance: float = 0.03
    least_sight: float = 0.5
    lost_sight: float = 0.25
    sight_time: float = 1.3
    missed_distance: float = 0.08
    waiting_progress: float = 0.3
    done_progress: float = 1.925
    kept_progress: float = 1.91
    reach: float = 0.45
    meeting_distance: float = 0.2
    pushed_distance: float = 0.06
    entering_distance: float = 0.15
    lingering_distance: float = 0.12
    lingering_timeout: float = 4.0
    insertion_timeout: float = 8.0
    barred_distance: float = 0.4
    barred_timeout: float = 5.0
    stall_timeout: float = 3.0
    stall_progress: float = 0.03
    easing_time: float = 1.5
    creeping_progress: float = 1.89
    retreat_time: float = 2.5
    withdrawal_after: int = 2
    withdrawal_time: float = 4.0
    swing_after: int = 6
    swing_time: float = 4.0
    alike: float = 0.03
    alike_room: float = 0.7
    first: str = "auto"


@dataclass(frozen=True)
class StageState:
    """Stages of left and right sleeve, and the memory that switching them needs.

    Attributes:
        stage: of each sleeve; since: time at which it began, s.
        first: sleeve that goes first, -1 before it is known.
        attempts: how often each sleeve missed the hand.
        best: greatest s since the last stall; best_time: time at which it was reached, s.
        stalls: number of stalls of each sleeve without progress since; stalled: s of these stalls.
        met: position of the hand when the armhole met it, m, or at its closest since; None while it
            does not meet it.
        close_since: time since which the armhole is close to the hand, s; None while it is not.
        seen: time at which the hand last saw the armhole that meets it, s; None if it did not since
            a miss.
    """

    stage: tuple[Stage, Stage] = (Stage.PREPARE, Stage.PREPARE)
    first: int = -1
    since: tuple[float, float] = (0.0, 0.0)
    attempts: tuple[int, int] = (0, 0)
    best: tuple[float, float] = (0.0, 0.0)
    best_time: tuple[float, float] = (0.0, 0.0)
    stalls: tuple[int, int] = (0, 0)
    stalled: tuple[float, float] = (0.0, 0.0)
    met: tuple[Place | None, Place | None] = (None, None)
    close_since: tuple[float | None, float | None] = (None, None)
    seen: tuple[float | None, float | None] = (None, None)


def advance_stages(
    state: StageState,
    facts: tuple[SleeveFacts, SleeveFacts],
    parameters: StageParameters,
    target_distance: float,
    time: float,
) -> tuple[StageState, tuple[Task, Task]]:
    """Returns the new stages, and the tasks of left and right sleeve.

    Args:
        state: stages so far.
        facts: of left and right sleeve.
        parameters: thresholds.
        target_distance: between the targets of both sleeves if each were treated alone, m.
        time: current time, s.
    """
    if withdraws(state, facts, parameters, time):
        return state, (Task.PREPARE, Task.PREPARE)
    for side in (0, 1):
        state = _meet(state, side, facts[side], parameters, time)
        state = _advance(state, side, facts, parameters, time)
        state = _remember(state, side, facts, parameters, time)
    on_arm = [facts[i].linked and state.stage[i] != Stage.PREPARE for i in (0, 1)]
    if state.first < 0:
        state = replace(state, first=_choose_first(facts, parameters))
    if on_arm[1 - state.first] and not on_arm[state.first]:
        state = replace(state, first=1 - state.first)
    if all(stage == Stage.DONE for stage in state.stage):
        return state, (Task.HOLD, Task.HOLD)
    tasks = _tasks(state, facts, on_arm, parameters, target_distance)
    if tasks[1 - state.first] == Task.REST and not any(on_arm):
        # the time limit of its preparation has not started
        state = _with(state, 1 - state.first, since=time)
    return state, tasks


def _tasks(
    state: StageState,
    facts: tuple[SleeveFacts, SleeveFacts],
    on_arm: list[bool],
    parameters: StageParameters,
    target_distance: float,
) -> tuple[Task, Task]:
    """Returns the tasks of left and right sleeve if not both are done.

    Args:
        state: stages, with the sleeve that goes first.
        facts: of left and right sleeve.
        on_arm: whether each sleeve is on its arm.
        parameters: thresholds.
        target_distance: between the targets of both sleeves if each were treated alone, m.
    """
    n = state.first
    f = 1 - n
    tasks = [Task.REST, Task.REST]
    if all(on_arm) or target_distance < parameters.reach:
        for side in (0, 1):
            tasks[side] = Task.PREPARE if state.stage[side] == Stage.PREPARE else Task.DRESS
    elif state.stage[n] == Stage.PREPARE:
        tasks[n] = Task.PREPARE
    elif not on_arm[n]:
        tasks[n] = Task.DRESS
    else:
        tasks[n] = Task.WAIT
        if facts[n].s >= 0.6 * parameters.waiting_progress:
            tasks[f] = Task.PREPARE if state.stage[f] == Stage.PREPARE else Task.DRESS
    return tasks[0], tasks[1]


def look(
    state: StageState,
    facts: tuple[SleeveFacts, SleeveFacts],
    parameters: StageParameters,
    time: float,
) -> tuple[StageState, tuple[SleeveFacts, SleeveFacts]]:
    """Returns the stages with the hands' current sight, and facts in which recent sight counts.

    Args:
        state: stages so far.
        facts: of left and right sleeve.
        parameters: thresholds.
        time: current time, s.
    """
    kept = list(facts)
    for side, fact in enumerate(facts):
        meets = fact.hand_distance < parameters.meeting_distance and not fact.linked
        seen = state.seen[side]
        if meets and fact.sight >= parameters.least_sight:
            state = _with(state, side, seen=time)
        elif meets and seen is not None and time - seen < parameters.sight_time:
            kept[side] = replace(fact, sight=1.0)
    return state, (kept[0], kept[1])


def _choose_first(facts: tuple[SleeveFacts, SleeveFacts], p: StageParameters) -> int:
    """Returns the sleeve that goes first: that of the arm that can do less, or opens less sideways.

    An arm that cannot come to the second sleeve has to be in the first one. An arm that opens less
    sideways lies in the plane of an armhole that comes from outside. The garment has to turn for
    it, which it cannot while it hangs on the other arm. If both arms are alike, the nearer one is
    first.
    """
    if p.first in SIDES:
        return SIDES.index(p.first)
    left, right = facts[0].room, facts[1].room
    if min(left, right) < p.alike_room * max(left, right):
        return 0 if left < right else 1
    difference = facts[0].opening - facts[1].opening
    if abs(difference) > p.alike:
        return 0 if difference < 0.0 else 1
    return 0 if facts[0].hand_distance <= facts[1].hand_distance else 1


def _advance(
    state: StageState,
    side: int,
    facts: tuple[SleeveFacts, SleeveFacts],
    p: StageParameters,
    time: float,
) -> StageState:
    stage, fact = state.stage[side], facts[side]
    new = stage
    if fact.linked:
        settled = stage == Stage.DONE or time - state.best_time[side] > p.stall_timeout
        enough = p.kept_progress if settled else p.done_progress
        new = Stage.DONE if fact.s >= enough else Stage.DRESS
    elif _pushes(state, side, fact, p) or (not fact.touches and _lingers(state, side, p, time)):
        return _again(state, side, time)
    elif stage == Stage.PREPARE:
        if fact.prepared_error < p.prepared_distance and fact.sight >= p.least_sight:
            new = Stage.DRESS
        elif _stuck(fact, p, time - state.since[side] - _kept_away(state, side, facts, p)):
            return _again(state, side, time)
    elif (
        fact.passed > p.missed_distance
        or fact.sight < p.lost_sight
        or time - state.since[side] > p.insertion_timeout
        or stage == Stage.DONE
    ):
        return _again(state, side, time)
    return state if new == stage else _with(state, side, stage=new, since=time)


def _with(state: StageState, side: int, **values: Any) -> StageState:
    """Returns the state with the given fields changed for one sleeve."""
    changed: dict[str, Any] = {}
    for name, value in values.items():
        left, right = getattr(state, name)
        changed[name] = (value, right) if side == 0 else (left, value)
    return replace(state, **changed)


def _lingers(state: StageState, side: int, p: StageParameters, time: float) -> bool:
    since = state.close_since[side]
    return since is not None and time - since > p.lingering_timeout


def _meet(
    state: StageState, side: int, fact: SleeveFacts, p: StageParameters, time: float
) -> StageState:
    """Returns the state with the place and time at which the armhole meets its hand.

    If the hand comes nearer by itself, its new place counts.
    """
    met, close = state.met[side], state.close_since[side]
    if fact.linked or fact.hand_distance > p.lingering_distance:
        close = None
    elif close is None:
        close = time
    if fact.linked or fact.hand_distance > p.meeting_distance:
        met = None
    elif met is None or _pushed(state, side, fact) < 0.0:
        met = fact.hand
    return _with(state, side, met=met, close_since=close)


def _pushed(state: StageState, side: int, fact: SleeveFacts) -> float:
    """Returns how far, m, a hand has moved ahead of the armhole that meets it."""
    met = state.met[side]
    if met is None:
        return 0.0
    return sum((h - m) * a for h, m, a in zip(fact.hand, met, fact.away, strict=True))


def _pushes(state: StageState, side: int, fact: SleeveFacts, p: StageParameters) -> bool:
    """Returns whether the garment pushes a hand ahead rather than enclosing it."""
    largest = p.entering_distance if fact.touches else p.pushed_distance
    return _pushed(state, side, fact) > largest


def _remember(
    state: StageState,
    side: int,
    facts: tuple[SleeveFacts, SleeveFacts],
    p: StageParameters,
    time: float,
) -> StageState:
    """Returns the state with the progress of one sleeve; a waiting sleeve does not stall."""
    fact, other = facts[side], facts[1 - side]
    further = fact.s > state.stalled[side] + p.stall_progress
    if state.stalls[side] > 0 and (further or state.stage[side] != Stage.DRESS):
        state = _with(state, side, stalls=0, stalled=0.0)
    over = time - state.best_time[side] > _patience(state, side, p) + p.easing_time
    if fact.linked and fact.s <= state.best[side] + p.stall_progress and other.s >= fact.s:
        if not over:
            return state
        if eases(state, side, facts, p, time):
            stalled = max(state.stalled[side], state.best[side])
            state = _with(state, side, stalls=state.stalls[side] + 1, stalled=stalled)
    return _with(state, side, best=fact.s, best_time=time)


def _patience(state: StageState, side: int, p: StageParameters) -> float:
    """Returns the time without progress, s, after which a sleeve eases."""
    return p.stall_timeout * 2.0 ** min(state.stalls[side], 4)


def eases(
    state: StageState,
    side: int,
    facts: tuple[SleeveFacts, SleeveFacts],
    parameters: StageParameters,
    time: float,
) -> bool:
    """Returns whether a sleeve stalled on its arm and has to ease before it is drawn again."""
    return (
        state.stage[side] == Stage.DRESS
        and facts[side].s < parameters.creeping_progress
        and time - state.best_time[side] > _patience(state, side, parameters)
    )


def _stuck(fact: SleeveFacts, p: StageParameters, duration: float) -> bool:
    """Returns whether a sleeve has been prepared for too long, near the hand or blocked from it."""
    barred = fact.sight < p.lost_sight and fact.hand_distance < p.barred_distance
    return (barred and duration > p.barred_timeout) or (
        fact.hand_distance < p.reach and duration > 2.0 * p.insertion_timeout
    )


def _again(state: StageState, side: int, time: float) -> StageState:
    """Returns the state in which a sleeve that missed the hand starts again."""
    return _with(
        state,
        side,
        stage=Stage.PREPARE,
        since=time,
        attempts=state.attempts[side] + 1,
        met=None,
        close_since=None,
        seen=None,
    )


def withdraws(
    state: StageState,
    facts: tuple[SleeveFacts, SleeveFacts],
    parameters: StageParameters,
    time: float,
) -> bool:
    """Returns whether both sleeves withdraw behind the person before the next attempt."""
    if state.first < 0:
        return False
    return _just_began(state, state.first, _withdrawn(state, facts, parameters), time)


def _withdrawn(
    state: StageState, facts: tuple[SleeveFacts, SleeveFacts], p: StageParameters
) -> float:
    """Returns how long, s, both sleeves withdraw behind the person after the last miss."""
    due = _is_due(state.attempts[state.first], p.withdrawal_after)
    return p.withdrawal_time if due and not (facts[0].linked or facts[1].linked) else 0.0


def swings(
    state: StageState,
    side: int,
    facts: tuple[SleeveFacts, SleeveFacts],
    parameters: StageParameters,
    time: float,
) -> bool:
    """Returns whether a sleeve swings back behind the person while the other is on its arm."""
    return _just_began(state, side, _swung(state, side, facts, parameters), time)


def _swung(
    state: StageState, side: int, facts: tuple[SleeveFacts, SleeveFacts], p: StageParameters
) -> float:
    """Returns how long, s, a sleeve swings back after the last miss."""
    due = _is_due(state.attempts[side], p.swing_after)
    return p.swing_time if due and facts[1 - side].linked and not facts[side].linked else 0.0


def _kept_away(
    state: StageState, side: int, facts: tuple[SleeveFacts, SleeveFacts], p: StageParameters
) -> float:
    """Returns how long, s, a sleeve stays far from its hand after the last miss."""
    return _withdrawn(state, facts, p) + _swung(state, side, facts, p)


def retreats(state: StageState, side: int, parameters: StageParameters, time: float) -> bool:
    """Returns whether a sleeve has just missed the hand and has to stay away from it."""
    missed = state.attempts[side] > 0
    return missed and _just_began(state, side, parameters.retreat_time, time)


def _is_due(missed: int, every: int) -> bool:
    """Returns whether the number of misses is a multiple of `every`, and not zero."""
    return missed > 0 and missed % every == 0


def _just_began(state: StageState, side: int, lasting: float, time: float) -> bool:
    """Returns whether the preparation of a sleeve began less than `lasting`, s, ago."""
    return state.stage[side] == Stage.PREPARE and time - state.since[side] < lasting
