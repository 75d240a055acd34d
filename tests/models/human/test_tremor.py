"""Tremor: where its power lies, how large it is, and that a seed repeats it."""

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.human.tremor import (
    TremorParameters,
    TremorWave,
    Wandering,
    Wanderings,
    tremor_torque,
)

RATE = 250.0


def sampled(seed: int, frequency: float = 5.0, duration: float = 120.0) -> np.ndarray:
    wave = TremorWave(frequency, np.random.default_rng(seed))
    return np.array([wave.value(t) for t in np.arange(0.0, duration, 1.0 / RATE)])


@pytest.mark.parametrize("frequency", [4.0, 8.0])
def test_power_lies_about_its_frequency_but_not_at_one_line(frequency: float) -> None:
    x = sampled(1, frequency)
    power = np.abs(np.fft.rfft(x * np.hanning(len(x)))) ** 2
    f = np.fft.rfftfreq(len(x), 1.0 / RATE)
    assert abs(f[power.argmax()] - frequency) < 0.05 * frequency
    assert abs(np.sum(f * power) / power.sum() - frequency) < 0.03 * frequency
    near = np.abs(f - frequency) < 0.15 * frequency
    assert power[near].sum() > 0.98 * power.sum()
    assert np.sort(power)[-4:].sum() < 0.9 * power.sum()


def test_mean_amplitude_is_one_and_wanders() -> None:
    x = sampled(2)
    assert np.sqrt(2.0 * np.mean(x**2)) == pytest.approx(1.0, abs=0.05)
    peaks = np.abs(x).reshape(-1, int(RATE)).max(axis=1)
    assert 0.05 < peaks.std() < 0.25


def test_seed_alone_decides() -> None:
    np.testing.assert_array_equal(sampled(3, duration=1.0), sampled(3, duration=1.0))
    assert np.abs(sampled(3, duration=1.0) - sampled(4, duration=1.0)).max() > 0.1


def test_integral_of_the_wandering_is_its_integral() -> None:
    noise = Wandering(np.random.default_rng(5))
    for t in (0.3, 7.0):
        slope = (noise.integral(t + 1e-5) - noise.integral(t - 1e-5)) / 2e-5
        assert slope == pytest.approx(noise.value(t), abs=1e-6)


def test_torque_shakes_a_linear_arm_by_the_stated_amplitude() -> None:
    """M q̈ + D q̇ + K q = τ sin ωt, stepped until it is steady, moves the hand by the amplitude."""
    rng = np.random.default_rng(6)
    root = rng.normal(size=(4, 4))
    mass, stiffness = 0.02 * (root @ root.T + np.eye(4)), np.diag([12.0, 12.0, 7.0, 5.0])
    damping, jacobian = np.array([3.0, 3.0, 3.0, 1.2]), rng.normal(0.0, 0.3, (3, 4))
    p = TremorParameters(amplitude=0.01, frequency=6.0)
    torque = tremor_torque(p, mass, damping, stiffness, jacobian)
    omega, h = 2.0 * np.pi * p.frequency, 1e-4
    q, v, hand = np.zeros(4), np.zeros(4), []
    forward = np.linalg.inv(mass + h * np.diag(damping) + h**2 * stiffness)
    for k in range(40000):
        v = forward @ (mass @ v + h * (torque * np.sin(omega * h * k) - stiffness @ q))
        q = q + h * v
        hand.append(jacobian @ q)
    steady = np.array(hand[20000:])
    away = np.linalg.norm(steady - 0.5 * (steady.max(axis=0) + steady.min(axis=0)), axis=1)
    assert away.max() == pytest.approx(p.amplitude, rel=0.03)


def test_unusable_parameters_are_told() -> None:
    with pytest.raises(UserError, match=r"amplitude: is -0\.1 m"):
        TremorParameters(amplitude=-0.1)
    with pytest.raises(UserError, match=r"frequency: is 0\.0 Hz"):
        TremorParameters(frequency=0.0)


def test_wandering_functions_have_variance_one_and_do_not_know_of_each_other() -> None:
    together = Wanderings(np.random.default_rng(8), 5)
    values = np.array([together.value(t) for t in np.arange(0.0, 4000.0, 1.7)])
    spread = values.T @ values / len(values)
    np.testing.assert_allclose(spread, np.eye(5), atol=0.12)
    assert np.abs(values.mean(axis=0)).max() < 0.05
