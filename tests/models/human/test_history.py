"""Even samples of uneven observations: exact for straight motion, calm in noise, honest on gaps."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.history import Observations, Sampling, line_weights

SAMPLING = Sampling()
seeds = st.integers(0, 2**32 - 1)


def observed(stamps: np.ndarray, values: np.ndarray, kept: float = 1e3) -> Observations:
    found = Observations()
    for time, value in zip(stamps, values, strict=True):
        found = found.added(float(time), value, kept)
    return found


def line(times: np.ndarray, rng: np.random.Generator, points: int = 3) -> np.ndarray:
    """Returns (M,k,3) points that move along lines."""
    start, velocity = rng.normal(size=(2, points, 3))
    moved: np.ndarray = start + times[:, None, None] * velocity
    return moved


@given(seeds, st.floats(0.005, 0.2), st.floats(0.0, 0.12))
def test_straight_motion_is_reproduced_exactly_at_any_stamps(
    seed: int, spacing: float, age: float
) -> None:
    """Also beyond the newest observation, where more than one is near."""
    rng = np.random.default_rng(seed)
    steps = spacing * rng.uniform(0.1, 1.2, 2000)
    stamps = -age - np.cumsum(steps)[::-1] + steps[0]
    stamps = stamps[stamps > -3.0]
    now = float(rng.uniform(-5.0, 5.0))
    rows = observed(now + stamps, line(stamps, np.random.default_rng(seed))).sampled(now, SAMPLING)
    times = SAMPLING.times(0.0)
    expected = line(times, np.random.default_rng(seed))
    found: np.ndarray = np.all(np.isfinite(rows), axis=(1, 2))
    inside = np.logical_and(times >= stamps[0], times <= stamps[-1])
    assert found[inside].all()
    several = len(stamps) > 1 and bool(stamps[-2] > stamps[-1] - 0.09)
    exact = found & (inside | several) & (times >= stamps[0])
    assert exact.any()
    np.testing.assert_allclose(rows[exact], expected[exact], atol=1e-7)


def test_sample_times_end_now_and_are_one_period_apart() -> None:
    times = Sampling(4, 0.25).times(7.0)
    np.testing.assert_allclose(times, [6.25, 6.5, 6.75, 7.0])


@given(seeds, st.floats(0.255, 1.0))
def test_sample_in_a_gap_is_missing_and_no_other(seed: int, gap: float) -> None:
    rng = np.random.default_rng(seed)
    begin = float(rng.uniform(-1.5, -0.3 - gap))
    before, after = np.arange(begin, -4.0, -0.05)[::-1], np.arange(begin + gap, 0.001, 0.05)
    stamps = np.concatenate([before, after, [0.001]])
    rows = observed(stamps, line(stamps, rng)).sampled(0.0, SAMPLING)
    times = SAMPLING.times(0.0)
    missing = (times > begin + 1e-9) & (times < begin + gap - 1e-9)
    assert missing.any()
    np.testing.assert_array_equal(np.isnan(rows).all(axis=(1, 2)), missing)
    np.testing.assert_array_equal(np.isfinite(rows).all(axis=(1, 2)), ~missing)


@pytest.mark.parametrize(("age", "known"), [(0.0, True), (0.12, True), (0.13, False)])
def test_newest_observation_holds_for_half_a_gap(age: float, known: bool) -> None:
    rows = observed(np.array([-age]), np.ones((1, 2, 3))).sampled(0.0, SAMPLING)
    assert np.isfinite(rows[-1]).all() == known
    if known:
        np.testing.assert_array_equal(rows[-1], 1.0)


@given(seeds, st.sampled_from([0.002, 0.005, 0.01]))
def test_many_noisy_observations_are_averaged(seed: int, spacing: float) -> None:
    """With weights w, noise of variance 1 has variance Σ w² in a sample."""
    rng = np.random.default_rng(seed)
    jitter = rng.uniform(-0.45, 0.45, round(3.0 / spacing))
    stamps = spacing * (np.arange(-len(jitter) + 1, 1) + jitter)
    weights, known = line_weights(stamps, SAMPLING.times(0.0), SAMPLING)
    assert known.all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    within = 2.0 * SAMPLING.width / spacing  # observations in a triangle
    variance = (weights**2).sum(axis=1)
    assert (variance[:-1] < 2.0 / within).all()
    # the last one has observations on one side only
    assert variance[-1] < 12.0 / within


@given(st.sampled_from([0.002, 0.005, 0.01, 0.02, 0.033, 0.05]), st.floats(0.0, 0.125))
def test_noise_is_hardly_amplified_beyond_the_newest_observation(
    spacing: float, age: float
) -> None:
    stamps = -age - spacing * np.arange(1500, dtype=np.float64)[::-1]
    weights, known = line_weights(stamps, np.zeros(1), SAMPLING)
    assert known.all()
    assert (weights**2).sum() ** 0.5 < 4.5


@given(st.integers(1, 5), st.floats(0.0, 6.0))
def test_fast_tremor_does_not_fold_into_a_slow_motion(turns: int, phase: float) -> None:
    """A wave of almost whole turns in a period would look slow in single observations."""
    frequency = turns / SAMPLING.period + 0.3
    stamps = np.arange(-3.0, 0.3, 0.005)
    wave = np.sin(2.0 * np.pi * frequency * stamps + phase)
    rows = observed(stamps, np.tile(wave[:, None, None], (1, 1, 3))).sampled(0.0, SAMPLING)
    assert np.abs(rows).max() < 0.05


@given(st.floats(-1.0, 0.0))
def test_observation_that_is_not_newer_is_left_out(late: float) -> None:
    known = observed(np.array([1.0, 2.0]), np.zeros((2, 1, 3)))
    assert known.added(2.0 + late, np.ones((1, 3)), 10.0) is known
    np.testing.assert_array_equal(known.time, [1.0, 2.0])


def test_joints_have_gaps_of_their_own_and_one_never_seen_is_missing() -> None:
    rng = np.random.default_rng(0)
    stamps = np.arange(-3.0, 0.01, 0.05)
    values = line(stamps, rng, 4)
    values[:, 1] = np.nan
    values[30:50, 2, 1] = np.nan
    values[1::2, 3] = np.nan
    rows = observed(stamps, values).sampled(0.0, SAMPLING)
    expected = line(SAMPLING.times(0.0), np.random.default_rng(0), 4)
    np.testing.assert_allclose(rows[:, 0], expected[:, 0], atol=1e-9)
    assert np.isnan(rows[:, 1]).all()
    lost = (SAMPLING.times(0.0) > stamps[29] + 1e-9) & (SAMPLING.times(0.0) < stamps[50] - 1e-9)
    np.testing.assert_array_equal(np.isnan(rows[:, 2]).all(axis=1), lost)
    np.testing.assert_allclose(rows[~lost, 2], expected[~lost, 2], atol=1e-9)
    np.testing.assert_allclose(rows[:, 3], expected[:, 3], atol=1e-9)


def test_only_what_is_of_use_is_kept_and_samples_do_not_change() -> None:
    stamps = np.arange(0.0, 10.0, 0.03)
    values = line(stamps, np.random.default_rng(1))
    short, long = observed(stamps, values, SAMPLING.kept), observed(stamps, values)
    assert short.time[0] >= stamps[-1] - SAMPLING.kept - 1e-9
    assert len(short.time) < 0.3 * len(long.time)
    now = float(stamps[-1])
    np.testing.assert_allclose(short.sampled(now, SAMPLING), long.sampled(now, SAMPLING))


def test_nothing_observed_gives_no_samples_of_any_point() -> None:
    assert Observations().sampled(0.0, SAMPLING).shape == (SAMPLING.length, 0, 0)


def test_observations_are_their_own_copy_and_adding_leaves_them_as_they_are() -> None:
    value = np.zeros((1, 3))
    first = Observations().added(0.0, value, 1.0)
    second = first.added(0.5, np.ones((1, 3)), 1.0)
    value += 5.0
    assert copy.deepcopy(second) is second
    np.testing.assert_array_equal(first.time, [0.0])
    np.testing.assert_array_equal(second.value[:, 0, 0], [0.0, 1.0])
