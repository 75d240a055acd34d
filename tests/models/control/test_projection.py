"""The nearest point of balls and half-spaces is in them, and none in them is nearer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from drake_dress.models.control.projection import Ball, HalfSpace, nearest


def sets_around(rng: np.random.Generator, planes: int) -> tuple[list[Ball], list[HalfSpace]]:
    """Returns sets that share a point, as in one control step."""
    shared = 0.2 * rng.normal(size=3)
    balls, half_spaces = [], []
    for _ in range(2):
        center = shared + 0.2 * rng.normal(size=3)
        balls.append(Ball(center, float(np.linalg.norm(center - shared)) + rng.uniform(0.0, 0.1)))
    for _ in range(planes):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        half_spaces.append(HalfSpace(normal, float(normal @ shared) + rng.uniform(0.0, 0.05)))
    return balls, half_spaces


@pytest.mark.parametrize("planes", [0, 1, 2, 4])
def test_no_point_of_the_sets_is_nearer(planes: int) -> None:
    rng = np.random.default_rng(planes)
    compared = 0
    for _ in range(40):
        balls, half_spaces = sets_around(rng, planes)
        point = rng.normal(size=3)
        found = nearest(point, balls, half_spaces)
        assert found is not None
        sets: list[Ball | HalfSpace] = [*balls, *half_spaces]
        assert all(s.excess(found) <= 1e-10 for s in sets)
        other = minimize(
            lambda x, p=point: np.sum((x - p) ** 2),
            found + 1e-3,
            constraints=[
                {"type": "ineq", "fun": lambda x, b=b: b.radius**2 - np.sum((x - b.center) ** 2)}
                for b in balls
            ]
            + [
                {"type": "ineq", "fun": lambda x, h=h: h.offset - h.normal @ x} for h in half_spaces
            ],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 300},
        )
        worst = max(s.excess(other.x) for s in sets)
        if other.success and worst < 1e-8:
            nearer = np.linalg.norm(found - point) - np.linalg.norm(other.x - point)
            assert nearer < 1e-6
            compared += 1
    assert compared > 20


@settings(max_examples=200)
@given(st.integers(0, 2**32 - 1))
def test_projection_makes_an_obtuse_angle_with_every_point_of_the_sets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    balls, half_spaces = sets_around(rng, 2)
    point = rng.normal(size=3)
    found = nearest(point, balls, half_spaces)
    assert found is not None
    for _ in range(20):
        other = nearest(rng.normal(size=3), balls, half_spaces)
        assert other is not None
        assert (point - found) @ (other - found) <= 1e-9


def test_point_inside_is_not_moved() -> None:
    point = np.array([0.1, -0.2, 0.05])
    ball = Ball(np.zeros(3), 1.0)
    assert nearest(point, [ball], [HalfSpace(np.array([1.0, 0.0, 0.0]), 0.2)]) is point


def test_sets_that_do_not_meet_have_no_nearest_point() -> None:
    x = np.array([1.0, 0.0, 0.0])
    assert nearest(x, [Ball(np.zeros(3), 0.1), Ball(x, 0.1)], []) is None
    assert nearest(x, [Ball(np.zeros(3), 0.1)], [HalfSpace(x, -0.2)]) is None


def test_sets_that_touch_meet_in_that_point() -> None:
    x = np.array([1.0, 0.0, 0.0])
    found = nearest(np.ones(3), [Ball(np.zeros(3), 0.5)], [HalfSpace(x, -0.5)])
    assert found is not None
    np.testing.assert_allclose(found, [-0.5, 0.0, 0.0], atol=1e-9)
