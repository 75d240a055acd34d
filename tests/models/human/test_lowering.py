"""Arms on their way down."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.lowering import least_lift, longer, lowered, next_share

POSE = np.array([0.2, 0.1, 0.0, 0.3])
angles = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).map(np.array)


@given(q=angles, rate=angles)
def test_before_and_after(q: np.ndarray, rate: np.ndarray) -> None:
    before = lowered(q, rate, POSE, 0.0, 0.0)
    np.testing.assert_array_equal(before[0], q)
    np.testing.assert_array_equal(before[1], rate)
    after = lowered(q, rate, POSE, 1.0, 0.0)
    np.testing.assert_allclose(after[0], POSE, atol=1e-15)
    np.testing.assert_allclose(after[1], 0.0, atol=1e-15)


@given(
    q=angles,
    rate=angles,
    share=st.floats(0.01, 0.99),
    faster=st.floats(0.1, 2.0),
    lift=st.sampled_from([None, 0.0, 0.4, 1.2]),
)
def test_the_rate_is_the_derivative(
    q: np.ndarray, rate: np.ndarray, share: float, faster: float, lift: float | None
) -> None:
    up = None if lift is None else np.array(lift)

    def at(t: float) -> np.ndarray:
        return lowered(q + t * rate, rate, POSE, share + t * faster, faster, up)[0]

    given_rate = lowered(q, rate, POSE, share, faster, up)[1]
    np.testing.assert_allclose(given_rate, (at(1e-6) - at(-1e-6)) / 2e-6, atol=1e-6)


def test_it_takes_its_time_and_comes_back() -> None:
    share, times = 0.0, []
    for told in (True, False):
        for k in range(1, 1000):
            share = next_share(share, told, 2.5, 0.01)
            if share == (1.0 if told else 0.0):
                times.append(0.01 * k)
                break
    assert times == pytest.approx([2.5, 2.5], abs=0.02)


@given(q=angles, share=st.floats(0.0, 1.0), lift=st.floats(0.1, 1.2))
def test_a_lifted_arm_is_raised_sideways_only_and_ends_at_its_pose(
    q: np.ndarray, share: float, lift: float
) -> None:
    zero, up = np.zeros(4), np.array(lift)
    end = lowered(q, zero, POSE, 1.0, 0.0, up)[0]
    np.testing.assert_allclose(end, POSE, atol=1e-12)
    on_the_way = lowered(q, zero, POSE, share, 1.0, up)[0]
    low, high = np.minimum(q, POSE), np.maximum(q, POSE)
    assert np.all(on_the_way[1:] >= low[1:] - 1e-12)
    assert np.all(on_the_way[1:] <= high[1:] + 1e-12)
    assert low[0] - 1e-12 <= on_the_way[0] <= high[0] + lift + 1e-12
    if 0.3 <= share <= 0.6:
        assert on_the_way[0] >= low[0] + lift - 1e-12
    np.testing.assert_allclose(
        lowered(q, zero, POSE, share, 1.0, np.array(0.0))[0],
        lowered(q, zero, POSE, share, 1.0)[0],
        atol=1e-12,
    )


@given(height=st.floats(0.1, 0.8), start=st.floats(0.2, 0.6), side=st.sampled_from([0, 1]))
def test_the_least_lift_is_the_first_that_clears_a_wall(
    height: float, start: float, side: int
) -> None:
    """A wall at extension 0 reaches up to an abduction: an arm that crosses has to be above it."""

    def room(q: np.ndarray) -> np.ndarray:
        over, beside = q[:, 0] - height, np.abs(q[:, 1]) - 0.1
        found: np.ndarray = np.where(np.arange(2) == side, np.maximum(over, beside), np.inf)
        return found

    begin, pose = np.zeros((2, 4)), np.zeros((2, 4))
    begin[:, 1], pose[:, 1] = start, -0.4
    lift = least_lift(room, begin, pose)
    assert lift[1 - side] == 0.0
    # the arm has to be higher than the wall while its extension passes 0
    assert lift[side] >= height

    def least(tried: float) -> float:
        both = np.full(2, tried)
        way = [
            lowered(begin, np.zeros((2, 4)), pose, share, 1.0, both)[0]
            for share in np.linspace(0.0, 1.0, 21)
        ]
        return float(min(room(q)[side] for q in way))

    assert least(float(lift[side])) > least(max(0.0, float(lift[side]) - np.deg2rad(10.0)))


def test_a_way_that_is_free_needs_no_lift() -> None:
    start, pose = np.full((2, 4), 0.5), np.zeros((2, 4))
    free = least_lift(lambda q: np.full(2, 0.05), start, pose)
    np.testing.assert_array_equal(free, 0.0)
    # an arm that touches the chair at the start or in the end does not have to leave it
    touching = least_lift(lambda q: np.full(2, -0.01), start, pose)
    np.testing.assert_array_equal(touching, 0.0)


@given(q=angles, lift=st.floats(0.0, 1.2))
def test_a_way_with_a_lift_is_longer(q: np.ndarray, lift: float) -> None:
    start, pose = np.stack([q, q]), np.stack([POSE, POSE])
    both = longer(start, pose, np.array([lift, 0.0]))
    assert both >= 1.0
    assert longer(start, pose, np.zeros(2)) == 1.0
    if lift > 0.0:
        direct = float(np.linalg.norm(POSE - q))
        assert both * max(direct, 1e-6) >= 2.0 * lift - abs(POSE[0] - q[0]) - 0.05 * lift - 1e-9
