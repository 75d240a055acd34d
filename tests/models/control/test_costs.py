"""Each cost of a plan: its slope is its derivative, and it is zero where nothing is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.corridor import Corridor
from drake_dress.models.control.costs import (
    GarmentCost,
    Grip,
    GripperLevel,
    PlannedStep,
    SleeveCost,
    Slope,
    StageCosts,
    Weights,
    dressing_costs,
)
from drake_dress.models.control.laying import CollarPosition, GrippersAsWorn
from drake_dress.models.control.situation import HeldGarment, LayingTarget, Situation, SleeveTarget
from drake_dress.models.dressing.sleeve import find_entry, loop_orientation, sleeve_state
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.nape import find_nape
from drake_dress.models.sides import SIDES

MESH = make_coat(CoatParameters(), 0.06)
HELD = np.concatenate([MESH.grasp[s] for s in SIDES])
COUNT = (len(MESH.grasp["left"]), len(MESH.grasp["right"]))
LOOPS = (np.asarray(MESH.loops["left_armhole"]), np.asarray(MESH.loops["right_armhole"]))
SIGNS = (loop_orientation(MESH, "left"), loop_orientation(MESH, "right"))
GARMENT = HeldGarment(COUNT, LOOPS, (float(SIGNS[0]), float(SIGNS[1])), 0.3, find_entry(MESH))
NAPE = find_nape(MESH.rest_position, MESH.faces, MESH.loops)
COSTS = dressing_costs(Weights(), GARMENT)
seeds = st.integers(0, 2**31)


@dataclass(frozen=True)
class _Lift:
    """w ‖z of the first node‖²: a user's own."""

    weight: float = 2.0

    def value(self, step: PlannedStep) -> float:
        return self.weight * float(step.x[0, 2] ** 2)

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        slope.x[0, 2] += 2.0 * self.weight * step.x[0, 2]


def step_at(x: np.ndarray, reaction: np.ndarray, situation: Situation) -> PlannedStep:
    of_side = (np.arange(COUNT[0]), COUNT[0] + np.arange(COUNT[1]))
    sleeves = [sleeve_state(x, LOOPS[i], GARMENT.signs[i]) for i in (0, 1)]
    grip = Grip(HELD, of_side, GARMENT.span)
    return PlannedStep(0, x, reaction, (sleeves[0], sleeves[1]), situation, grip)


def drawn(seed: int) -> PlannedStep:
    """Returns a crumpled garment near a person, with every cost above zero."""
    rng = np.random.default_rng(seed)
    x = MESH.rest_position + rng.normal(0.0, 0.005, MESH.rest_position.shape)
    targets = []
    for side in (0, 1):
        center = x[LOOPS[side]].mean(axis=0)
        into = rng.normal(0.0, 1.0, 3)
        into /= np.linalg.norm(into)
        # the corridor has a kink at its axis: the node is off it
        aside = 0.02 * np.cross(into, rng.normal(0.0, 1.0, 3))
        targets.append(
            SleeveTarget(
                center + rng.normal(0.0, 0.3, (1, 3)),
                into[None],
                rng.uniform(0.2, 2.0),
                rng.uniform(0.2, 2.0),
                entering=bool(side),
                corridor=Corridor((x[LOOPS[side][0]] - 0.05 * into + aside)[None], into[None]),
                passage=into[None],
            )
        )
    near = x[HELD[rng.integers(len(HELD))]] + [0.0, 0.0, 0.06]
    ball = Obstacles(near[None], near[None], np.array([0.03]), np.zeros((1, 3)), np.zeros((1, 3)))
    left = np.cross(x[HELD[0]] - x[HELD[-1]], rng.normal(0.0, 1.0, 3))
    left /= np.linalg.norm(left)
    situation = Situation(
        x,
        np.zeros_like(x),
        (targets[0], targets[1]),
        [ball],
        left[None],
        laying=LayingTarget(
            x[:1] + rng.normal(0.0, 0.1, (1, 3)),
            rng.normal(0.0, 0.1, (1, 3)),
            rng.normal(0.0, 0.1, 1),
        ),
    )
    return step_at(x, rng.normal(0.0, 5.0, (len(HELD), 3)), situation)


def alone(cost: SleeveCost | GarmentCost, of_sleeve: bool) -> StageCosts:
    some: Any = (cost,)
    if of_sleeve:
        return replace(COSTS, of_sleeves=some, of_garment=())
    return replace(COSTS, of_sleeves=(), of_garment=some)


ALL = [
    *(pytest.param(alone(c, True), id=type(c).__name__) for c in COSTS.of_sleeves),
    *(pytest.param(alone(c, False), id=type(c).__name__) for c in COSTS.of_garment),
    pytest.param(alone(CollarPosition(2.0, NAPE), False), id="CollarPosition"),
    pytest.param(alone(GrippersAsWorn(2.0), False), id="GrippersAsWorn"),
    pytest.param(alone(_Lift(), False), id="own"),
]


@pytest.mark.parametrize("costs", ALL)
@given(seed=seeds)
@settings(max_examples=8)
def test_a_slope_is_the_derivative(costs: StageCosts, seed: int) -> None:
    step = drawn(seed)

    def along(change: Callable[[float], PlannedStep]) -> float:
        small = 1e-6
        high, low = (sum(costs.values(change(sign * small))) for sign in (1.0, -1.0))
        return (high - low) / (2.0 * small)

    rng = np.random.default_rng(seed)
    way, push = rng.normal(0.0, 1.0, step.x.shape), rng.normal(0.0, 1.0, step.reaction.shape)
    x_bar = np.zeros_like(step.x)
    reaction_bar = costs.add_slope(step, x_bar)
    value = sum(costs.values(step))
    by_x = along(lambda s: step_at(step.x + s * way, step.reaction, step.situation))
    by_force = along(lambda s: step_at(step.x, step.reaction + s * push, step.situation))
    scale = 1e-6 * (1.0 + value)
    assert np.sum(x_bar * way) == pytest.approx(by_x, rel=1e-4, abs=scale)
    assert np.sum(reaction_bar * push) == pytest.approx(by_force, rel=1e-4, abs=scale)
    assert min(costs.values(step)) >= 0.0


@pytest.mark.parametrize("costs", ALL)
def test_each_cost_acts(costs: StageCosts) -> None:
    values = [sum(costs.values(drawn(seed))) for seed in range(30)]
    assert sum(value > 0.0 for value in values) > 3


def test_slopes_add_up() -> None:
    step = drawn(1)
    whole, parts = np.zeros_like(step.x), np.zeros_like(step.x)
    COSTS.add_slope(step, whole)
    for cost in COSTS.of_sleeves:
        alone(cost, True).add_slope(step, parts)
    for of_garment in COSTS.of_garment:
        alone(of_garment, False).add_slope(step, parts)
    np.testing.assert_allclose(whole, parts, atol=1e-12)


def test_level_costs_nothing_where_left_is_left() -> None:
    step = drawn(2)
    between = step.grip.left_from_right(step.x)
    leftward = (between / np.linalg.norm(between))[None]
    level = GripperLevel(1.0, 0.5, 0.3)
    good = replace(step, situation=replace(step.situation, leftward=leftward))
    turned = replace(step, situation=replace(step.situation, leftward=-leftward))
    assert level.value(good) == 0.0
    assert level.value(turned) > 0.0
    assert level.value(replace(step, situation=replace(step.situation, leftward=None))) == 0.0


def test_a_coat_that_comes_along_a_hanging_arm_may_be_on_edge() -> None:
    step = drawn(2)
    between = step.grip.left_from_right(step.x)
    # the left gripper leads by 0.4 of the span
    across = np.cross(between, [0.3, -0.2, 0.9])
    across /= np.linalg.norm(across)
    share = 0.4 * step.grip.span / np.linalg.norm(between)
    along = between / np.linalg.norm(between)
    leftward = (share * along + np.sqrt(1.0 - share**2) * across)[None]
    situation = replace(step.situation, leftward=leftward, leading=None)
    level = GripperLevel(1.0, 0.5, 0.3)
    expected = (0.1 * step.grip.span) ** 2
    assert level.value(replace(step, situation=situation)) == pytest.approx(expected)
    leading = replace(situation, leading=np.zeros((1, 3)))
    assert level.value(replace(step, situation=leading)) == 0.0


@given(seed=seeds)
def test_the_collar_is_led_before_the_coat_is_laid(seed: int) -> None:
    assert NAPE is not None
    step, cost = drawn(seed), CollarPosition(2.0, NAPE, 0.7)
    place = np.array([[0.1, -0.2, 0.4]])
    led = replace(step.situation, laying=None, leading=place)
    there = replace(step, situation=led)
    off = NAPE.at(step.x) - place[0]
    assert cost.value(there) == pytest.approx(0.7 * off @ off)
    slope = Slope.onto(np.zeros_like(step.x), len(HELD))
    cost.add_slope(there, slope)
    # drawn straight to its place by all its nodes together
    np.testing.assert_allclose(slope.x.sum(axis=0), 1.4 * off)
    assert cost.value(replace(step, situation=replace(led, leading=None))) == 0.0
    both = replace(step, situation=replace(step.situation, leading=place))
    assert cost.value(both) == cost.value(step), "once it is laid, only the nape counts"
