"""Arms hold at once, go on when all is well for a while, and a run ends when it must."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.supervision.injection import InjectedFault, kinds_at
from drake_dress.models.supervision.supervision import (
    Patience,
    SupervisionState,
    supervise,
    told,
)
from drake_dress.models.supervision.watch import FATAL, Fault

PATIENCE = Patience(settle_time=0.2, fault=3.0, fatal=0.3)
PERIOD = 0.005
SOUND = (Fault.NONE, Fault.NONE)
STALE = (Fault.NONE, Fault.STALE)


def after(
    state: SupervisionState, faults: tuple[Fault, ...], begin: float, time: float
) -> tuple[SupervisionState, float]:
    """Returns the state after a time with the same faults, and when that is."""
    for k in range(1, round(time / PERIOD) + 1):
        state = supervise(state, faults, begin + k * PERIOD, PATIENCE)
    return state, begin + time


def permitted() -> tuple[SupervisionState, float]:
    state, now = after(SupervisionState.of(2), SOUND, 0.0, 0.3)
    assert state.permitted
    return state, now


def test_arms_move_once_all_have_been_sound_for_a_while() -> None:
    state, now = after(SupervisionState.of(2), STALE, 0.0, 0.1)
    assert not state.permitted
    state, now = after(state, SOUND, now, 0.15)
    assert not state.permitted
    state, now = after(state, SOUND, now, 0.1)
    assert state.permitted


def test_any_fault_holds_at_once_and_passes() -> None:
    state, now = permitted()
    state = supervise(state, STALE, now + PERIOD, PATIENCE)
    assert not state.permitted
    assert state.ended_by is None
    state, now = after(state, SOUND, now + PERIOD, 0.25)
    assert state.permitted
    assert state.faults == SOUND


def test_a_source_that_comes_and_goes_ends_a_run_as_well() -> None:
    state, now = permitted()
    for _ in range(29):
        state, now = after(state, (Fault.NONE, Fault.LEAP), now, 0.02)
        state, now = after(state, SOUND, now, 0.08)
        assert state.ended_by is None
        assert not state.permitted
    state, now = after(state, (Fault.NONE, Fault.LEAP), now, 0.15)
    assert state.ended_by == 1


def test_a_fault_of_long_ago_does_not_take_from_patience() -> None:
    state, now = permitted()
    state, now = after(state, STALE, now, 2.9)
    state, now = after(state, SOUND, now, 0.25)
    assert state.permitted
    state, now = after(state, STALE, now, 2.9)
    assert state.ended_by is None


@pytest.mark.parametrize(("fault", "time"), [(Fault.STALE, 3.0), (Fault.TIME_BACK, 0.3)])
def test_a_run_ends_when_patience_does(fault: Fault, time: float) -> None:
    state, now = permitted()
    state, later = after(state, (Fault.NONE, fault), now, time - 2 * PERIOD)
    assert state.ended_by is None
    state, later = after(state, (Fault.NONE, fault), later, 4 * PERIOD)
    assert state.ended_by == 1
    # what has ended stays so
    state, _ = after(state, SOUND, later, 1.0)
    assert state.ended_by == 1
    assert not state.permitted


@given(st.lists(st.sampled_from([*Fault]), min_size=1, max_size=60))
def test_nothing_is_permitted_while_anything_is_wrong(faults: list[Fault]) -> None:
    state, now = permitted()
    for k, fault in enumerate(faults):
        state = supervise(state, (fault, Fault.NONE), now + 0.05 * k, PATIENCE)
        assert fault
        assert not state.permitted


@given(
    st.lists(st.sampled_from([*Fault]), max_size=20),
    st.sampled_from([f for f in Fault if f & FATAL]),
    st.lists(st.sampled_from([*Fault]), min_size=8, max_size=20),
)
def test_a_fatal_fault_ends_the_run_whatever_other_faults_come(
    before: list[Fault], fatal: Fault, later: list[Fault]
) -> None:
    state, now = permitted()
    for k, fault in enumerate([*before, fatal, *later]):
        state = supervise(state, (fault, Fault.NONE), now + 0.05 * k, PATIENCE)
    assert state.ended_by == 0


def test_a_line_names_what_is_wrong() -> None:
    assert told("left arm", Fault.STALE | Fault.CLOCK_JUMP) == "left arm: stale, clock jump"


def test_a_lost_bus_is_of_all_and_other_faults_of_their_source() -> None:
    faults = [InjectedFault("bus_lost", "", 1.0, 1.0), InjectedFault("nan", "left_arm", 1.5, 1.0)]
    assert kinds_at(faults, "left_arm", 1.7) == {"bus_lost", "nan"}
    assert kinds_at(faults, "garment", 1.7) == {"bus_lost"}
    assert kinds_at(faults, "left_arm", 2.3) == {"nan"}
    assert kinds_at(faults, "left_arm", 0.5) == set()
