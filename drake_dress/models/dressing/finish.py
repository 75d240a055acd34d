"""What follows once both sleeves are on: the coat is laid on the shoulders and let go.

    DRESSING   both sleeves are done, or hang on lowered arms ──▶ LAYING
    LAYING     the collar lies on the nape ──▶ LAID;  a sleeve is lost ──▶ DRESSING
    LAID       the grippers have opened ──▶ RELEASED
    RELEASED   the grippers move away

A coat that hangs from the grippers is not on: its collar is at the height of the ears.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.dressing.stages import SleeveFacts, Stage


class Phase(IntEnum):
    """Phase of both sleeves together."""

    DRESSING = 0
    LAYING = 1
    LAID = 2
    RELEASED = 3


class On(IntEnum):
    """Whether both sleeves are on."""

    NO = 0
    HANGING = 1  # on the shoulders of lowered arms
    DONE = 2


# Stages of both sleeves in these phases, as written in the log, after those of `Stage`.
LAY, RELEASED = 3, 4


# By how much s may fall again before a person who was told to lower the arms raises them.
_LOWERED_MARGIN = 0.3
# By how much s sinks as a coat is laid.
_SINKING = 0.15


@dataclass(frozen=True)
class FinishParameters:
    """Settings of laying the coat and letting it go.

    Attributes:
        release: whether the coat is laid and let go. If not, the grippers hold it in the end.
        laid_distance: distance of the collar from its place below which the coat is laid, m.
        open_distance: greatest distance of the collar from the nape at which the grippers open if
            the collar comes no nearer to its place, m. A high collar may lie higher on the nape.
        stall_time: time without progress after which the collar counts as coming no nearer, s.
        stall_progress: approach of the collar that counts as progress, m.
        lowering_progress: progress s of both sleeves from which on the person is told to lower the
            arms if one of them stalls. 1 is the elbow.
        hanging_progress: progress s of both sleeves from which on they are on although they are not
            done, if the arms hang. The centre of an armhole that hangs on the shoulder of a lowered
            arm is at 1.55 to 1.9, lower on thick arms; at 1.5 its upper edge begins to leave the
            shoulder.
        hanging_angle: greatest angle of the upper arms to the vertical at which they hang, rad.
        hanging_time: time for which they hang there before the coat is laid, s: they may come
            further.
        steady_time: time for which both sleeves are on before the coat is laid, s. A sleeve that
            its taut coat draws back by the next decision is drawn on again first.
        least_time: shortest time for which the coat is laid, s. The person lowers the arms
            meanwhile.
        lost_progress: progress s of a sleeve below which it counts as lost. The centre of an
            armhole sinks from 1.95 to 1.8 as the coat is laid.
        gripper_height: least distance of the grippers from the skin while the coat is laid, m. The
            robot's hands keep 3 cm.
        max_speed: greatest speed of a gripper while the coat is laid, m/s.
        away_speed: speed at which the grippers move away, m/s.
        away_distance: distance that they move, m.
        front_distance: distance in front of the shoulders from which on they move away to the
            front rather than backward and upward, m.
        watch_time: time from the release to the end of a run, s.
    """

    release: bool = True
    laid_distance: float = 0.015
    open_distance: float = 0.04
    stall_time: float = 2.0
    stall_progress: float = 0.005
    lowering_progress: float = 1.05
    hanging_progress: float = 1.65
    hanging_angle: float = 0.6
    hanging_time: float = 3.0
    steady_time: float = 0.4
    least_time: float = 3.5
    lost_progress: float = 1.6
    gripper_height: float = 0.04
    max_speed: float = 0.06
    away_speed: float = 0.1
    away_distance: float = 0.25
    front_distance: float = 0.05
    watch_time: float = 3.0


@dataclass(frozen=True)
class FinishState:
    """Phase, and the memory that switching needs.

    Attributes:
        phase: of both sleeves.
        best: least distance of the collar from its place while it is laid, m.
        since: time of `best`, or at which the phase RELEASED began, s.
        begun: time at which the phase LAYING began, s.
        on_since: time since which both sleeves are done or hang, s; None while one does not.
        least: progress s of a sleeve below which it counts as lost while the coat is laid.
    """

    phase: Phase = Phase.DRESSING
    best: float = float("inf")
    since: float = 0.0
    begun: float = 0.0
    on_since: float | None = None
    least: float = 0.0

    def stages(self, given: tuple[Stage, Stage]) -> tuple[int, int]:
        """Returns the stages of left and right sleeve as logged, `given` those of the dressing."""
        if self.phase == Phase.DRESSING:
            return int(given[0]), int(given[1])
        return (RELEASED, RELEASED) if self.phase == Phase.RELEASED else (LAY, LAY)


def advance_finish(
    state: FinishState,
    on: On,
    facts: tuple[SleeveFacts, SleeveFacts],
    off: float,
    from_nape: float,
    are_open: bool,
    parameters: FinishParameters,
    time: float,
) -> FinishState:
    """Returns the new state.

    Args:
        state: state so far.
        on: whether both sleeves are on, from `sleeves_on`.
        facts: of left and right sleeve.
        off: distance of the collar from its place, m.
        from_nape: distance of the collar from the nearest point of the nape, m.
        are_open: whether both grippers have opened.
        parameters: settings.
        time: current time, s.
    """
    p = parameters
    if state.phase == Phase.RELEASED or not p.release:
        return state
    if are_open:
        return replace(state, phase=Phase.RELEASED, since=time)
    if state.phase == Phase.DRESSING:
        return _begun(state, on, off, p, time)
    if any(not fact.linked or fact.s < state.least for fact in facts):
        return FinishState()
    if state.phase == Phase.LAID:
        return state
    if off < state.best - p.stall_progress:
        state = replace(state, best=off, since=time)
    if time - state.begun < p.least_time:
        return state
    stalled = time - state.since > p.stall_time
    if off < p.laid_distance or (stalled and from_nape < p.open_distance):
        return replace(state, phase=Phase.LAID)
    return state


def may_lower(
    was_told: bool,
    state: FinishState,
    stalls: tuple[int, int],
    facts: tuple[SleeveFacts, SleeveFacts],
    parameters: FinishParameters,
) -> bool:
    """Returns whether the person is told to lower the arms.

    That is while the coat is laid. Before, it is also once both armholes are past the elbows and
    one of them makes no more progress: an arm that is held back and bent lets no sleeve over its
    elbow, and its sleeve pulls it straight at the shoulder, which moves nothing.

    Args:
        was_told: whether the person was told before.
        state: of the finish.
        stalls: number of stalls of left and right sleeve at the same place.
        facts: of left and right sleeve.
        parameters: settings.
    """
    if state.phase != Phase.DRESSING:
        return True
    if not parameters.release:
        return False
    least = parameters.lowering_progress - (_LOWERED_MARGIN if was_told else 0.0)
    past = all(fact.linked and fact.s >= least for fact in facts)
    return past and (was_told or any(n > 0 for n in stalls))


def sleeves_on(
    stages: tuple[Stage, Stage],
    facts: tuple[SleeveFacts, SleeveFacts],
    joints: FloatArray,
    parameters: FinishParameters,
) -> On:
    """Returns whether both sleeves are on.

    Args:
        stages: of left and right sleeve.
        facts: of left and right sleeve.
        joints: (6,3) shoulder, elbow, hand of left, then of right arm, m.
        parameters: settings.
    """
    if all(stage == Stage.DONE for stage in stages):
        return On.DONE
    high = all(fact.linked and fact.s >= parameters.hanging_progress for fact in facts)
    return On.HANGING if high and arms_hang(joints, parameters.hanging_angle).all() else On.NO


def arms_hang(joints: FloatArray, angle: float) -> BoolArray:
    """Returns (...,2) whether left and right upper arm are within an angle, rad, of the vertical.

    Args:
        joints: (...,6,3) shoulder, elbow, hand of left, then of right arm, m.
        angle: greatest angle, rad.
    """
    upper = joints[..., [0, 3], :] - joints[..., [1, 4], :]
    return np.asarray(upper[..., 2] >= math.cos(angle) * np.linalg.norm(upper, axis=-1))


def _begun(state: FinishState, on: On, off: float, p: FinishParameters, time: float) -> FinishState:
    """Returns the new state of a dressing: laying, once both sleeves are on for long enough."""
    if on == On.NO:
        return replace(state, on_since=None)
    done = on == On.DONE
    since = time if state.on_since is None else state.on_since
    if time - since < (p.steady_time if done else p.hanging_time):
        return replace(state, on_since=since)
    least = p.lost_progress if done else min(p.lost_progress, p.hanging_progress - _SINKING)
    return FinishState(Phase.LAYING, off, time, time, least=least)
