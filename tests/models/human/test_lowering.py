"""Arms on their way down."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.lowering import lowered, next_share

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


@given(q=angles, rate=angles, share=st.floats(0.01, 0.99), faster=st.floats(0.1, 2.0))
def test_the_rate_is_the_derivative(
    q: np.ndarray, rate: np.ndarray, share: float, faster: float
) -> None:
    def at(t: float) -> np.ndarray:
        return lowered(q + t * rate, rate, POSE, share + t * faster, faster)[0]

    given_rate = lowered(q, rate, POSE, share, faster)[1]
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
