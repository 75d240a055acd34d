from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.dressing.stages import (
    SleeveFacts,
    Stage,
    StageParameters,
    StageState,
    Task,
    advance_stages,
    eases,
    look,
    retreats,
    swings,
    withdraws,
)

P = StageParameters(reach=0.45, waiting_progress=0.5)
FAR, NEAR = 0.9, 0.3


def facts(
    linked: bool = False, s: float = 0.0, hand: float = 0.5, error: float = 0.5
) -> SleeveFacts:
    return SleeveFacts(linked, s, hand, error, passed=0.0)


def test_nearer_sleeve_goes_first_while_the_garment_reaches_one_hand_only() -> None:
    _, tasks = advance_stages(StageState(), (facts(hand=0.6), facts(hand=0.3)), P, FAR, 0.0)
    assert tasks == (Task.REST, Task.PREPARE)


def test_both_sleeves_are_prepared_when_the_garment_reaches_both_hands() -> None:
    _, tasks = advance_stages(StageState(), (facts(), facts()), P, NEAR, 0.0)
    assert tasks == (Task.PREPARE, Task.PREPARE)


def test_first_sleeve_waits_on_its_arm_for_the_second() -> None:
    state, tasks = advance_stages(StageState(), (facts(linked=True, s=0.5), facts()), P, FAR, 1.0)
    assert state.stage == (Stage.DRESS, Stage.PREPARE)
    assert tasks == (Task.WAIT, Task.PREPARE)


def test_second_sleeve_rests_until_the_first_is_far_enough_on() -> None:
    _, tasks = advance_stages(StageState(), (facts(linked=True, s=0.1), facts()), P, FAR, 1.0)
    assert tasks == (Task.WAIT, Task.REST)


def test_both_are_drawn_up_together_once_both_arms_are_in() -> None:
    _, tasks = advance_stages(
        StageState(), (facts(linked=True, s=0.6), facts(linked=True, s=0.2)), P, FAR, 1.0
    )
    assert tasks == (Task.DRESS, Task.DRESS)


def test_progress_without_the_arm_inside_is_no_progress() -> None:
    """The armhole has slid up beside the arm: the sleeve is taken back, not called done."""
    started = StageState(stage=(Stage.DRESS, Stage.PREPARE), first=0)
    beside = SleeveFacts(linked=False, s=0.0, hand_distance=0.5, prepared_error=0.5, passed=0.5)
    state, _ = advance_stages(started, (beside, facts()), P, FAR, 1.0)
    assert state.stage[0] == Stage.PREPARE
    assert state.attempts[0] == 1


def test_a_sleeve_at_the_shoulder_is_done_and_stays_so() -> None:
    state, _ = advance_stages(StageState(), (facts(linked=True, s=1.97), facts()), P, FAR, 1.0)
    assert state.stage[0] == Stage.DONE
    state, _ = advance_stages(state, (facts(linked=True, s=1.92), facts()), P, FAR, 2.0)
    assert state.stage[0] == Stage.DONE
    state, _ = advance_stages(state, (facts(linked=False), facts()), P, FAR, 3.0)
    assert state.stage[0] == Stage.PREPARE


def test_a_sleeve_that_misses_the_hand_keeps_away_before_it_tries_again() -> None:
    near = facts(hand=0.1)
    state, _ = advance_stages(StageState(), (near, facts()), P, FAR, 0.0)
    assert not retreats(state, 0, P, 0.0)
    late = 2.0 * P.insertion_timeout + 0.1
    state, _ = advance_stages(state, (near, facts()), P, FAR, late)
    assert state.stage[0] == Stage.PREPARE
    assert state.attempts == (1, 0)
    assert retreats(state, 0, P, late + 1.0)
    assert not retreats(state, 0, P, late + P.retreat_time + 0.1)


def test_an_armhole_that_lingers_at_a_hand_is_taken_back() -> None:
    at = facts(hand=P.lingering_distance - 0.01)
    away = facts(hand=P.lingering_distance + 0.01)
    state = StageState()
    for time in (0.0, P.lingering_timeout - 0.1):
        state, _ = advance_stages(state, (at, facts()), P, FAR, time)
        assert state.attempts == (0, 0)
    # one that has been away begins anew
    gone, _ = advance_stages(state, (away, facts()), P, FAR, P.lingering_timeout)
    gone, _ = advance_stages(gone, (at, facts()), P, FAR, P.lingering_timeout + 0.2)
    assert gone.attempts == (0, 0)
    # and one that has the arm in it does not linger
    inside = facts(linked=True, s=0.1, hand=0.05)
    on, _ = advance_stages(state, (inside, facts()), P, FAR, P.lingering_timeout + 0.1)
    assert on.attempts == (0, 0)
    assert on.close_since[0] is None
    back, _ = advance_stages(state, (at, facts()), P, FAR, P.lingering_timeout + 0.1)
    assert back.attempts == (1, 0)
    assert back.stage[0] == Stage.PREPARE
    assert back.close_since == (None, None)


def test_after_misses_of_the_first_hand_both_sleeves_are_taken_back_and_tried_anew() -> None:
    beside = replace(facts(hand=0.1), passed=0.1)
    state = StageState(first=0)
    for k in range(1, 2 * P.withdrawal_after + 1):
        time = 20.0 * k
        drawn = replace(state, stage=(Stage.DRESS, Stage.PREPARE))
        state, _ = advance_stages(drawn, (beside, facts()), P, FAR, time)
        assert state.attempts == (k, 0)
        due = k % P.withdrawal_after == 0
        assert withdraws(state, (beside, facts()), P, time) == due
        soon, tasks = advance_stages(state, (beside, facts()), P, FAR, time + 0.5)
        assert tasks == ((Task.PREPARE, Task.PREPARE) if due else (Task.PREPARE, Task.REST))
        if not due:
            continue
        # nothing on the way back counts, neither a hand that comes along nor one in line
        along = replace(beside, hand=(0.5, 0.0, 0.0), away=(1.0, 0.0, 0.0), prepared_error=0.0)
        later, _ = advance_stages(soon, (along, facts()), P, FAR, time + P.withdrawal_time - 0.1)
        assert later == state
        # then it goes on, and a hand that is barred has as long as always
        barred = replace(facts(hand=0.3), sight=0.1)
        after = time + P.withdrawal_time + P.barred_timeout
        waits, tasks = advance_stages(state, (barred, facts()), P, FAR, after - 0.1)
        assert tasks == (Task.PREPARE, Task.REST)
        assert waits.attempts == state.attempts
        gone, _ = advance_stages(state, (barred, facts()), P, FAR, after + 0.1)
        assert gone.attempts[0] == k + 1


def test_a_garment_that_is_on_an_arm_is_not_taken_back() -> None:
    missed = StageState(first=0, attempts=(P.withdrawal_after, P.withdrawal_after))
    on = facts(linked=True, s=0.5)
    assert withdraws(missed, (facts(), facts()), P, 0.5)
    for both in ((on, facts()), (facts(), on), (on, on)):
        assert not withdraws(missed, both, P, 0.5)
    assert not withdraws(replace(missed, attempts=(0, P.withdrawal_after)), (on, facts()), P, 0.5)
    assert not withdraws(StageState(), (facts(), facts()), P, 0.5)


def test_an_opening_that_the_hand_does_not_see_is_not_dressed() -> None:
    seen = SleeveFacts(False, 0.0, 0.05, 0.01, passed=0.0)
    barred = SleeveFacts(False, 0.0, 0.05, 0.01, passed=0.0, sight=0.0)
    state, _ = advance_stages(StageState(), (barred, facts()), P, FAR, 0.0)
    assert state.stage[0] == Stage.PREPARE
    state, _ = advance_stages(state, (seen, facts()), P, FAR, 0.5)
    assert state.stage[0] == Stage.DRESS
    state, _ = advance_stages(state, (barred, facts()), P, FAR, 1.0)
    assert state.stage[0] == Stage.PREPARE
    assert state.attempts == (1, 0)


def test_a_hand_that_loses_part_of_its_sight_is_not_given_up() -> None:
    """Less than begins a dressing does not end it: sight goes to and fro while cloth moves."""
    middle = 0.5 * (P.least_sight + P.lost_sight)
    seen, half = (SleeveFacts(False, 0.0, 0.05, 0.01, 0.0, sight=s) for s in (1.0, middle))
    state, _ = advance_stages(StageState(), (half, facts()), P, FAR, 0.0)
    assert state.stage[0] == Stage.PREPARE
    state, _ = advance_stages(state, (seen, facts()), P, FAR, 0.5)
    state, _ = advance_stages(state, (half, facts()), P, FAR, 1.0)
    assert state.stage[0] == Stage.DRESS
    assert state.attempts == (0, 0)
    # nor is one taken back that is prepared for long
    further = replace(half, hand_distance=0.2)
    state, _ = advance_stages(StageState(), (further, facts()), P, FAR, 0.0)
    state, _ = advance_stages(state, (further, facts()), P, FAR, P.barred_timeout + 0.1)
    assert state.attempts == (0, 0)


def test_a_hand_that_was_seen_by_is_seen_by_for_a_while() -> None:
    """Close by, rim and panel bar what was seen from further off; a miss forgets it."""
    barred = SleeveFacts(False, 0.0, 0.5 * P.meeting_distance, 0.1, passed=0.0, sight=0.0)
    sees = replace(barred, sight=P.least_sight)
    far = replace(barred, hand_distance=1.1 * P.meeting_distance)

    def sight(state: StageState, fact: SleeveFacts, time: float) -> float:
        _, (other, found) = look(state, (facts(), fact), P, time)
        assert other == facts()
        assert replace(found, sight=fact.sight) == fact
        return found.sight

    assert sight(StageState(), barred, 0.1) == 0.0
    state, kept = look(StageState(), (facts(), sees), P, 1.0)
    assert kept == (facts(), sees)
    soon, late = 1.0 + 0.9 * P.sight_time, 1.0 + 1.1 * P.sight_time
    assert sight(state, barred, soon) == 1.0
    assert sight(state, barred, late) == 0.0
    assert sight(state, far, soon) == 0.0
    assert sight(state, replace(barred, linked=True), soon) == 0.0
    # seen again meanwhile
    state, _ = look(state, (facts(), sees), P, soon)
    assert sight(state, barred, late) == 1.0
    gone = replace(barred, passed=2.0 * P.missed_distance)
    dressing = replace(state, stage=(Stage.PREPARE, Stage.DRESS), first=1)
    missed, _ = advance_stages(dressing, (facts(), gone), P, FAR, soon)
    assert missed.attempts == (0, 1)
    assert sight(missed, barred, soon) == 0.0


def test_a_sleeve_that_rests_has_not_missed_its_hand() -> None:
    """It is barred from it for as long as the other one takes, and then has all its time."""
    barred = SleeveFacts(False, 0.0, 0.3, 0.2, passed=0.0, sight=0.0)
    state, coming = StageState(first=0), facts(hand=0.6)
    for time in np.arange(0.0, 4.0 * P.barred_timeout, 0.5):
        state, tasks = advance_stages(state, (coming, barred), P, FAR, float(time))
        assert tasks == (Task.PREPARE, Task.REST)
    begun = float(time)
    on = facts(linked=True, s=P.waiting_progress)
    for time in np.arange(begun + 0.5, begun + P.barred_timeout, 0.5):
        state, tasks = advance_stages(state, (on, barred), P, FAR, float(time))
        assert tasks[0] == Task.WAIT
        assert state.attempts[1] == 0
    state, _ = advance_stages(state, (on, barred), P, FAR, begun + P.barred_timeout + 0.6)
    assert state.attempts[1] == 1
    # one that rests again, while the first sleeve has slipped down, keeps away as it was told to
    slipped = facts(linked=True, s=0.1 * P.waiting_progress)
    began = state.since[1]
    for after in np.arange(0.1, P.retreat_time, 0.4):
        state, tasks = advance_stages(state, (slipped, barred), P, FAR, began + float(after))
        assert tasks == (Task.WAIT, Task.REST)
        assert retreats(state, 1, P, began + float(after))
    assert not retreats(state, 1, P, began + P.retreat_time)


def _meeting(hand: float, armhole: float) -> SleeveFacts:
    """Returns what is seen of an armhole that comes along +x to a hand at `hand`, m."""
    ahead = hand - armhole
    return SleeveFacts(
        False,
        0.0,
        abs(ahead),
        0.1,
        0.0,
        hand=(hand, 0.0, 1.0),
        away=(float(np.sign(ahead)), 0.0, 0.0),
    )


def test_an_armhole_that_pushes_the_hand_along_is_taken_back() -> None:
    state = StageState()
    for k, pushed in enumerate([0.0, 0.5, 0.9]):
        hand = pushed * P.pushed_distance
        state, _ = advance_stages(state, (_meeting(hand, hand - 0.1), facts()), P, FAR, 0.1 * k)
        assert state.attempts == (0, 0)
    hand = 1.1 * P.pushed_distance
    state, _ = advance_stages(state, (_meeting(hand, hand - 0.1), facts()), P, FAR, 0.3)
    assert state.attempts == (1, 0)
    assert retreats(state, 0, P, 0.4)
    # the arm stays where it was left: that is no second push
    state, _ = advance_stages(state, (_meeting(hand, hand - 0.1), facts()), P, FAR, 0.4)
    assert state.attempts == (1, 0)


def test_a_hand_at_the_opening_may_be_carried_further_and_for_longer() -> None:
    state = StageState()
    late = P.lingering_timeout + 1.0
    for pushed, time in ((0.0, 0.0), (1.5 * P.pushed_distance, 0.5 * late), (0.14, late)):
        entering = replace(_meeting(pushed, pushed - 0.05), touches=True)
        state, _ = advance_stages(state, (entering, facts()), P, FAR, time)
        assert state.attempts == (0, 0)
    beside = _meeting(0.14, 0.14 - 0.05)
    missed, _ = advance_stages(state, (beside, facts()), P, FAR, late)
    assert missed.attempts == (1, 0)
    hand = 1.1 * P.entering_distance
    entering = replace(_meeting(hand, hand - 0.05), touches=True)
    missed, _ = advance_stages(state, (entering, facts()), P, FAR, late)
    assert missed.attempts == (1, 0)


def test_a_hand_that_comes_to_the_armhole_is_pushed_from_where_it_came_to() -> None:
    state, _ = advance_stages(StageState(), (_meeting(0.0, -0.15), facts()), P, FAR, 0.0)
    state, _ = advance_stages(state, (_meeting(-0.08, -0.15), facts()), P, FAR, 0.1)
    back = -0.08 + 0.9 * P.pushed_distance
    state, _ = advance_stages(state, (_meeting(back, back - 0.1), facts()), P, FAR, 0.2)
    assert state.attempts == (0, 0)
    back = -0.08 + 1.1 * P.pushed_distance
    state, _ = advance_stages(state, (_meeting(back, back - 0.1), facts()), P, FAR, 0.3)
    assert state.attempts == (1, 0)


def test_a_hand_that_moves_far_from_the_armhole_or_in_it_is_not_pushed() -> None:
    far = 1.5 * P.meeting_distance
    state = StageState()
    for k in range(5):
        hand = 0.05 * k
        state, _ = advance_stages(state, (_meeting(hand, hand - far), facts()), P, FAR, 0.1 * k)
    on = SleeveFacts(True, 0.3, 0.1, 0.1, 0.0, hand=(1.0, 0.0, 1.0), away=(1.0, 0.0, 0.0))
    state, _ = advance_stages(state, (on, facts()), P, FAR, 1.0)
    assert state.attempts == (0, 0)
    assert state.met == (None, None)


def test_a_sleeve_that_is_barred_for_long_is_taken_back() -> None:
    barred = SleeveFacts(False, 0.0, 0.2, 0.2, passed=0.0, sight=0.0)
    state, _ = advance_stages(StageState(), (barred, facts()), P, FAR, 0.0)
    assert state.attempts == (0, 0)
    state, _ = advance_stages(state, (barred, facts()), P, FAR, P.barred_timeout + 0.1)
    assert state.attempts == (1, 0)


def test_a_stalled_sleeve_gives_way_and_is_drawn_again() -> None:
    state = StageState()
    stalled = (facts(linked=True, s=0.3), facts(linked=True, s=0.9))
    for time in (0.0, 0.5, P.stall_timeout):
        state, _ = advance_stages(state, stalled, P, FAR, time)
        assert not eases(state, 0, stalled, P, time)
    late = P.stall_timeout + 0.5
    state, _ = advance_stages(state, stalled, P, FAR, late)
    assert eases(state, 0, stalled, P, late)
    assert not eases(state, 1, stalled, P, late)  # the leading sleeve waits, it does not stall
    over = P.stall_timeout + P.easing_time + 0.5
    state, _ = advance_stages(state, stalled, P, FAR, over)
    assert not eases(state, 0, stalled, P, over)


def test_a_sleeve_that_stalls_just_before_the_shoulder_gives_way_too() -> None:
    """Pulled on with all force a rim that caught on the upper arm holds only the faster."""
    late = P.stall_timeout + 0.5
    for s, expected in ((1.88, True), (P.creeping_progress + 0.01, False)):
        state, pair = StageState(), (facts(linked=True, s=s), facts(linked=True, s=1.95))
        for time in (0.0, P.stall_timeout, late):
            state, _ = advance_stages(state, pair, P, FAR, time)
        assert eases(state, 0, pair, P, late) == expected


def eased_for(s_of: Callable[[int, bool], float], cycles: int) -> list[float]:
    """Returns when a sleeve at `s_of` (cycle, whether it gives way) begins to give way, s."""
    state, gives_way, cycle, time = StageState(), False, 0, 0.0
    began: list[float] = []
    while len(began) < cycles:
        pair = (facts(linked=True, s=s_of(cycle, gives_way)), facts(linked=True, s=1.95))
        state, _ = advance_stages(state, pair, P, FAR, time)
        before, gives_way = gives_way, eases(state, 0, pair, P, time)
        if gives_way and not before:
            began.append(time)
        cycle += before and not gives_way
        time += 0.5
    return began


def test_a_sleeve_that_stalls_again_where_it_did_is_drawn_at_for_twice_as_long() -> None:
    """Not all come free by giving way; some creep on under what is allowed."""
    periods = np.diff(eased_for(lambda cycle, eased: 1.5 if eased else 1.84, 4))
    np.testing.assert_allclose(np.diff(periods) / P.stall_timeout, [2.0, 4.0], atol=0.35)


def test_a_sleeve_that_came_further_is_given_way_to_as_soon_as_at_first() -> None:
    step = 2.0 * P.stall_progress
    periods = np.diff(eased_for(lambda cycle, eased: 1.0 + step * (cycle - eased), 4))
    np.testing.assert_allclose(periods, periods[0], atol=0.5)
    assert periods[0] < P.stall_timeout + P.easing_time + 2.0


def test_progress_is_no_stall() -> None:
    state = StageState()
    for k in range(20):
        pair = (facts(linked=True, s=0.2 + 0.05 * k), facts(linked=True, s=1.9))
        state, _ = advance_stages(state, pair, P, FAR, float(k))
        assert not eases(state, 0, pair, P, float(k))


def test_both_are_held_while_both_are_on() -> None:
    both = (facts(linked=True, s=1.95), facts(linked=True, s=1.97))
    state, tasks = advance_stages(StageState(), both, P, FAR, 1.0)
    assert tasks == (Task.HOLD, Task.HOLD)
    slipped = (facts(linked=True, s=1.85), facts(linked=True, s=1.97))
    _, tasks = advance_stages(state, slipped, P, FAR, 1.5)
    assert tasks == (Task.DRESS, Task.DRESS)


def test_the_arm_that_can_do_less_goes_first() -> None:
    """Also where it opens more, and is further away."""
    able = replace(facts(hand=0.3), room=0.05, opening=-0.1)
    for room, first in ((0.0, 1), (0.03, 1), (0.04, 0)):
        state, _ = advance_stages(
            StageState(), (able, replace(facts(hand=0.6), room=room)), P, FAR, 0.0
        )
        assert state.first == first


@pytest.mark.parametrize(("name", "first"), [("left", 0), ("right", 1)])
def test_the_first_arm_can_be_given(name: str, first: int) -> None:
    p = replace(P, first=name)
    weak = replace(facts(), room=0.0)
    for both in ((weak, replace(facts(), room=0.05)), (replace(facts(), room=0.05), weak)):
        state, _ = advance_stages(StageState(), both, p, FAR, 0.0)
        assert state.first == first


def test_the_arm_that_opens_less_goes_first() -> None:
    nearer, harder = facts(hand=0.3), replace(facts(hand=0.6), opening=-0.1)
    _, tasks = advance_stages(StageState(), (nearer, harder), P, FAR, 0.0)
    assert tasks == (Task.REST, Task.PREPARE)
    _, tasks = advance_stages(StageState(), (harder, nearer), P, FAR, 0.0)
    assert tasks == (Task.PREPARE, Task.REST)


def test_a_sleeve_that_comes_no_further_near_the_shoulder_is_done() -> None:
    there = (facts(linked=True, s=1.915), facts(linked=True, s=1.6))
    state, _ = advance_stages(StageState(), there, P, FAR, 1.0)
    assert state.stage[0] == Stage.DRESS
    state, _ = advance_stages(state, there, P, FAR, 2.0)
    assert state.stage[0] == Stage.DRESS
    both = (there[0], facts(linked=True, s=1.915))
    for time in (2.5, 3.0, 4.0, 5.0, 5.9):
        state, _ = advance_stages(state, both, P, FAR, time)
    assert state.stage == (Stage.DONE, Stage.DONE)


def test_a_second_sleeve_that_missed_again_and_again_is_swung_back_for_a_while() -> None:
    on, off = facts(linked=True, s=0.5), facts(hand=0.1, error=0.2)
    state, swung = StageState(first=0), []
    for k in range(1, 2 * P.swing_after + 1):
        # the hand was passed, and the armhole is in line again
        state, _ = advance_stages(state, (on, replace(off, prepared_error=0.0)), P, FAR, 20.0 * k)
        state, _ = advance_stages(state, (on, replace(off, passed=1.0)), P, FAR, 20.0 * k + 1.0)
        assert state.attempts == (0, k)
        assert state.stage[1] == Stage.PREPARE
        swung.append(swings(state, 1, (on, off), P, 20.0 * k + 1.0))
        assert not swings(state, 0, (on, off), P, 20.0 * k + 1.0)
        assert not swings(state, 1, (on, off), P, 20.0 * k + 1.1 + P.swing_time)
        # without the first one on its arm both are taken back instead
        assert not swings(state, 1, (off, off), P, 20.0 * k + 1.0)
    assert swung == [k % P.swing_after == 0 for k in range(1, 2 * P.swing_after + 1)]


def test_a_sleeve_that_is_swung_back_is_not_taken_to_be_stuck() -> None:
    on, barred = facts(linked=True, s=0.5), replace(facts(hand=0.3), sight=0.0)
    start = StageState((Stage.DRESS, Stage.PREPARE), 0, attempts=(0, P.swing_after))
    late = P.barred_timeout + 1.0
    state, _ = advance_stages(start, (on, barred), P, FAR, late)
    assert state.attempts == (0, P.swing_after)
    state, _ = advance_stages(start, (on, barred), P, FAR, late + P.swing_time)
    assert state.attempts == (0, P.swing_after + 1)
