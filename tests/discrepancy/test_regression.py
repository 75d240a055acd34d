"""Least squares over recordings whose simulation is a little off."""

import numpy as np
import pytest

from drake_dress.discrepancy.regression import Extrapolation, solve_bounded, solve_pooled

RECORDINGS, SAMPLES = 5, 400


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture
def recording():
    return np.repeat(np.arange(RECORDINGS), SAMPLES)


def test_bounded_least_squares_keeps_its_bounds():
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((200, 3))
    truth = np.array([1.0, -2.0, 0.5])
    residual = columns @ truth
    free = solve_bounded(columns, columns, residual, -np.inf, np.inf)
    np.testing.assert_allclose(free, truth, rtol=1e-4)
    bound = solve_bounded(columns, columns, residual, np.zeros(3), np.full(3, 0.8))
    assert np.all((bound >= -1e-9) & (bound <= 0.8 + 1e-9)) and bound[1] == pytest.approx(0.0)


def test_what_is_left_of_the_step_does_not_move_parameters(rng, recording):
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


def test_a_factor_is_found_by_the_rows_that_train(rng, recording):
    direction = rng.standard_normal(len(recording))
    factor = np.arange(RECORDINGS)[recording] / 4.0
    train = np.arange(len(recording)) % 2 == 0
    left = Extrapolation(direction, recording).without(factor * direction, train)
    assert np.abs(left).max() < 0.02 * np.abs(direction).max()
    residual = np.where(train, 0.0, direction)
    np.testing.assert_array_equal(
        Extrapolation(direction, recording).without(residual, train), residual
    )


def test_recordings_that_agree_are_pooled_as_least_squares_pools_them(rng, recording):
    columns = rng.standard_normal((len(recording), 2))
    residual = columns @ [0.5, -1.0] + rng.standard_normal(len(recording))
    found = solve_pooled(columns, columns, residual, recording, -np.inf, np.inf)
    plain = np.linalg.lstsq(columns, residual, rcond=None)[0]
    assert found.scatter < 0.05
    np.testing.assert_allclose(found.x, plain, atol=0.02)
    np.testing.assert_allclose(found.std, 1.0 / np.sqrt(len(recording)), rtol=0.3)


def test_one_recording_that_misleads_is_one_voice_among_five(rng, recording):
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


def test_a_recording_that_knows_nothing_has_no_voice(rng, recording):
    columns = rng.standard_normal((len(recording), 2))
    columns[recording >= 2] = 0.0
    columns[recording == 1, 1] = 0.0
    residual = columns @ [0.5, -1.0] + rng.standard_normal(len(recording))
    found = solve_pooled(columns, columns, residual, recording, np.full(2, -5.0), np.full(2, 5.0))
    assert np.all(np.abs(found.x - [0.5, -1.0]) < 4.0 * found.std)
    assert np.all(found.std < 0.3)
