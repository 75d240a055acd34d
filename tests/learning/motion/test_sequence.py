"""When a hand moves and when it rests."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.learning.motion.sequence import PERIOD, is_moving

TIME = PERIOD * np.arange(120)


def along(way: np.ndarray) -> np.ndarray:
    """Returns hands (T,2,3), of which the left one goes by `way` (T,), m, along a line."""
    hands = np.zeros((len(way), 2, 3))
    hands[:, 0] = way[:, None] * np.array([0.6, 0.0, 0.8])
    return hands


@given(st.floats(0.025, 1.0), st.floats(1.0, 2.0), st.floats(0.3, 3.0))
def test_hand_moves_while_it_is_fast_and_a_little_around_that(
    speed: float, begin: float, duration: float
) -> None:
    found = is_moving(along(speed * np.clip(TIME - begin, 0.0, duration)))
    inside = (begin + PERIOD <= TIME) & (begin + duration - PERIOD >= TIME)
    far = (begin - 0.3 > TIME) | (begin + duration + 0.3 < TIME)
    assert found[inside, 0].all()
    assert not found[far, 0].any()
    assert not found[:, 1].any()


@given(st.floats(0.0, 0.019))
def test_slow_hand_rests(speed: float) -> None:
    assert not is_moving(along(speed * TIME)).any()


def test_hand_that_waves_does_not_rest_where_it_turns_around() -> None:
    assert is_moving(along(0.05 * np.sin(2.0 * np.pi * TIME)))[:, 0].all()
