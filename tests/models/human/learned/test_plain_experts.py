"""Predictions without learning: each is right about the motion that it is made for."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.plain_experts import NAMES, plain_experts
from tests.models.human.learned.drawn import drawn_scene

seeds = st.integers(0, 2**32 - 1)
BEFORE, AHEAD = PERIOD * np.arange(1 - HISTORY, 1), PERIOD * np.arange(FUTURE + 1)


def by_name(joints: FloatArray) -> dict[str, FloatArray]:
    return dict(zip(NAMES, plain_experts(joints), strict=True))


@given(seeds)
def test_all_begin_now_and_leave_who_rests_at_rest(seed: int) -> None:
    joints = drawn_scene(seed).joints
    for rows in by_name(joints).values():
        np.testing.assert_allclose(rows[0], joints[-1], atol=1e-12)
    for rows in by_name(np.tile(joints[:1], (HISTORY, 1, 1))).values():
        np.testing.assert_allclose(rows, np.tile(joints[:1], (FUTURE + 1, 1, 1)), atol=1e-12)


@given(seeds)
def test_a_velocity_goes_on_or_decays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, velocity = rng.normal(size=(6, 3)), 0.3 * rng.uniform(-1.0, 1.0, (6, 3))
    found = by_name(start + BEFORE[:, None, None] * velocity)
    true = start + AHEAD[:, None, None] * velocity
    np.testing.assert_allclose(found["constant"], true, atol=1e-9)
    went = np.linalg.norm(found["damped"] - start, axis=2)
    assert (went <= np.linalg.norm(true - start, axis=2) + 1e-9).all()
    np.testing.assert_allclose(went[1], np.linalg.norm(velocity, axis=1) * PERIOD, rtol=0.15)
    # the way ends: with a time constant of half a second, a velocity leads half its metres far
    np.testing.assert_allclose(went[-1], 0.5 * np.linalg.norm(velocity, axis=1), rtol=0.05)
    np.testing.assert_array_equal(found["still"], np.tile(start, (FUTURE + 1, 1, 1)))


@given(seeds, st.floats(0.02, 0.2), st.floats(0.4, 2.0))
def test_a_hand_that_swings_about_a_place_returns_to_it(
    seed: int, size: float, rate: float
) -> None:
    """Whole swings in the history, of a person who is carried along at any velocity."""
    rng = np.random.default_rng(seed)
    swings = max(1, round(2.0 * rate))
    joints = np.tile(drawn_scene(seed).joints[:1], (HISTORY, 1, 1))
    place = joints[-1].copy()
    phase = 2.0 * np.pi * swings * np.arange(1, HISTORY + 1) / HISTORY + rng.uniform(0.0, 6.0)
    joints[:, 2, 2] += size * np.sin(phase)
    way = rng.uniform(-0.2, 0.2, 3)
    found = by_name(joints + BEFORE[:, None, None] * way)["returning"]
    np.testing.assert_allclose(found[-1], place, atol=0.005 * size + 1e-9)
    off = np.abs(found[:, 2, 2] - place[2, 2])
    assert (np.diff(off) <= 1e-12).all()
