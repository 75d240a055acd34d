"""Motions that put the first hand through its armhole, found by trying."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.budget import Budget, Spending
from drake_dress.models.control.insertion_search import InsertionParameters, Scene, SearchState
from drake_dress.models.control.person_model import person_obstacles
from drake_dress.models.control.policy import DressingPolicy, PolicyParameters
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.body import (
    ArmPose,
)
from drake_dress.models.human.heading import heading
from drake_dress.models.sides import SIDES
from tests.plain_person import plain_joints, plain_person

PERSON = plain_person("standing")
JOINTS = plain_joints("standing", ArmPose(0.3, 0.8, 0.0, 0.2))
BEHIND = np.array([-0.33, 0.0, 0.15])
STEP = 0.2


@lru_cache(maxsize=2)
def policy(rollouts: int = 4) -> DressingPolicy:
    """Returns a controller with coarse cloth, whose search is quick."""
    insertion = InsertionParameters(rollouts=rollouts, substeps=2, iterations=8)
    parameters = PolicyParameters(time_step=STEP, horizon=5, insertion=insertion)
    return DressingPolicy(make_coat(CoatParameters(), 0.06), Material(), PERSON, parameters)


def scene(side: int = 0, limit: int | None = None) -> Scene:
    """Returns a coat that hangs behind a person."""
    mesh = policy().mesh
    middle = np.mean([mesh.rest_position[mesh.grasp[s]].mean(axis=0) for s in SIDES], axis=0)
    hands = 0.5 * (JOINTS[2] + JOINTS[5])
    x = mesh.rest_position + hands + BEHIND - middle
    obstacles = person_obstacles(PERSON, np.stack([JOINTS, JOINTS]), STEP)
    spending = Spending(Budget(iterations=limit))
    return Scene(
        x, np.zeros_like(x), JOINTS, obstacles, obstacles[-1], heading(JOINTS), side, spending
    )


def test_a_motion_that_is_followed_puts_the_hand_in() -> None:
    search, now, state = policy().search, scene(), SearchState(0)
    planner = policy().planner
    for _ in range(60):
        state, velocity = search.advance(state, now, np.zeros((0, 2, 3)))
        x, v = now.x, now.v
        for moves in velocity[:2]:
            motion = STEP / 2 * moves[policy().controller.side_of_held]
            for _ in range(2):
                x, v, _, _ = search.cloth.step(x, v, motion, now.obstacles[0])
        now = replace(now, x=x, v=v)
        if planner.is_linked(x, JOINTS, 0):
            break
    assert planner.is_linked(now.x, JOINTS, 0)


@settings(max_examples=8, deadline=None)
@given(
    side=st.sampled_from([0, 1]),
    tried=st.sampled_from([0, 1000]),  # on the way to where motions begin, or searching
    count=st.integers(0, 10**6),
)
def test_grippers_keep_their_speed_and_their_distance(side: int, tried: int, count: int) -> None:
    search, now = policy().search, scene(side)
    begun = SearchState(side, tried=tried, count=count)
    state, velocity = search.advance(begun, now, np.zeros((1, 2, 3)))
    assert np.linalg.norm(velocity, axis=2).max() <= search.max_speed * (1.0 + 1e-9)
    held = [now.x[policy().mesh.grasp[s]].mean(axis=0) for s in SIDES]
    path = np.array(held) + STEP * np.cumsum(velocity, axis=0)
    gap = find_proximity(path.reshape(-1, 3), now.kept_away, 0.0).gap
    assert gap.min() > search.parameters.clearance - 0.02
    again, same = search.advance(begun, scene(side), np.zeros((1, 2, 3)))
    np.testing.assert_array_equal(velocity, same)
    assert again.cost == state.cost


def test_a_spent_budget_ends_the_drawing() -> None:
    search = policy().search
    # on the way to where motions begin, none is drawn
    begun = SearchState(0, tried=1000)
    tried = [
        search.advance(begun, scene(limit=limit), np.zeros((0, 2, 3)))[0].tried - 1000
        for limit in (1, None)
    ]
    assert tried[0] <= 1 < tried[1] or tried[1] < 0  # found one: nothing is counted


@given(
    first=st.sampled_from([0, 1]),
    are_alike=st.booleans(),
    after=st.integers(1, 5),
    patience=st.integers(1, 9),
)
def test_hands_are_searched_for_in_turn(
    first: int, are_alike: bool, after: int, patience: int
) -> None:
    search = policy().search
    search = replace(search, parameters=replace(search.parameters, after=after, patience=patience))
    state = SearchState()
    for misses in range(after):
        state, side = search.begun(state, first, are_alike, misses)
        assert side is None
    for expected in (first, 1 - first) if are_alike else (first,):
        state, side = search.begun(state, first, are_alike, after)
        assert side == state.side == expected
        # one that still has motions to try goes on
        state = replace(state, tried=patience - 1)
        assert search.begun(state, first, are_alike, after) == (state, expected)
        state = replace(state, tried=patience)
    for misses, expected_side in ((after, None), (after, None), (after + 1, first)):
        state, side = search.begun(state, first, are_alike, misses)
        assert side == expected_side


def test_without_rollouts_nothing_is_searched_for() -> None:
    state, side = policy(0).search.begun(SearchState(), 0, True, 100)
    assert side is None
    assert state == SearchState()
