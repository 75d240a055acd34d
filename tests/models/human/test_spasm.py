"""Spasms come and go smoothly, apart from each other, and as often as asked."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.human.spasm import SpasmParameters, Spasms, spasm_torque

STEP = 0.01


def strength(p: SpasmParameters, seed: int, until: float = 300.0) -> np.ndarray:
    spasms = Spasms(p, np.random.default_rng(seed))
    return np.array([spasms.value(t) for t in np.arange(0.0, until, STEP)])


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32), duration=st.floats(0.0, 3.0), rest=st.floats(0.0, 20.0))
def test_they_come_and_go_smoothly_and_apart(seed: int, duration: float, rest: float) -> None:
    p = SpasmParameters(duration=duration, interval=2.0 * (duration + 0.85) + rest)
    value = strength(p, seed, 120.0)
    assert value[0] == 0.0
    assert np.all((value >= 0.0) & (value <= 1.4))
    assert np.abs(np.diff(value)).max() < 1.4 * STEP * 0.5 * np.pi / 0.25 + 1e-9
    starts = np.flatnonzero((value[1:] > 0.0) & (value[:-1] == 0.0)) * STEP
    # a whole spasm ends before the next one can begin
    assert np.all(np.diff(starts) >= 0.5 * p.interval - 2 * STEP)
    assert np.all(np.diff(starts) >= duration + 0.85 - 2 * STEP)


def test_they_come_as_often_as_asked_with_a_mean_strength_of_one() -> None:
    p = SpasmParameters(interval=10.0)
    value = np.concatenate([strength(p, seed, 1000.0) for seed in range(4)])
    starts = np.flatnonzero((value[1:] > 0.0) & (value[:-1] == 0.0))
    assert len(starts) == pytest.approx(400, rel=0.1)
    at_full = [value[i + 100] for i in starts if i + 100 < len(value)]
    assert np.mean(at_full) == pytest.approx(1.0, abs=0.05)


def test_the_elbow_bends_and_the_arm_is_drawn_in_on_the_sides_asked() -> None:
    p = SpasmParameters(sides=("right",), torque=4.0)
    abduction, extension, rotation, elbow = spasm_torque(p, "right")
    assert (abduction, extension, rotation) == (-2.0, 0.0, -2.0)
    assert elbow == 4.0
    np.testing.assert_array_equal(spasm_torque(p, "left"), 0.0)


@pytest.mark.parametrize(
    "values",
    [{"torque": -1.0}, {"duration": float("nan")}, {"interval": 4.0}, {"interval": float("inf")}],
)
def test_values_out_of_range_are_told(values: dict[str, float]) -> None:
    with pytest.raises(UserError, match=next(iter(values))):
        SpasmParameters(**values)  # type: ignore[arg-type]
