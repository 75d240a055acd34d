"""The local problem's optimum: its conditions, the exact one beside it, and what it feeds back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.local.problems import random_problem
from drake_dress.models.control.constrained_ddp import (
    Settings,
    _at,
    _backward,
    _room,
    feedback_gains,
    solve_constrained_ddp,
)
from drake_dress.models.control.local_problem import LocalProblem, LocalSolution, NormBounds
from drake_dress.solvers.cone_programme import solve_cone_programme

seeds = st.integers(0, 2**31)


def drawn(seed: int) -> LocalProblem:
    return random_problem(np.random.default_rng(seed))[0]


def unbounded(problem: LocalProblem) -> LocalProblem:
    """Returns the problem without its bounds."""

    everything = np.bool_(True)
    return replace(
        problem,
        state_bounds=without(problem.state_bounds, everything),
        input_bounds=without(problem.input_bounds, everything),
    )


def without(bounds: NormBounds, which: np.ndarray | np.bool_) -> NormBounds:
    """Returns bounds of which those (T,K) do not count."""
    return replace(bounds, radius=np.where(which, np.inf, bounds.radius))


def slope(p: LocalProblem, s: LocalSolution) -> np.ndarray:
    """Returns (N,m) the derivative of the Lagrangian by the inputs."""
    by_state = 2.0 * p.state_weight * (s.x - p.state_target)
    by_input = 2.0 * p.input_weight * (s.v - p.input_target)
    for bounds, z, multiplier, out in (
        (p.state_bounds, s.x, s.state_multiplier, by_state),
        (p.input_bounds, s.v, s.input_multiplier, by_input),
    ):
        y = np.einsum("tkab,tb->tka", bounds.matrix, z) + bounds.offset
        length = np.maximum(np.linalg.norm(y, axis=2), 1e-12)
        out += np.einsum("tk,tkab,tka->tb", multiplier / length, bounds.matrix, y)
    later = np.cumsum(by_state[:0:-1], axis=0)[::-1]
    return by_input + later @ p.input_matrix


@given(seed=seeds)
@settings(max_examples=40, deadline=None)
def test_the_conditions_of_optimality_hold(seed: int) -> None:
    p = drawn(seed)
    s = solve_constrained_ddp(p)
    assert s.converged
    assert s.violation < 1e-6
    assert s.state_multiplier.min() >= 0.0
    assert s.input_multiplier.min() >= 0.0
    typical = np.abs(slope(unbounded(p), replace_multipliers(s))).max()
    assert np.abs(slope(p, s)).max() < 1e-5 * typical
    # a bound with a multiplier is met
    for bounds, z, multiplier in (
        (p.state_bounds, s.x, s.state_multiplier),
        (p.input_bounds, s.v, s.input_multiplier),
    ):
        excess = bounds.excess(z)
        assert np.all(np.abs(excess[multiplier > 1e-6 * typical]) < 1e-5)


def replace_multipliers(s: LocalSolution) -> LocalSolution:
    return replace(
        s, state_multiplier=0.0 * s.state_multiplier, input_multiplier=0.0 * s.input_multiplier
    )


@given(seed=seeds, sweeps=st.sampled_from([0, 1, 2, 20]), inside=st.sampled_from([1, 120]))
@settings(max_examples=40, deadline=None)
def test_it_has_converged_only_where_it_ended_at_an_optimum(
    seed: int, sweeps: int, inside: int
) -> None:
    p = drawn(seed)
    s = solve_constrained_ddp(p, settings=Settings(max_sweeps=sweeps, max_interior_steps=inside))
    typical = np.abs(slope(unbounded(p), replace_multipliers(s))).max()
    optimal = np.abs(slope(p, s)).max() < 1e-6 * typical and s.violation < 1e-6
    assert optimal or not s.converged
    if sweeps == 0 or inside == 1:
        assert not s.converged
    if sweeps == 20 and inside == 120:
        assert s.converged


def test_rows_without_room_are_told_and_none_is_left_out() -> None:
    """All bounds active at all steps: what they hand from step to step outgrows the first room."""
    p = drawn(11)
    s = solve_constrained_ddp(p)
    steps, m = p.input_weight.shape
    n, hessian = len(p.start), np.zeros((steps + 1, len(p.start), len(p.start)))
    hessian[:, range(n), range(n)] = 2.0 * p.state_weight
    x_slope = 2.0 * p.state_weight * (s.x - p.state_target)
    v_slope = 2.0 * p.input_weight * (s.v - p.input_target)
    on_x = _at(p.state_bounds, s.x, np.ones_like(s.state_multiplier))
    on_v = _at(p.input_bounds, s.v, np.ones_like(s.input_multiplier))

    def passed(rows: int) -> tuple[int, np.ndarray]:
        law = _room(steps, n, m, rows)
        arguments = (p.input_matrix, hessian, 2.0 * p.input_weight, x_slope, v_slope, on_x, on_v)
        return _backward(*arguments, law), law.number

    of_a_step = on_x.radius.shape[1] + on_v.radius.shape[1]
    dropped, number = passed(of_a_step + n)
    assert dropped > 0 and number.max() == of_a_step + n
    dropped, number = passed(steps * of_a_step)
    assert dropped == 0 and number.max() > of_a_step + n
    # gains are there all the same
    ones = replace(
        s,
        state_multiplier=np.ones_like(s.state_multiplier),
        input_multiplier=np.ones_like(s.input_multiplier),
    )
    assert np.isfinite(feedback_gains(p, ones)).all()


@given(seed=seeds)
@settings(max_examples=15, deadline=None)
def test_the_cone_programme_finds_the_same_optimum(seed: int) -> None:
    p = drawn(seed)
    s, (exact, _) = solve_constrained_ddp(p), solve_cone_programme(p)
    assert exact.converged
    assert s.cost == pytest.approx(exact.cost, rel=1e-5)
    np.testing.assert_allclose(s.v, exact.v, atol=2e-3)


def test_without_bounds_it_is_least_squares() -> None:
    p = unbounded(drawn(1))
    s = solve_constrained_ddp(p)
    steps, m = p.input_weight.shape
    sums = np.kron(np.tril(np.ones((steps, steps))), p.input_matrix)
    root_w, root_r = np.sqrt(p.state_weight[1:].ravel()), np.sqrt(p.input_weight.ravel())
    rows = np.vstack([root_w[:, None] * sums, np.diag(root_r)])
    right = np.concatenate(
        [root_w * (p.state_target[1:] - p.start).ravel(), root_r * p.input_target.ravel()]
    )
    best = np.linalg.lstsq(rows, right)[0].reshape(steps, m)
    np.testing.assert_allclose(s.v, best, atol=1e-8)


@given(seed=seeds)
@settings(max_examples=10, deadline=None)
def test_a_solution_is_its_own_start(seed: int) -> None:
    p = drawn(seed)
    s = solve_constrained_ddp(p)
    again = solve_constrained_ddp(p, s.v, s.state_multiplier, s.input_multiplier)
    assert again.converged
    assert again.interior_steps == 0
    assert again.sweeps <= 3
    np.testing.assert_allclose(again.v, s.v, atol=1e-5)


@given(seed=seeds, size=st.sampled_from([1e-3, 1.0, 1e3, 1e6]))
@settings(max_examples=20, deadline=None)
def test_the_optimum_does_not_depend_on_the_start(seed: int, size: float) -> None:
    p = drawn(seed)
    best = solve_constrained_ddp(p)
    rng = np.random.default_rng(seed)
    s = solve_constrained_ddp(
        p,
        size * rng.standard_normal(best.v.shape),
        size * rng.standard_normal(best.state_multiplier.shape),
        size * rng.standard_normal(best.input_multiplier.shape),
    )
    assert s.converged
    assert s.violation < 1e-6
    assert s.cost == pytest.approx(best.cost, rel=1e-4)


def strict(p: LocalProblem) -> tuple[LocalProblem, LocalSolution]:
    """Returns the problem without the bounds that are just about to become active, or to let go.

    About its optimum the active bounds stay the same, so that there is a derivative.
    """
    for _ in range(30):
        s = solve_constrained_ddp(p)
        weak = []
        for bounds, z, multiplier in (
            (p.state_bounds, s.x, s.state_multiplier),
            (p.input_bounds, s.v, s.input_multiplier),
        ):
            close = np.abs(bounds.excess(z)) < 1e-4
            weak.append(np.where(multiplier > 0.0, multiplier < 1e-4, close))
        weak[0][0] = False
        if not any(w.any() for w in weak):
            return p, s
        p = replace(
            p,
            state_bounds=without(p.state_bounds, weak[0]),
            input_bounds=without(p.input_bounds, weak[1]),
        )
    raise AssertionError("bounds that are about to become active remain")


@given(seed=seeds)
@settings(max_examples=15, deadline=None)
def test_gains_are_the_derivative_of_the_first_input_by_the_state(seed: int) -> None:
    p, s = strict(drawn(seed))
    assert (s.input_multiplier > 0.0).any() or (s.state_multiplier > 0.0).any()
    gain = feedback_gains(p, s)[0]
    way = np.random.default_rng(seed).normal(0.0, 1.0, len(p.start))
    small = 1e-6
    changed = [
        solve_constrained_ddp(
            replace(p, start=p.start + sign * small * way),
            s.v,
            s.state_multiplier,
            s.input_multiplier,
        ).v[0]
        for sign in (1.0, -1.0)
    ]
    measured = (changed[0] - changed[1]) / (2.0 * small)
    np.testing.assert_allclose(gain @ way, measured, atol=2e-3 * np.abs(measured).max())


def test_bounds_that_say_the_same_twice_do_no_harm() -> None:
    p = drawn(5)

    def twice(bounds: NormBounds) -> NormBounds:
        return NormBounds(
            np.concatenate([bounds.matrix, bounds.matrix], axis=1),
            np.concatenate([bounds.offset, bounds.offset], axis=1),
            np.concatenate([bounds.radius, bounds.radius], axis=1),
        )

    doubled = replace(p, state_bounds=twice(p.state_bounds), input_bounds=twice(p.input_bounds))
    s, same = solve_constrained_ddp(p), solve_constrained_ddp(doubled)
    assert same.converged
    assert same.violation < 1e-6
    assert same.cost == pytest.approx(s.cost, rel=1e-6)


def test_bounds_that_nothing_obeys_are_exceeded_by_the_least_sum() -> None:
    p = drawn(7)
    bounds = p.state_bounds
    matrix, offset, radius = bounds.matrix.copy(), bounds.offset.copy(), bounds.radius.copy()
    # one sleeve would have to be in two places, 2 m apart
    matrix[5, 3:], radius[5, 3:] = 0.0, 1e-3
    matrix[5, 3:, :, :3] = np.eye(3)
    offset[5, 3], offset[5, 4] = [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]
    q = replace(p, state_bounds=NormBounds(matrix, offset, radius))
    s = solve_constrained_ddp(q)
    assert s.converged
    excess = np.maximum(q.state_bounds.excess(s.x), 0.0)
    excess[0] = 0.0
    assert s.violation == pytest.approx(excess.max())
    assert excess[5, 3:].sum() == pytest.approx(2.0 - 2e-3, abs=1e-5)
    # all others are kept
    excess[5, 3:] = 0.0
    assert excess.max() < 1e-6
    assert q.input_bounds.excess(s.v).max() < 1e-6


def test_the_null_space_hands_a_bound_to_the_step_before() -> None:
    """A state that its own input cannot bring in time has to be on its way earlier."""
    p = unbounded(drawn(3))
    steps = p.horizon
    state, inputs = p.state_bounds, p.input_bounds
    x_radius, v_radius = state.radius.copy(), inputs.radius.copy()
    x_matrix, x_offset = state.matrix.copy(), state.offset.copy()
    v_matrix, v_offset = inputs.matrix.copy(), inputs.offset.copy()
    x_matrix[-1, 0], x_offset[-1, 0], x_radius[-1, 0] = 0.0, [0.3, 0.0, 0.0], 0.01
    x_matrix[-1, 0, :, 6:9] = np.eye(3)
    v_matrix[:, 2], v_offset[:, 2], v_radius[:, 2] = 0.0, 0.0, 0.32
    v_matrix[:, 2, :, :3] = np.eye(3)
    p = replace(
        p,
        state_bounds=NormBounds(x_matrix, x_offset, x_radius),
        input_bounds=NormBounds(v_matrix, v_offset, v_radius),
    )
    s = solve_constrained_ddp(p)
    assert s.converged
    # 29 cm in 20 steps of 1.6 cm at most: nearly all of them at full speed, none faster
    np.testing.assert_allclose(np.linalg.norm(s.x[-1, 6:9] + [0.3, 0.0, 0.0]), 0.01, atol=1e-6)
    assert np.sum(np.linalg.norm(s.v[:, :3], axis=1) > 0.3199) > steps // 2
    assert s.cost == pytest.approx(solve_cone_programme(p)[0].cost, rel=1e-5)
