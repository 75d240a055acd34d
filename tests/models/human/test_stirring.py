"""Small motions of a dressed person."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.human.stirring import StirringParameters, stirring_wave


@given(frequency=st.floats(0.1, 2.0), elapsed=st.floats(-5.0, 0.0))
def test_nothing_moves_before_it_begins(frequency: float, elapsed: float) -> None:
    assert not stirring_wave(frequency, elapsed).any()


@given(frequency=st.floats(0.1, 2.0))
def test_it_begins_smoothly_and_swings_to_its_amplitude(frequency: float) -> None:
    times = np.arange(0.0, 1.0 + 2.0 / frequency, 1e-3)
    wave = np.array([stirring_wave(frequency, t) for t in times])
    fastest = 2.0 * np.pi * frequency + 3.1
    assert np.abs(np.diff(wave, axis=0)).max() <= 1e-3 * fastest
    np.testing.assert_allclose(np.abs(wave).max(axis=0), 1.0, atol=1e-3)
    assert not np.allclose(wave[:, 0], wave[:, 1])


@pytest.mark.parametrize(
    ("key", "values"),
    [("amplitude", {"amplitude": -0.1}), ("frequency", {"frequency": 0.0})],
)
def test_bad_values_are_told_by_key(key: str, values: dict[str, float]) -> None:
    with pytest.raises(UserError, match=key):
        StirringParameters(**values)
