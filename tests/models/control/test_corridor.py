"""What hangs ahead of a hand costs by how far it stands in the way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.control.corridor import corridor_cost

RADIUS, LENGTH = 0.06, 0.12
HAND, INTO = np.array([0.3, -0.2, 1.0]), np.array([0.0, 0.6, -0.8])


def _node(along: float, aside: float) -> np.ndarray:
    return (HAND + along * INTO + aside * np.array([1.0, 0.0, 0.0]))[None]


@pytest.mark.parametrize(
    ("along", "aside", "expected"),
    [
        (0.05, 0.02, 0.04**2),
        (0.05, 0.06, 0.0),
        (-0.02, 0.0, 0.0),
        (0.12, 0.0, 0.0),
        (0.10, 0.0, 0.5 * 0.06**2),
        (0.0, 0.0, 0.5 * 0.06**2),
    ],
)
def test_a_node_costs_by_how_far_it_stands_in_the_way(
    along: float, aside: float, expected: float
) -> None:
    cost, _ = corridor_cost(_node(along, aside), HAND, INTO, RADIUS, LENGTH)
    assert cost == pytest.approx(expected, abs=1e-12)


@given(st.integers(0, 1000))
def test_slope_is_the_derivative(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = HAND + 0.08 * rng.normal(size=(40, 3)) + 0.05 * INTO
    slope = corridor_cost(x, HAND, INTO, RADIUS, LENGTH)[1]
    d, step = rng.normal(size=x.shape), 1e-8
    high, low = (
        corridor_cost(x + sign * step * d, HAND, INTO, RADIUS, LENGTH)[0] for sign in (1.0, -1.0)
    )
    # a node within a step of an end's kink is off by its share
    assert np.sum(slope * d) == pytest.approx((high - low) / (2 * step), rel=1e-4, abs=1e-6)


def test_it_moves_and_turns_with_the_hand() -> None:
    rng = np.random.default_rng(1)
    x = HAND + 0.08 * rng.normal(size=(40, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shift = rng.normal(size=3)
    cost, slope = corridor_cost(x, HAND, INTO, RADIUS, LENGTH)
    moved = corridor_cost(x @ turn.T + shift, turn @ HAND + shift, turn @ INTO, RADIUS, LENGTH)
    assert moved[0] == pytest.approx(cost)
    np.testing.assert_allclose(moved[1], slope @ turn.T, atol=1e-12)
