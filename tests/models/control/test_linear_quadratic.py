"""Constrained DDP on problems of any linear dynamics and weights, held against other solutions."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from benchmarks.local.problems import random_problem
from drake_dress.models.control.constrained_ddp import feedback_gains, solve_constrained_ddp
from drake_dress.models.control.linear_quadratic import LinearQuadraticProblem, linear_quadratic
from drake_dress.models.control.norm_bounds import NormBound

seeds = st.integers(0, 2**31)
sizes = st.tuples(st.integers(1, 9), st.integers(1, 5), st.integers(1, 4))


def positive(rng: np.random.Generator, count: int, size: int, rank: int) -> np.ndarray:
    """Returns (count,size,size) symmetric matrices of a rank."""
    root = rng.normal(0.0, 1.0, (count, size, rank))
    return root @ np.swapaxes(root, 1, 2)


def drawn(seed: int, steps: int, n: int, m: int, bounded: bool = True) -> LinearQuadraticProblem:
    """Returns a problem with bounds that some way obeys."""
    rng = np.random.default_rng(seed)
    a = np.eye(n) + 0.3 * rng.normal(0.0, 1.0, (steps, n, n))
    b, c = rng.normal(0.0, 0.5, (steps, n, m)), rng.normal(0.0, 0.1, (steps, n))
    start, obeying = rng.normal(0.0, 0.3, n), rng.normal(0.0, 0.2, (steps, m))
    q = positive(rng, steps + 1, n, 1 + int(rng.integers(n)))
    r = positive(rng, steps, m, m) + 0.05 * np.eye(m)
    free = linear_quadratic(start, (a, b, c), (q, r), steps)
    way = free.states(obeying)

    def about(z: np.ndarray) -> NormBound:
        matrix = rng.normal(0.0, 1.0, (int(rng.integers(1, 4)), z.shape[1]))
        offset = rng.normal(0.0, 0.1, len(matrix))
        needed = np.linalg.norm(z @ matrix.T + offset, axis=1)
        return NormBound(matrix, 1.01 * needed + rng.uniform(0.01, 0.5, len(z)), offset)

    targets = (way + rng.normal(0.0, 1.0, n), rng.normal(0.0, 0.3, (steps, m)))
    return linear_quadratic(
        start,
        (a, b, c),
        (q, r),
        steps,
        targets=targets,
        state_bounds=[about(way[1:]) for _ in range(2)] if bounded else (),
        input_bounds=[about(obeying)] if bounded else (),
        price=1e5,
    )


def by_cone_programme(p: LinearQuadraticProblem) -> np.ndarray:
    """Returns the inputs (N,m) that Clarabel finds."""
    program: Any = MathematicalProgram()
    steps, n, m = p.b.shape
    v = program.NewContinuousVariables(steps, m, "v")
    states = program.NewContinuousVariables(steps, n, "x")
    for j in range(steps):
        at_start = j == 0
        before = np.zeros((n, 0)) if at_start else -p.a[j]
        variables = [states[j], v[j]] if at_start else [states[j], states[j - 1], v[j]]
        program.AddLinearEqualityConstraint(
            np.hstack([np.eye(n), before, -p.b[j]]),
            p.c[j] + p.a[j] @ p.start if at_start else p.c[j],
            np.concatenate(variables),
        )
        for weight, target, z in (
            (p.state_weight[j + 1], p.state_target[j + 1], states[j]),
            (p.input_weight[j], p.input_target[j], v[j]),
        ):
            program.AddQuadraticCost(
                2.0 * weight, -2.0 * weight @ target, target @ weight @ target, z, True
            )
        for bounds, t, z in ((p.state_bounds, j + 1, states[j]), (p.input_bounds, j, v[j])):
            for matrix, offset, radius in zip(
                bounds.matrix[t], bounds.offset[t], bounds.radius[t], strict=True
            ):
                if np.isfinite(radius):
                    program.AddLorentzConeConstraint(
                        np.vstack([np.zeros((1, len(z))), matrix]), [radius, *offset], z
                    )
    result = ClarabelSolver().Solve(program)
    assert result.is_success()
    return np.reshape(result.GetSolution(v), (steps, m))


@given(seed=seeds, size=sizes)
@settings(max_examples=30)
def test_the_cone_programme_finds_the_same_optimum(seed: int, size: tuple[int, int, int]) -> None:
    p = drawn(seed, *size)
    s = solve_constrained_ddp(p)
    assert s.converged
    assert s.violation < 1e-6
    exact = p.cost(by_cone_programme(p))
    assert s.cost == pytest.approx(exact, rel=1e-4, abs=1e-6)


@given(seed=seeds, size=sizes)
@settings(max_examples=20)
def test_without_bounds_no_input_lowers_the_cost(seed: int, size: tuple[int, int, int]) -> None:
    p = drawn(seed, *size, bounded=False)
    s = solve_constrained_ddp(p)
    assert s.converged
    assert s.state_multiplier.shape[1] == s.input_multiplier.shape[1] == 0
    rng = np.random.default_rng(seed)
    way, small = rng.normal(0.0, 1.0, s.v.shape), 1e-3
    more, less = p.cost(s.v + small * way), p.cost(s.v - small * way)
    # the cost is a quadratic: about its least value it is even
    curvature = more + less - 2.0 * s.cost
    assert curvature > 0.0
    assert abs(more - less) < 1e-4 * curvature + 1e-9 * (1.0 + abs(s.cost))


@given(seed=seeds)
@settings(max_examples=10)
def test_a_local_problem_is_one_of_these(seed: int) -> None:
    local = random_problem(np.random.default_rng(seed))[0]
    steps, n = local.horizon, len(local.start)

    def diagonal(weight: np.ndarray) -> np.ndarray:
        return weight[:, :, None] * np.eye(weight.shape[1])

    general = LinearQuadraticProblem(
        local.start,
        np.tile(np.eye(n), (steps, 1, 1)),
        np.tile(local.input_matrix, (steps, 1, 1)),
        np.zeros((steps, n)),
        diagonal(local.state_weight),
        local.state_target,
        diagonal(local.input_weight),
        local.input_target,
        local.state_bounds,
        local.input_bounds,
        local.price,
    )
    s, same = solve_constrained_ddp(local), solve_constrained_ddp(general)
    assert s.converged
    assert same.converged
    np.testing.assert_allclose(same.v, s.v, atol=1e-5)
    np.testing.assert_allclose(
        feedback_gains(general, same), feedback_gains(local, s), rtol=1e-3, atol=1e-4
    )


def car(**given_bounds: Any) -> LinearQuadraticProblem:
    """Returns a point in the plane, that is to be at rest at the origin; its input is a force."""
    h, steps = 0.1, 30
    a, b = np.eye(4), np.zeros((4, 2))
    a[:2, 2:], b[:2], b[2:] = h * np.eye(2), 0.5 * h * h * np.eye(2), h * np.eye(2)
    weights = (np.diag([1.0, 1.0, 0.1, 0.1]), np.array([[0.02, 0.01], [0.01, 0.02]]))
    return linear_quadratic([1.0, 0.5, 0.0, 0.0], (a, b), weights, steps, **given_bounds)


def test_a_point_mass_keeps_to_its_force_and_speed() -> None:
    velocity = np.eye(4)[2:]
    p = car(
        state_bounds=[NormBound(velocity, 0.6), NormBound.interval(np.eye(4)[1], 0.2, 1.0)],
        input_bounds=[NormBound(np.eye(2), 2.0)],
    )
    s = solve_constrained_ddp(p)
    assert s.converged
    speed, force = np.linalg.norm(s.x[:, 2:], axis=1), np.linalg.norm(s.v, axis=1)
    assert speed.max() == pytest.approx(0.6, abs=1e-6)
    assert force.max() == pytest.approx(2.0, abs=1e-6)
    assert s.x[1:, 1].min() == pytest.approx(0.2, abs=1e-6)
    free = solve_constrained_ddp(car())
    assert np.linalg.norm(free.v, axis=1).max() > 2.0
    assert free.cost < s.cost


def test_gains_are_the_derivative_of_the_first_input_by_the_state() -> None:
    bounds = {"input_bounds": [NormBound(np.eye(2), 2.0)]}
    p = car(**bounds)
    s = solve_constrained_ddp(p)
    assert (s.input_multiplier[0] > 1e-3).all()
    gain, small = feedback_gains(p, s)[0], 1e-5
    for way in np.eye(4):
        ends = [
            solve_constrained_ddp(
                replace(p, start=p.start + sign * small * way),
                s.v,
                s.state_multiplier,
                s.input_multiplier,
            ).v[0]
            for sign in (1.0, -1.0)
        ]
        np.testing.assert_allclose(gain @ way, (ends[0] - ends[1]) / (2.0 * small), atol=2e-3)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"start": [[1.0]]}, "start has the shape"),
        ({"start": [np.nan, 0.0]}, "start is not finite"),
        ({"dynamics": (np.eye(3), np.eye(2))}, "A has the shape (3, 3)"),
        ({"dynamics": (np.eye(2), np.ones((3, 1)))}, "B has the shape (3, 1)"),
        ({"weights": (np.eye(2), -np.eye(2))}, "R has the eigenvalue -1, expected positive def"),
        ({"weights": (np.eye(2), np.zeros((2, 2)))}, "R has the eigenvalue 0"),
        ({"weights": (-np.eye(2), np.eye(2))}, "Q has the eigenvalue -1, expected positive semi"),
        ({"weights": (np.array([[1.0, 1.0], [0.0, 1.0]]), np.eye(2))}, "Q is not symmetric"),
        ({"steps": 0}, "steps is 0"),
        ({"targets": (np.zeros(3), 0.0)}, "target of states has the shape (3,)"),
        ({"state_bounds": [NormBound(np.ones((4, 2)), 1.0)]}, "matrix of the shape (4, 2)"),
        ({"state_bounds": [NormBound(np.eye(2), 0.0)]}, "radius 0.0, expected a positive"),
        ({"input_bounds": [NormBound(np.eye(2), np.ones(3))]}, "expected a positive number or 5"),
        ({"input_bounds": [NormBound(np.eye(2), 1.0, [1.0])]}, "offset of the shape (1,)"),
    ],
)
def test_what_is_no_problem_is_told(changed: dict[str, Any], told: str) -> None:
    given_arrays: dict[str, Any] = {
        "start": [0.0, 0.0],
        "dynamics": (np.eye(2), np.eye(2)),
        "weights": (np.eye(2), np.eye(2)),
        "steps": 5,
    }
    assert linear_quadratic(**given_arrays).horizon == 5
    with pytest.raises(ValueError, match=re.escape(told)):
        linear_quadratic(**(given_arrays | changed))


def test_an_interval_needs_room() -> None:
    with pytest.raises(ValueError, match="expected low < high"):
        NormBound.interval([1.0, 0.0], 1.0, 1.0)
