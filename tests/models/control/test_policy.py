"""What is on its way when a plan is made."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.control.policy import later


@given(st.integers(1, 8), st.floats(0.0, 12.0), st.integers(0, 2**32 - 1))
def test_grippers_go_as_far_as_the_plan_before_leads_them(n: int, steps: float, seed: int) -> None:
    """The way in each step is the integral of the velocity that the plan before has meanwhile."""
    velocity = np.random.default_rng(seed).normal(size=(n, 2, 3))
    ends = np.concatenate([np.zeros((1, 2, 3)), np.cumsum(velocity, axis=0)])

    def gone(at: float) -> np.ndarray:
        if at >= n:
            return ends[n] + (at - n) * velocity[-1]
        whole = int(at)
        return ends[whole] + (at - whole) * velocity[whole]

    found = later(velocity, steps)
    assert found.shape == velocity.shape
    for j in range(n):
        assert found[j] == pytest.approx(gone(steps + j + 1) - gone(steps + j), abs=1e-7)


def test_whole_steps_are_taken_as_they_are() -> None:
    """Also where a quotient of times is not quite the whole number that it should be."""
    velocity = np.arange(5.0)[:, None]
    for steps in (2.0, 0.6 / 0.3, 2.0 - 1e-12, 2.0 + 1e-16):
        assert np.array_equal(later(velocity, steps)[:, 0], [2.0, 3.0, 4.0, 4.0, 4.0])
