"""Laying the coat and letting it go: when, and when not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.finish import (
    FinishParameters,
    FinishState,
    On,
    Phase,
    advance_finish,
    may_lower,
    sleeves_on,
)
from drake_dress.models.dressing.stages import SleeveFacts, Stage

P = FinishParameters()
ON = SleeveFacts(linked=True, s=1.95, hand_distance=0.5, prepared_error=0.5, passed=0.0)
OFF = replace(ON, linked=False, s=0.0)
DONE = (Stage.DONE, Stage.DONE)
DRESSING = (Stage.DRESS, Stage.DRESS)


def arms(tilt: float) -> FloatArray:
    """Joints of a person whose upper arms stand off the vertical by an angle, rad."""
    shoulder = np.array([0.0, 0.2, 1.4])
    elbow = shoulder + 0.3 * np.array([math.sin(tilt), 0.0, -math.cos(tilt)])
    left = np.stack([shoulder, elbow, elbow + [0.1, 0.0, -0.2]])
    return np.concatenate([left, left * [1.0, -1.0, 1.0]])


AWAY = arms(1.2)


def laid(
    offs: list[float], are_open: bool = False, p: FinishParameters = P, period: float = 0.5
) -> FinishState:
    """Returns the state after the collar had these distances, m, at successive times."""
    state = FinishState()
    for k, off in enumerate(offs):
        state = advance_finish(state, On.DONE, (ON, ON), off, off, are_open, p, k * period)
    return state


@pytest.mark.parametrize("stage", [Stage.PREPARE, Stage.DRESS])
def test_nothing_is_laid_before_both_sleeves_are_done(stage: Stage) -> None:
    for stages in ((stage, Stage.DONE), (Stage.DONE, stage)):
        on = sleeves_on(stages, (ON, ON), AWAY, P)
        state = advance_finish(FinishState(), on, (ON, ON), 0.0, 0.0, False, P, 1.0)
        assert state == FinishState()
        assert state.stages(stages) == stages


def test_it_is_laid_once_the_collar_lies_on_the_nape() -> None:
    approach = [0.1] * 8
    assert laid(approach).phase == Phase.LAYING
    assert laid([*approach, 0.5 * P.laid_distance]).phase == Phase.LAID
    assert laid([*approach, 0.5 * P.laid_distance]).stages(DONE) == (3, 3)


def test_the_person_has_time_to_lower_the_arms() -> None:
    for count in range(2, 20):
        is_laid = laid([0.0] * count).phase == Phase.LAID
        begun = 0.5 * math.ceil(P.steady_time / 0.5)
        assert is_laid == ((count - 1) * 0.5 >= begun + P.least_time)


def test_a_sleeve_that_slips_back_at_once_is_drawn_again_before_the_coat_is_laid() -> None:
    state = FinishState()
    for k, on in enumerate([On.DONE, On.NO] * 10):
        state = advance_finish(state, on, (ON, ON), 0.1, 0.1, False, P, 0.3 * k)
        assert state.phase == Phase.DRESSING
    for k in range(3):
        state = advance_finish(state, On.DONE, (ON, ON), 0.1, 0.1, False, P, 9.0 + 0.3 * k)
    assert state.phase == Phase.LAYING


def test_a_collar_that_comes_no_nearer_is_let_go_only_near_the_nape() -> None:
    near, far = 0.9 * P.open_distance, 1.1 * P.open_distance
    assert laid([near] * 20).phase == Phase.LAID
    assert laid([far] * 200).phase == Phase.LAYING
    coming = [0.5 - 0.012 * k for k in range(39)]
    assert laid(coming).phase == Phase.LAYING, "it still comes nearer"


def test_a_collar_that_lies_high_on_the_nape_is_let_go_as_well() -> None:
    state = FinishState()
    for k in range(20):
        state = advance_finish(state, On.DONE, (ON, ON), 0.06, 0.01, False, P, 0.5 * k)
    assert state.phase == Phase.LAID


def test_grippers_that_have_opened_do_not_close() -> None:
    state = laid([0.0] * 12)
    state = advance_finish(state, On.DONE, (ON, ON), 0.0, 0.0, True, P, 7.0)
    assert state.phase == Phase.RELEASED
    assert state.since == 7.0
    assert state.stages(DONE) == (4, 4)
    after = advance_finish(state, On.NO, (OFF, ON), 1.0, 1.0, True, P, 8.0)
    assert after == state


@given(side=st.sampled_from([0, 1]), s=st.floats(0.0, 1.59), linked=st.booleans())
def test_a_sleeve_that_is_lost_is_dressed_again(side: int, s: float, linked: bool) -> None:
    lost = replace(ON, s=s, linked=linked)
    for state in (laid([0.1] * 3), laid([0.0] * 12)):
        facts = (lost, ON) if side == 0 else (ON, lost)
        assert advance_finish(state, On.DONE, facts, 0.0, 0.0, False, P, 9.0) == FinishState()


@given(
    s=st.tuples(*[st.floats(0.0, 2.0)] * 2),
    tilt=st.floats(0.0, 2.0),
    linked=st.tuples(st.booleans(), st.booleans()),
)
def test_sleeves_hang_only_high_on_arms_that_hang(
    s: tuple[float, float], tilt: float, linked: tuple[bool, bool]
) -> None:
    facts = (replace(ON, s=s[0], linked=linked[0]), replace(ON, s=s[1], linked=linked[1]))
    high = all(linked) and min(s) >= P.hanging_progress
    expected = On.HANGING if high and tilt <= P.hanging_angle else On.NO
    assert sleeves_on(DRESSING, facts, arms(tilt), P) == expected
    assert sleeves_on(DONE, facts, arms(tilt), P) == On.DONE


def test_sleeves_that_hang_have_time_to_come_further_and_may_sink_as_the_coat_is_laid() -> None:
    low = replace(ON, s=P.hanging_progress + 0.01)
    state = FinishState()
    for k in range(math.ceil(P.hanging_time / 0.5)):
        state = advance_finish(state, On.HANGING, (low, ON), 0.1, 0.1, False, P, 0.5 * k)
        assert state.phase == Phase.DRESSING
    state = advance_finish(state, On.HANGING, (low, ON), 0.1, 0.1, False, P, P.hanging_time)
    assert state.phase == Phase.LAYING
    sunk, lost = (replace(ON, s=P.hanging_progress - x) for x in (0.14, 0.16))
    assert advance_finish(state, On.NO, (sunk, ON), 0.1, 0.1, False, P, 9.0).phase == Phase.LAYING
    assert advance_finish(state, On.NO, (lost, ON), 0.1, 0.1, False, P, 9.0) == FinishState()


def test_without_release_the_coat_is_held() -> None:
    p = replace(P, release=False)
    assert laid([0.0] * 50, p=p) == FinishState()


@given(
    s=st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 2.0)),
    stalls=st.tuples(*[st.integers(0, 3)] * 2),
)
def test_arms_are_lowered_early_only_past_the_elbows_and_stalled(
    s: tuple[float, float], stalls: tuple[int, int]
) -> None:
    facts = (replace(ON, s=s[0]), replace(ON, s=s[1]))
    told = may_lower(False, FinishState(), stalls, facts, P)
    assert told == (min(s) >= P.lowering_progress and max(stalls) > 0)
    # who has lowered them keeps them down while the sleeve eases, but not once it slips off
    kept = may_lower(True, FinishState(), (0, 0), facts, P)
    assert kept == (min(s) >= P.lowering_progress - 0.3)
    off = (facts[0], replace(OFF, s=2.0))
    assert not may_lower(True, FinishState(), stalls, off, P)
    # a garment that is held in the end is not laid, and nobody lowers the arms for it
    assert not may_lower(True, FinishState(), stalls, facts, replace(P, release=False))


@pytest.mark.parametrize("phase", [Phase.LAYING, Phase.LAID, Phase.RELEASED])
def test_arms_are_lowered_while_the_coat_is_laid(phase: Phase) -> None:
    assert may_lower(False, FinishState(phase), (0, 0), (ON, ON), P)
