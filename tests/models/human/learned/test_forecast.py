"""A forecast between its rows, and who counts as a predictor of persons."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.learned.forecast import Forecast, PersonPredictor
from drake_dress.models.human.learned.predictor import LearnedPredictor
from drake_dress.models.human.prediction import ConstantVelocityPredictor, StillPredictor
from tests.models.human.learned.drawn import drawn_networks

START, STEP, STEPS = 2.0, 0.1, 4


def forecast(rows: int = STEPS + 1) -> Forecast:
    """Returns a forecast of lines, so that everything between rows is known."""
    rng = np.random.default_rng(0)
    ahead = STEP * np.arange(rows)
    mean = rng.normal(size=(6, 3)) + ahead[:, None, None] * rng.normal(size=(6, 3))
    radius = 0.1 + ahead[:, None] * np.ones(6)
    samples = np.stack([mean + k * ahead[:, None, None] for k in range(3)])
    return Forecast(START, STEP, mean, radius, samples, np.ones(2), False, np.ones(6, dtype=bool))


@given(st.lists(st.floats(0.0, STEP * STEPS), min_size=1, max_size=5))
def test_between_rows_everything_is_interpolated(ahead: list[float]) -> None:
    f, times = forecast(), np.array(ahead)
    along = times[:, None, None] / (STEP * STEPS)
    expected = f.mean[0] + along * (f.mean[-1] - f.mean[0])
    np.testing.assert_allclose(f.mean_at(START + times), expected, atol=1e-9)
    np.testing.assert_allclose(f.radius_at(START + times), (0.1 + times)[:, None] * np.ones(6))
    samples = f.samples_at(START + times)
    assert samples.shape == (3, len(times), 6, 3)
    for k in range(3):
        np.testing.assert_allclose(samples[k], expected + k * times[:, None, None], atol=1e-9)


def test_rows_are_met_and_beyond_the_ends_nothing_moves() -> None:
    f = forecast()
    at = START + STEP * np.arange(STEPS + 1, dtype=np.float64)
    np.testing.assert_allclose(f.mean_at(at), f.mean, atol=1e-12)
    np.testing.assert_array_equal(f.mean_at(np.array([0.0])), f.mean[:1])
    np.testing.assert_array_equal(f.mean_at(np.array([9.0])), f.mean[-1:])
    np.testing.assert_array_equal(f.radius_at(np.array([9.0])), f.radius[-1:])


def test_forecast_of_one_row_stays() -> None:
    f = forecast(1)
    np.testing.assert_array_equal(f.mean_at(np.array([1.0, 2.0, 3.0])), np.tile(f.mean, (3, 1, 1)))


def test_forecast_is_its_own_copy() -> None:
    f = forecast()
    assert copy.deepcopy(f) is f


@pytest.mark.parametrize(
    ("predictor", "of_persons"),
    [
        (LearnedPredictor(drawn_networks()), True),
        (StillPredictor(), False),
        (ConstantVelocityPredictor(), False),
    ],
)
def test_predictors_of_persons_are_told_from_those_of_joints(
    predictor: object, of_persons: bool
) -> None:
    assert isinstance(predictor, PersonPredictor) == of_persons
