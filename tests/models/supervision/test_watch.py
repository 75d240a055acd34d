"""A watch believes what is fresh, sound, and of this time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.supervision.watch import (
    Arrival,
    Fault,
    WatchSettings,
    WatchState,
    watch,
)

SETTINGS = WatchSettings(max_age=0.05)
PERIOD = 0.005


def heard(now: float = 10.0, stamp: float = 3.0) -> WatchState:
    """Returns a watch that has just heard its first sound message."""
    state = watch(WatchState(), Arrival(1, stamp), now, SETTINGS)
    assert state.fault is Fault.NONE
    return state


def test_nothing_is_believed_before_the_first_message() -> None:
    assert watch(WatchState(), Arrival(), 0.0, SETTINGS).fault & Fault.STALE
    assert watch(WatchState(), Arrival(1, 0.0, Fault.NOT_FINITE), 0.0, SETTINGS).fault


def test_a_silent_source_is_stale_after_its_time_and_not_before() -> None:
    state = heard()
    assert not watch(state, Arrival(1, 3.0), 10.05 - 1e-9, SETTINGS).fault
    assert watch(state, Arrival(1, 3.0), 10.05 + 1e-9, SETTINGS).fault is Fault.STALE


def test_the_same_message_again_does_not_keep_a_source_fresh() -> None:
    state = heard()
    for k in range(1, 20):
        state = watch(state, Arrival(1 + k, 3.0), 10.0 + k * PERIOD, SETTINGS)
    assert state.fault is Fault.STALE


@pytest.mark.parametrize("fault", [Fault.MALFORMED, Fault.NOT_FINITE, Fault.WRONG_SIZE])
def test_what_is_not_sound_is_told_until_something_sound_comes(fault: Fault) -> None:
    state = watch(heard(), Arrival(2, 3.005, fault), 10.005, SETTINGS)
    assert state.fault is fault
    state = watch(state, Arrival(2, 3.005, fault), 10.01, SETTINGS)
    assert state.fault is fault
    state = watch(state, Arrival(3, 3.01), 10.015, SETTINGS)
    assert state.fault is Fault.NONE


@pytest.mark.parametrize(
    ("stamp", "fault"), [(2.9, Fault.TIME_BACK), (3.0 + 3600.0, Fault.CLOCK_JUMP)]
)
def test_a_clock_that_leaps_is_never_believed_again(stamp: float, fault: Fault) -> None:
    state = watch(heard(9.995, 2.995), Arrival(2, 3.0), 10.0, SETTINGS)
    state = watch(state, Arrival(3, stamp), 10.005, SETTINGS)
    assert state.fault & fault
    state = watch(state, Arrival(4, 3.01), 10.01, SETTINGS)
    assert state.fault & fault


def test_a_message_that_waited_for_the_first_look_is_no_leap_of_the_clock() -> None:
    """What was sent a second before a run begins is there as it begins; the next one comes soon."""
    settings = WatchSettings(max_age=0.5)
    state = watch(WatchState(), Arrival(1, 3.0), 10.0, settings)
    state = watch(state, Arrival(2, 4.2), 10.1, settings)
    assert state.fault is Fault.NONE
    assert watch(state, Arrival(3, 5.4), 10.2, settings).fault & Fault.CLOCK_JUMP


def test_a_source_that_does_not_follow_still_tells_where_it_is() -> None:
    state = heard()
    for k in range(1, 30):
        arrival = Arrival(1 + k, 3.0 + k * PERIOD, Fault.STOPPED)
        state = watch(state, arrival, 10.0 + k * PERIOD, SETTINGS)
    assert state.fault is Fault.STOPPED


@given(
    st.floats(0.05, 1.0),
    st.lists(st.floats(0.001, 0.049), min_size=1, max_size=50),
    st.floats(-1e6, 1e6),
)
def test_a_source_whose_clock_is_slow_or_set_elsewhere_is_believed(
    rate: float, waits: list[float], stamp: float
) -> None:
    state, now = heard(0.0, stamp), 0.0
    for k, wait in enumerate(waits):
        now, stamp = now + wait, stamp + rate * wait
        state = watch(state, Arrival(2 + k, stamp), now, SETTINGS)
        assert not state.fault & ~Fault.STALE
        # stamps that far from 0 have steps of their own
        assert state.fault is Fault.NONE or abs(stamp) > 1e5


def test_a_late_message_changes_nothing_and_ends_nothing() -> None:
    state = watch(heard(), Arrival(2, 3.01), 10.01, SETTINGS)
    late = watch(state, Arrival(3, 2.99), 10.012, SETTINGS)
    assert late.fault is Fault.NONE
    assert (late.stamp, late.heard) == (3.01, 10.01)
    assert watch(late, Arrival(4, 3.015), 10.015, SETTINGS).stamp == 3.015


def test_stamps_that_nobody_fills_in_are_told_as_that_and_not_as_silence() -> None:
    state = heard(10.0, 0.0)
    for k in range(1, 20):
        state = watch(state, Arrival(1, 0.0, dropped=k), 10.0 + k * PERIOD, SETTINGS)
    assert state.fault is Fault.UNSTAMPED
    assert state.reason == "utime is never filled in: it is 0 in each message"
    assert not watch(state, Arrival(2, 0.1, dropped=19), 10.1, SETTINGS).fault


def test_a_clock_that_stands_still_is_told_with_its_stamp() -> None:
    state = heard()
    for k in range(1, 20):
        state = watch(state, Arrival(1, 3.0, dropped=k), 10.0 + k * PERIOD, SETTINGS)
    assert state.fault is Fault.STALE
    assert state.reason == "messages come, and utime stands still at 3.000 s"


def test_the_reason_of_what_is_fatal_stays() -> None:
    state = watch(heard(), Arrival(2, 1.0), 10.005, SETTINGS)
    first = state.reason
    assert "went back by 2.000 s" in first
    state = watch(state, Arrival(3, 1.005, Fault.IMPOSSIBLE, "left hand"), 10.01, SETTINGS)
    assert state.fault & Fault.TIME_BACK
    assert state.reason == first


def test_a_reason_goes_with_its_fault() -> None:
    state = watch(heard(), Arrival(2, 3.01, Fault.IMPOSSIBLE, "left hand"), 10.01, SETTINGS)
    assert (state.fault, state.reason) == (Fault.IMPOSSIBLE, "left hand")
    state = watch(state, Arrival(2, 3.01, Fault.IMPOSSIBLE, "left hand"), 10.1, SETTINGS)
    assert state.reason == "left hand"
    state = watch(state, Arrival(3, 3.1), 10.1, SETTINGS)
    assert (state.fault, state.reason) == (Fault.NONE, "")
