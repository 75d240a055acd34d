"""Least squares over recordings whose simulation is a little off."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.discrepancy.regression import (
    Extrapolation,
    Solution,
    misleading,
    solve_bounded,
    solve_pooled,
)
from drake_dress.models.arrays import FloatArray, IndexArray

RECORDINGS, SAMPLES = 5, 400
# What the module's docstrings say: a voice alone knows a parameter to 30 sizes that matter, and
# voices scatter by 3 of them at the most.
VAGUE, MOST_SCATTER = 30.0, 3.0

seeds = st.integers(0, 2**31)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture
def recording() -> IndexArray:
    return np.repeat(np.arange(RECORDINGS), SAMPLES)


def test_bounded_least_squares_keeps_its_bounds() -> None:
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((200, 3))
    truth = np.array([1.0, -2.0, 0.5])
    residual = columns @ truth
    free = solve_bounded(columns, columns, residual, -np.inf, np.inf)
    np.testing.assert_allclose(free, truth, rtol=1e-4)
    bound = solve_bounded(columns, columns, residual, np.zeros(3), np.full(3, 0.8))
    assert np.all((bound >= -1e-9) & (bound <= 0.8 + 1e-9))
    assert bound[1] == pytest.approx(0.0)


def test_what_is_left_of_the_step_does_not_move_parameters(
    rng: np.random.Generator, recording: IndexArray
) -> None:
    count = len(recording)
    column, noise = rng.standard_normal((count, 1)), rng.standard_normal(count)
    # halving the step does half of what the effect does, and something else
    direction = 0.5 * column[:, 0] + 0.3 * rng.standard_normal(count)
    factor = rng.uniform(0.4, 1.1, RECORDINGS)[recording]
    residual = 0.8 * column[:, 0] + factor * direction + noise
    rows = np.ones(count, dtype=bool)
    free = Extrapolation(direction, recording)
    reduced = free.without(column, rows)
    x = solve_bounded(column, reduced, free.without(residual, rows), -np.inf, np.inf)
    misled = solve_bounded(column, column, residual, -np.inf, np.inf)
    assert abs(x[0] - 0.8) < 4.0 * np.sqrt(1.0 / (reduced[:, 0] @ reduced[:, 0]))
    assert abs(misled[0] - 0.8) > 0.2


def test_a_factor_is_found_by_the_rows_that_train(
    rng: np.random.Generator, recording: IndexArray
) -> None:
    direction = rng.standard_normal(len(recording))
    factor = np.arange(RECORDINGS)[recording] / 4.0
    train = np.arange(len(recording)) % 2 == 0
    left = Extrapolation(direction, recording).without(factor * direction, train)
    assert np.abs(left).max() < 0.02 * np.abs(direction).max()
    residual = np.where(train, 0.0, direction)
    np.testing.assert_array_equal(
        Extrapolation(direction, recording).without(residual, train), residual
    )


def test_recordings_that_agree_are_pooled_as_least_squares_pools_them(
    rng: np.random.Generator, recording: IndexArray
) -> None:
    columns = rng.standard_normal((len(recording), 2))
    residual = columns @ [0.5, -1.0] + rng.standard_normal(len(recording))
    found = solve_pooled(columns, columns, residual, recording, -np.inf, np.inf)
    plain = np.linalg.lstsq(columns, residual, rcond=None)[0]
    assert found.scatter < 0.05
    np.testing.assert_allclose(found.x, plain, atol=0.02)
    np.testing.assert_allclose(found.std, 1.0 / np.sqrt(len(recording)), rtol=0.3)


def test_one_recording_that_misleads_is_one_voice_among_five(
    rng: np.random.Generator, recording: IndexArray
) -> None:
    columns = rng.standard_normal((len(recording), 1))
    loud = recording == 1
    columns[loud] *= 10.0
    residual = 1.0 * columns[:, 0] + rng.standard_normal(len(recording))
    residual[loud] += 0.5 * columns[loud, 0]
    found = solve_pooled(columns, columns, residual, recording, -np.inf, np.inf)
    plain = np.linalg.lstsq(columns, residual, rcond=None)[0]
    assert plain[0] > 1.4
    assert found.x[0] < 1.2
    # and it says how sure that is
    assert abs(found.x[0] - 1.0) < 2.0 * found.std[0]
    assert 0.1 < found.scatter < 0.5


def test_a_recording_that_knows_nothing_has_no_voice(
    rng: np.random.Generator, recording: IndexArray
) -> None:
    columns = rng.standard_normal((len(recording), 2))
    columns[recording >= 2] = 0.0
    columns[recording == 1, 1] = 0.0
    residual = columns @ [0.5, -1.0] + rng.standard_normal(len(recording))
    found = solve_pooled(columns, columns, residual, recording, np.full(2, -5.0), np.full(2, 5.0))
    assert np.all(np.abs(found.x - [0.5, -1.0]) < 4.0 * found.std)
    assert np.all(found.std < 0.3)


def voices_that_say(
    estimates: npt.ArrayLike, information: Sequence[float]
) -> tuple[FloatArray, FloatArray, IndexArray]:
    """Returns a column, a residual and voices (N,), an entry each, that say what is asked for.

    Args:
        estimates: of the coefficient, by each voice alone.
        information: of each, 1 / variance.
    """
    column = np.sqrt(np.asarray(information, dtype=float))
    return column[:, None], column * np.asarray(estimates), np.arange(len(column))


def pooled(estimates: npt.ArrayLike, information: Sequence[float]) -> Solution:
    column, residual, voice = voices_that_say(estimates, information)
    return solve_pooled(column, column, residual, voice, -np.inf, np.inf)


@given(seed=seeds, count=st.integers(1, 4))
@settings(max_examples=30)
def test_a_direction_that_is_free_is_noise_of_standard_deviation_one_along_it(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    voice = rng.permutation(np.repeat(np.arange(count), 3))
    direction, values = rng.standard_normal(3 * count), rng.standard_normal((3 * count, 2))
    free = Extrapolation(direction, voice)
    before, every = values.copy(), np.ones(3 * count, dtype=bool)
    left = free.without(values, every)
    np.testing.assert_array_equal(values, before)
    shared = np.where(voice[:, None] == voice, np.outer(direction, direction), 0.0)
    np.testing.assert_allclose(left, np.linalg.solve(np.eye(3 * count) + shared, values), atol=1e-9)
    np.testing.assert_allclose(free.without(values[:, 0], every), left[:, 0], atol=1e-9)
    # a voice without rows that train keeps all
    trained = voice != 0
    np.testing.assert_array_equal(free.without(values, trained)[~trained], values[~trained])
    np.testing.assert_allclose(free.without(values, trained)[trained], left[trained], atol=1e-9)


@given(
    seed=seeds,
    k=st.integers(1, 4),
    size=st.sampled_from([1e-3, 1.0, 1e3]),
    is_pooled=st.booleans(),
)
@settings(max_examples=60)
def test_a_bounded_solution_meets_its_conditions_of_optimality(
    seed: int, k: int, size: float, is_pooled: bool
) -> None:
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((30, k)) * size ** rng.uniform(-1.0, 1.0, k)
    residual = columns @ rng.standard_normal(k) + np.linalg.norm(columns) * rng.standard_normal(30)
    low = rng.uniform(-1.0, 0.5, k)
    # some are held, some have no upper bound
    high = low + rng.choice([0.0, 0.5, np.inf], k)
    if is_pooled:
        one = np.zeros(30, dtype=int)
        x = solve_pooled(columns, columns, residual, one, low, high).x
    else:
        x = solve_bounded(columns, columns, residual, low, high)
    assert np.all((low <= x) & (x <= high))
    length = np.linalg.norm(columns, axis=0)
    slope = columns.T @ (columns @ x - residual) / length
    small = 1e-5 * (np.linalg.norm(residual) + np.linalg.norm(length * x))
    assert np.all((slope > -small) | np.isclose(x, high, rtol=1e-12))
    assert np.all((slope < small) | np.isclose(x, low, rtol=1e-12))


@given(seed=seeds)
@settings(max_examples=20)
def test_what_nothing_is_known_of_stays_as_near_to_zero_as_its_bounds_allow(seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((50, 3))
    columns[:, 1] = 0.0
    low = np.array([-0.5, rng.uniform(-2.0, 1.0), -0.5])
    high = low + 1.0
    # the first is at its bound
    residual = columns @ [2.0, 0.0, 0.2]
    x = solve_bounded(columns, columns, residual, low, high)
    assert x[0] == 0.5
    assert x[1] == pytest.approx(np.clip(0.0, low[1], high[1]), abs=1e-6)
    others = [0, 2]
    same = solve_bounded(
        columns[:, others], columns[:, others], residual, low[others], high[others]
    )
    np.testing.assert_allclose(x[others], same, atol=1e-6)


@pytest.mark.parametrize("between", [0.3, 1.0, 2.0, 2.5])
def test_two_voices_scatter_by_what_of_their_difference_noise_does_not_explain(
    between: float,
) -> None:
    information = 50.0
    off = np.sqrt(2.0 * (between**2 + 1.0 / information))
    found = pooled([0.0, off], [information] * 2)
    assert found.scatter == pytest.approx(between, rel=1e-3)
    assert found.x[0] == pytest.approx(0.5 * off, rel=1e-3)
    assert found.std[0] == pytest.approx(0.5 * off, rel=1e-3)


def test_voices_scatter_no_more_than_the_most() -> None:
    found = pooled([0.0, 40.0], [50.0] * 2)
    assert found.scatter == MOST_SCATTER
    assert found.std[0] == pytest.approx(np.sqrt((MOST_SCATTER**2 + 1 / 50.0) / 2.0))


@given(seed=seeds, k=st.integers(1, 3))
@settings(max_examples=20)
def test_one_voice_alone_does_not_scatter_and_is_least_squares(seed: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    columns, residual = rng.standard_normal((40, k)), 9.0 * rng.standard_normal(40)
    found = solve_pooled(columns, columns, residual, np.full(40, 3), -np.inf, np.inf)
    assert found.scatter == 0.0
    np.testing.assert_allclose(found.x, np.linalg.lstsq(columns, residual)[0], rtol=1e-4, atol=1e-5)
    covariance = np.linalg.inv(columns.T @ columns)
    np.testing.assert_allclose(found.std, np.sqrt(np.diag(covariance)), rtol=1e-6)


def test_voices_that_differ_by_no_more_than_noise_do_not_scatter() -> None:
    information = 50.0
    # the square of what they differ by, in its standard deviation, is just below 1 and just above
    for share, scatters in ((0.98, False), (1.02, True)):
        found = pooled([0.0, np.sqrt(2.0 * share / information)], [information] * 2)
        assert (found.scatter > 0.0) == scatters


def test_a_voice_that_knows_no_more_than_is_known_of_any_is_half_a_voice() -> None:
    """It may disagree by half as much again as the other two may by themselves."""
    estimates, vague = [0.0, 1.5], 1.0 / VAGUE**2
    found = pooled([*estimates, 0.0], [1e6, 1e6, vague])
    # Q(τ²) = d² / 2τ² = 2 ½ − 1
    assert found.scatter == pytest.approx(np.sqrt(1.5**2 / 3.0), rel=1e-3)
    # of voices that know nothing, as many as there are
    same = pooled([*estimates, *np.zeros(20)], [1e6, 1e6, *np.zeros(20)])
    assert same.scatter == pytest.approx(pooled(estimates, [1e6] * 2).scatter, rel=1e-9)


@given(seed=seeds, k=st.integers(1, 3), count=st.integers(2, 6))
@settings(max_examples=30)
def test_voices_are_pooled_by_the_random_effects_model(seed: int, k: int, count: int) -> None:
    """Each voice has an estimate of its own, of covariance N⁻¹ + τ² I, with Q(τ²) = dof.

    Q is lower where voices agree, with τ = 0, and higher where they disagree by more than τ may be.
    """
    rng = np.random.default_rng(seed)
    voice = np.repeat(np.arange(count), 30)
    columns = rng.standard_normal((30 * count, k)) * rng.uniform(2.0, 6.0, count)[voice, None]
    own = rng.normal(0.0, 10.0 ** rng.uniform(-2.0, 1.0), (count, k))
    residual = np.sum(columns * own[voice], axis=1) + rng.standard_normal(30 * count)
    found = solve_pooled(columns, columns, residual, voice, -np.inf, np.inf)
    estimates, weights = [], []
    for i in range(count):
        mine = columns[voice == i]
        covariance = np.linalg.inv(mine.T @ mine)
        estimates.append(covariance @ mine.T @ residual[voice == i])
        weights.append(np.linalg.inv(covariance + found.scatter**2 * np.eye(k)))
    covariance = np.linalg.inv(sum(weights))
    mean = covariance @ sum(w @ x for w, x in zip(weights, estimates, strict=True))
    np.testing.assert_allclose(found.x, mean, atol=1e-4)
    np.testing.assert_allclose(found.std, np.sqrt(np.diag(covariance)), rtol=1e-6)
    q = sum((x - mean) @ w @ (x - mean) for w, x in zip(weights, estimates, strict=True))
    share = q / ((count - 1) * k)
    if found.scatter == 0.0:
        assert share < 1.001
    elif found.scatter == MOST_SCATTER:
        assert share > 0.999
    else:
        assert share == pytest.approx(1.0, abs=1e-3)


@given(seed=seeds, k=st.integers(1, 3), shift=st.sampled_from([-5.0, 0.1, 5.0]))
@settings(max_examples=20)
def test_how_far_voices_are_misled_is_the_mean_square_weighted_by_what_they_know(
    seed: int, k: int, shift: float
) -> None:
    rng = np.random.default_rng(seed)
    voice = np.repeat(np.arange(3), 20)
    columns = rng.standard_normal((60, k)) * np.array([1.0, 5.0, 20.0])[voice, None]
    own = rng.normal(0.0, 1.0, (3, k))
    residual = np.sum(columns * own[voice], axis=1)
    known = np.array([np.sum(columns[voice == i] ** 2, axis=0) for i in range(3)])
    expected = np.sqrt(np.sum(known * own**2, axis=0) / np.sum(known, axis=0))
    np.testing.assert_allclose(misleading(columns, columns, residual, voice), expected, rtol=1e-3)
    # all alike: none is cancelled by another, nor is the mean smaller than each
    alike = np.full(k, shift)
    np.testing.assert_allclose(
        misleading(columns, columns, columns @ alike, voice), np.abs(alike), rtol=1e-3
    )


def test_a_voice_that_knows_next_to_nothing_is_misled_by_half_of_what_it_says() -> None:
    column, residual, voice = voices_that_say([4.0], [1.0 / VAGUE**2])
    assert misleading(column, column, residual, voice)[0] == pytest.approx(2.0)
    nothing = np.zeros((1, 1))
    assert misleading(nothing, nothing, residual, voice)[0] == 0.0
