"""Packets that overtake each other are dropped; clocks that are set back are told."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.supervision.fault import Fault
from drake_dress.models.supervision.order import order

LATE = 0.05
stamps = st.integers(1, 10**9).map(lambda utime: 1e-6 * utime)


@given(stamps, st.floats(1e-6, 1e3))
def test_what_is_newer_is_taken(newest: float, gone: float) -> None:
    found = order(newest + gone, newest, LATE)
    assert found is not None
    assert not found.fault


@given(stamps, st.floats(0.0, 0.049))
def test_what_is_repeated_or_a_little_late_is_dropped(newest: float, back: float) -> None:
    assert order(newest - back, newest, LATE) is None


@given(stamps, st.floats(0.051, 1e4))
def test_what_is_set_back_is_told_with_its_step(newest: float, back: float) -> None:
    if newest == back:
        back += 1.0
    found = order(newest - back, newest, LATE)
    assert found is not None
    assert found.fault is Fault.TIME_BACK
    told = re.search(r"by (\S+) s, expected 0\.05 s at most", found.reason)
    assert told is not None
    # three decimals are told, of a difference that is rounded itself
    assert float(told[1]) == pytest.approx(back, abs=6e-4)


def test_a_stamp_that_is_filled_in_no_longer_is_told_as_that() -> None:
    found = order(0.0, 12.5, LATE)
    assert found is not None
    assert found.fault is Fault.UNSTAMPED
    assert found.reason.startswith("utime is 0 after 12.500 s")


def test_a_counter_that_rolls_over_is_told_as_that() -> None:
    newest = 1e-6 * (2**32 - 3000)
    found = order(0.002, newest, LATE)
    assert found is not None
    assert found.fault is Fault.TIME_BACK
    assert "32-bit count of µs that rolled over" in found.reason


@given(st.lists(st.integers(0, 200), min_size=2, max_size=60))
def test_what_is_taken_is_in_order(periods: list[int]) -> None:
    newest, taken = None, []
    for k in periods:
        found = order(1.0 + 0.005 * k, newest, 10.0)
        if found is not None:
            assert not found.fault
            newest = 1.0 + 0.005 * k
            taken.append(newest)
    assert taken == sorted(set(taken))
    assert taken[-1] == 1.0 + 0.005 * max(periods)
