"""The local problem's optimum: its conditions, the exact one beside it, and what it feeds back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchmarks.local.problems import random_problem
from drake_dress.models.control.constrained_ddp import (
    Settings,
    _at,
    feedback_gains,
    solve_constrained_ddp,
)
from drake_dress.models.control.ddp_passes import backward, room
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.norm_bounds import NormBounds
from drake_dress.models.control.solution import Solution
from drake_dress.solvers.cone_programme import solve_cone_programme
from tests.present import present

seeds = st.integers(0, 2**31)


def drawn(seed: int) -> LocalProblem:
    return random_problem(np.random.default_rng(seed))[0]


def drawn_of_size(seed: int, steps: int, n: int, m: int) -> LocalProblem:
    """Returns a problem of other sizes, with bounds that some way obeys."""
    rng = np.random.default_rng(seed)
    b, start = rng.normal(0.0, 0.5, (n, m)), rng.normal(0.0, 0.3, n)
    obeying = rng.normal(0.0, 0.2, (steps, m))
    way = start + np.cumsum(np.vstack([np.zeros(n), obeying @ b.T]), axis=0)

    def about(z: np.ndarray, count: int) -> NormBounds:
        matrix = rng.normal(0.0, 1.0, (len(z), count, 3, z.shape[1]))
        offset = rng.normal(0.0, 0.1, (len(z), count, 3))
        needed = NormBounds(matrix, offset, np.empty(matrix.shape[:2])).norms(z)
        return NormBounds(matrix, offset, 1.01 * needed + rng.uniform(0.01, 0.5, needed.shape))

    return LocalProblem(
        start=start,
        input_matrix=b,
        state_weight=rng.uniform(0.0, 2.0, (steps + 1, n)),
        state_target=way + rng.normal(0.0, 1.0, n),
        input_weight=10.0 ** rng.uniform(-2.0, 0.0, (steps, m)),
        input_target=rng.normal(0.0, 0.3, (steps, m)),
        state_bounds=about(way, 2),
        input_bounds=about(obeying, 1),
        price=1e4,
    )


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


def slope(p: LocalProblem, s: Solution) -> np.ndarray:
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


def assert_optimal(p: LocalProblem, s: Solution) -> None:
    assert s.converged
    assert s.violation < 1e-6
    assert s.state_multiplier.min() >= 0.0
    assert s.input_multiplier.min() >= 0.0
    typical = np.abs(slope(unbounded(p), replace_multipliers(s))).max()
    assert np.abs(slope(p, s)).max() < 1e-5 * typical + 1e-12
    # a bound with a multiplier is met
    for bounds, z, multiplier in (
        (p.state_bounds, s.x, s.state_multiplier),
        (p.input_bounds, s.v, s.input_multiplier),
    ):
        excess = bounds.excess(z)
        assert np.all(np.abs(excess[multiplier > 1e-6 * typical]) < 1e-5)


@given(seed=seeds)
@settings(max_examples=40)
def test_the_conditions_of_optimality_hold(seed: int) -> None:
    p = drawn(seed)
    assert_optimal(p, solve_constrained_ddp(p))


def replace_multipliers(s: Solution) -> Solution:
    return replace(
        s, state_multiplier=0.0 * s.state_multiplier, input_multiplier=0.0 * s.input_multiplier
    )


@given(seed=seeds, sweeps=st.sampled_from([0, 1, 2, 20]), inside=st.sampled_from([1, 120]))
@settings(max_examples=40)
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
        law = room(steps, n, m, rows)
        b = np.tile(p.input_matrix, (steps, 1, 1))
        arguments = (None, b, hessian, 2.0 * p.input_weight, x_slope, v_slope, on_x, on_v)
        return backward(*arguments, law), law.number

    of_a_step = on_x.radius.shape[1] + on_v.radius.shape[1]
    dropped, number = passed(of_a_step + n)
    assert dropped > 0
    assert number.max() == of_a_step + n
    dropped, number = passed(steps * of_a_step)
    assert dropped == 0
    assert number.max() > of_a_step + n
    # gains are there all the same
    ones = replace(
        s,
        state_multiplier=np.ones_like(s.state_multiplier),
        input_multiplier=np.ones_like(s.input_multiplier),
    )
    assert np.isfinite(feedback_gains(p, ones)).all()


@given(seed=seeds)
@settings(max_examples=15)
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
@settings(max_examples=10)
def test_a_solution_is_its_own_start(seed: int) -> None:
    p = drawn(seed)
    s = solve_constrained_ddp(p)
    again = solve_constrained_ddp(p, s.v, s.state_multiplier, s.input_multiplier)
    assert again.converged
    assert again.interior_steps == 0
    assert again.sweeps <= 3
    np.testing.assert_allclose(again.v, s.v, atol=1e-5)


@given(seed=seeds, size=st.sampled_from([1e-3, 1.0, 1e3, 1e6]))
@settings(max_examples=20)
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


def strict(p: LocalProblem) -> tuple[LocalProblem, Solution]:
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
@settings(max_examples=15)
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


sizes = st.tuples(st.integers(1, 8), st.integers(1, 7), st.integers(1, 5))


@given(seed=seeds, size=sizes)
@settings(max_examples=30)
def test_a_problem_without_any_bound_has_an_optimum(seed: int, size: tuple[int, int, int]) -> None:
    p = unbounded(drawn_of_size(seed, *size))
    assert_optimal(p, solve_constrained_ddp(p))


@given(seed=seeds, size=sizes)
@example(seed=326, size=(7, 1, 5))  # slacks vanished before a far bound was kept
@settings(max_examples=30)
def test_they_hold_whatever_the_numbers_of_steps_states_and_inputs(
    seed: int, size: tuple[int, int, int]
) -> None:
    p = drawn_of_size(seed, *size)
    s = solve_constrained_ddp(p)
    assert_optimal(p, s)
    again = solve_constrained_ddp(p, s.v, s.state_multiplier, s.input_multiplier)
    assert_optimal(p, again)
    assert again.cost == pytest.approx(s.cost, rel=1e-6)


def assert_gains_lead_to_the_optimum(p: LocalProblem, s: Solution, seed: int) -> None:
    """The law v + K δx, from a start that is a little off, is the optimum from there."""
    gain = feedback_gains(p, s)
    assert gain.shape == (p.horizon, p.input_matrix.shape[1], len(p.start))
    small = 1e-6
    way = small * np.random.default_rng(seed).normal(0.0, 1.0, len(p.start))
    pairs = []
    for off in (way, -way):
        best = solve_constrained_ddp(
            replace(p, start=p.start + off), s.v, s.state_multiplier, s.input_multiplier
        )
        dx, dv = off, []
        for of_step in gain:
            dv.append(of_step @ dx)
            dx = dx + p.input_matrix @ dv[-1]
        pairs.append((np.array(dv), best.v))
    by_law, by_optimum = (
        (plus - minus) / (2.0 * small) for plus, minus in zip(*pairs, strict=True)
    )
    np.testing.assert_allclose(by_law, by_optimum, atol=2e-3 * np.abs(by_optimum).max())


@given(seed=seeds)
@settings(max_examples=8)
def test_gains_lead_to_the_optimum_from_where_the_state_is_instead(seed: int) -> None:
    p, s = strict(drawn(seed))
    assert_gains_lead_to_the_optimum(p, s, seed)


@given(seed=seeds, size=sizes)
@settings(max_examples=20)
def test_so_they_do_whatever_the_sizes(seed: int, size: tuple[int, int, int]) -> None:
    p, s = strict(drawn_of_size(seed, *size))
    assert_gains_lead_to_the_optimum(p, s, seed)


@given(seed=seeds)
@settings(max_examples=8)
def test_a_multiplier_is_what_a_wider_bound_saves(seed: int) -> None:
    p, s = strict(drawn(seed))
    warm = s.v, s.state_multiplier, s.input_multiplier
    small = 1e-6

    def saved(name: str, multiplier: np.ndarray) -> float:
        bounds, costs = getattr(p, name), []
        for sign in (1.0, -1.0):
            radius = bounds.radius.copy()
            radius[np.unravel_index(multiplier.argmax(), multiplier.shape)] += sign * small
            q = replace(p, **{name: replace(bounds, radius=radius)})
            costs.append(solve_constrained_ddp(q, *warm).cost)
        return (costs[1] - costs[0]) / (2.0 * small)

    for name, multiplier in (
        ("state_bounds", s.state_multiplier),
        ("input_bounds", s.input_multiplier),
    ):
        assert saved(name, multiplier) == pytest.approx(multiplier.max(), rel=1e-3, abs=1e-5)


@given(
    seed=seeds,
    limits=st.builds(
        Settings,
        warm_sweeps=st.integers(0, 4),
        max_sweeps=st.integers(0, 20),
        max_halvings=st.integers(1, 12),
        max_interior_steps=st.sampled_from([0, 1, 9, 120]),
    ),
    has_guess=st.booleans(),
    is_warm=st.booleans(),
)
@settings(max_examples=40)
def test_whatever_it_ends_with_is_reported_as_it_is(
    seed: int, limits: Settings, has_guess: bool, is_warm: bool
) -> None:
    rng = np.random.default_rng(seed)
    p = drawn(seed)
    guess = rng.normal(0.0, 0.1, p.input_weight.shape) if has_guess else None
    on_x, on_v = (
        rng.uniform(0.0, 1.0, b.radius.shape) if is_warm else None
        for b in (p.state_bounds, p.input_bounds)
    )
    given_ones = [p.state_bounds.radius, p.input_bounds.radius, guess, on_x, on_v]
    before = [None if a is None else a.copy() for a in given_ones]
    s = solve_constrained_ddp(p, guess, on_x, on_v, limits)
    # what was handed in is as it was
    for a, was in zip(given_ones, before, strict=True):
        assert a is None or np.array_equal(a, present(was))
    assert s.v.shape == p.input_weight.shape
    assert np.isfinite(s.v).all()
    np.testing.assert_array_equal(s.x, p.states(s.v))
    assert s.cost == p.cost(s.v)
    assert s.violation == p.violation(s.v)
    for bounds, multiplier in (
        (p.state_bounds, s.state_multiplier),
        (p.input_bounds, s.input_multiplier),
    ):
        assert multiplier.shape == bounds.radius.shape
        assert multiplier.min() >= 0.0
        assert not multiplier[np.isinf(bounds.radius)].any()
    # the start is not up to anyone
    assert not s.state_multiplier[0].any()
    most, of_guess = limits.max_interior_steps, limits.max_interior_steps // 3
    assert s.interior_steps <= most + of_guess * has_guess
    assert s.sweeps <= limits.max_sweeps + limits.warm_sweeps * is_warm
    if not is_warm and most == 0:
        assert not s.converged


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("is_warm", [False, True])
@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["start", "state_target", "input_target"])
def test_what_has_no_optimum_is_answered_by_standing_still(
    name: str, value: float, is_warm: bool
) -> None:
    p = drawn(2)
    broken = getattr(p, name).copy()
    broken[-1] = value
    s = solve_constrained_ddp(p)
    warm = (s.v, s.state_multiplier, s.input_multiplier) if is_warm else ()
    told = solve_constrained_ddp(replace(p, **{name: broken}), *warm)
    assert not told.converged
    for out in (told.v, told.state_multiplier, told.input_multiplier):
        assert not out.any()


@given(seed=seeds, price=st.sampled_from([1e-3, 1e-2, 0.1, 1.0]))
@settings(max_examples=10)
def test_bounds_are_exceeded_that_cost_more_than_their_price(seed: int, price: float) -> None:
    p = replace(drawn(seed), price=price)
    s, (exact, _) = solve_constrained_ddp(p), solve_cone_programme(p, spills=True)
    assert exact.converged

    def total(v: np.ndarray) -> float:
        return p.cost(v) + price * p.spilled(v)

    assert total(s.v) == pytest.approx(total(exact.v), rel=1e-5)
    for multiplier in (s.state_multiplier, s.input_multiplier):
        assert multiplier.max() <= price * (1.0 + 1e-6)
