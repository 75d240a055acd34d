"""A motion over time: what is known of it at a moment, and what was true."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.human.learned.predictor import SAMPLING
from tests.models.human.learned.drawn import drawn_scene

seeds = st.integers(0, 2**32 - 1)


def carried(seed: int, duration: float = 6.0) -> tuple[TimedMotion, np.ndarray]:
    """Returns a person who is carried along, observed at uneven times, and the velocity, m/s."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.005, 0.06, 400))
    time = time[time < duration]
    scene, velocity = drawn_scene(seed, 1), rng.uniform(-0.3, 0.3, 3)
    way = time[:, None, None] * velocity
    sleeves = np.tile(scene.sleeves[0], (len(time), 1, 1))
    sleeves[:, :, :3] += way
    return TimedMotion("some", time, scene.joints[0] + way, sleeves), velocity


@given(seeds, st.floats(2.0, 5.0))
@settings(max_examples=30)
def test_history_is_the_motion_up_to_now_at_even_times(seed: int, now: float) -> None:
    motion, velocity = carried(seed)
    history = motion.history(now, SAMPLING, motion.joints)
    assert history.time == now
    known = np.all(np.isfinite(history.joints), axis=(1, 2))
    assert known[-19:].all()
    at = SAMPLING.times(now)[:, None, None] * velocity
    start = motion.joints[0] - motion.time[0] * velocity
    np.testing.assert_allclose(history.joints[known], (start + at)[known], atol=1e-7)
    centers = motion.sleeves[0, :, :3] - motion.time[0] * velocity
    np.testing.assert_allclose(history.sleeves[known][..., :3], (centers + at)[known], atol=1e-7)
    direction = np.broadcast_to(motion.sleeves[0, :, 3:], history.sleeves[known][..., 3:].shape)
    np.testing.assert_allclose(history.sleeves[known][..., 3:], direction, atol=1e-9)


@given(seeds, st.floats(0.5, 5.0))
@settings(max_examples=30)
def test_history_knows_nothing_of_what_comes(seed: int, now: float) -> None:
    motion, _ = carried(seed)
    later = motion.time > now + 1e-6
    observed, sleeves = motion.joints.copy(), motion.sleeves.copy()
    observed[later] += 5.0
    sleeves[later] += 5.0
    other = TimedMotion("other", motion.time, motion.joints, sleeves)
    one = motion.history(now, SAMPLING, motion.joints)
    two = other.history(now, SAMPLING, observed)
    np.testing.assert_array_equal(one.joints, two.joints)
    np.testing.assert_array_equal(one.sleeves, two.sleeves)


def test_history_takes_what_is_observed_and_gaps_stay_gaps() -> None:
    motion, _ = carried(0)
    observed = motion.joints + 1.0
    observed[:, 2] = np.nan
    history = motion.history(4.0, SAMPLING, observed)
    plain = motion.history(4.0, SAMPLING, motion.joints)
    assert np.isnan(history.joints[:, 2]).all()
    rest = [0, 1, 3, 4, 5]
    np.testing.assert_allclose(history.joints[:, rest], plain.joints[:, rest] + 1.0, atol=1e-9)


@given(seeds, st.lists(st.floats(0.1, 5.0), min_size=1, max_size=5))
@settings(max_examples=30)
def test_truth_is_interpolated_and_not_known_beyond_the_ends(seed: int, times: list[float]) -> None:
    motion, velocity = carried(seed)
    start = motion.joints[0] - motion.time[0] * velocity
    at = np.array(times)
    found = motion.joints_at(at)
    np.testing.assert_allclose(found, start + at[:, None, None] * velocity, atol=1e-9)
    outside = motion.joints_at(np.array([motion.time[0] - 0.01, motion.time[-1] + 0.01]))
    assert np.isnan(outside).all()
    ends = motion.joints_at(motion.time[[0, -1]])
    np.testing.assert_allclose(ends, motion.joints[[0, -1]], atol=1e-12)


def test_joint_is_known_as_long_as_it_is_seen() -> None:
    motion, _ = carried(1)
    joints = motion.joints.copy()
    joints[: len(joints) // 2, 4] = np.nan
    joints[:, 5] = np.nan
    joints[3, 5] = 0.0  # once is not enough
    joints[:, 3] = np.nan
    joints[[0, -1], 3] = motion.joints[[0, -1], 3]
    since = motion.time[len(joints) // 2]
    other = TimedMotion("some", motion.time, joints, motion.sleeves)
    at = np.array([since - 0.02, since + 0.02])
    found = other.joints_at(at)
    assert np.isnan(found[0, 4]).all()
    assert np.isfinite(found[1, 4]).all()
    assert np.isnan(found[:, 5]).all()
    assert np.isfinite(found[:, :4]).all()
    np.testing.assert_allclose(found[:, 3], motion.joints_at(at)[:, 3], atol=1e-9)


def test_intent_is_that_of_the_time_if_anyone_knows() -> None:
    motion, _ = carried(2)
    assert motion.intent_at(1.0) is None
    intent = np.stack([motion.time > 2.0, motion.time > 4.0], axis=1).astype(np.int64)
    told = TimedMotion("some", motion.time, motion.joints, motion.sleeves, intent)
    for time, expected in (
        (1.0, [0, 0]),
        (3.0, [1, 0]),
        (5.0, [1, 1]),
        (-1.0, [0, 0]),
        (99.0, [1, 1]),
    ):
        np.testing.assert_array_equal(told.intent_at(time), expected)
