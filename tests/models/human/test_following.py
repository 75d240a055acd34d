"""Who lets itself be led gives way, stays, and never pushes the leader round."""

import itertools

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.following import FollowingParameters, following_rate

ARM = Arm(BodyMeasures(), "standing", "left")
STIFFNESS = np.array([6.0, 6.0, 6.0, 3.6])
REST = np.deg2rad([13.0, 46.0, 0.0, 10.0])
STEP = 0.002


def rate(set_point: np.ndarray, angles: np.ndarray, p: FollowingParameters) -> np.ndarray:
    return following_rate(set_point, angles, REST, STIFFNESS, ARM.gravity_stiffness(set_point), p)


def held_at(angles: np.ndarray, duration: float, p: FollowingParameters) -> np.ndarray:
    """Returns the set-point after the arm was held at `angles` for so long, s."""
    s = REST.copy()
    for _ in range(int(duration / STEP)):
        s = s + STEP * rate(s, angles, p)
    return s


def pull(set_point: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Returns the torques (4,) of springs, tone and weight, which a leader has to balance."""
    return (
        -STIFFNESS * (angles - set_point)
        - ARM.gravity_torque(set_point)
        + ARM.gravity_torque(angles)
    )


def random_cycle(rng: np.random.Generator, t: np.ndarray) -> np.ndarray:
    """Returns (n,4) smooth closed paths from REST, period 1."""
    angles = np.tile(REST, (len(t), 1))
    for k in (1, 2, 3):
        a, b = rng.normal(0.0, 0.15 / k, (2, 4))
        phase = 2.0 * np.pi * k * t[:, None]
        angles = angles + a * np.sin(phase) + b * (1.0 - np.cos(phase))
    return angles


def test_nothing_moves_where_nobody_leads() -> None:
    np.testing.assert_array_equal(rate(REST, REST, FollowingParameters()), 0.0)


def test_led_by_less_than_the_threshold_nothing_is_followed() -> None:
    p = FollowingParameters(threshold=0.5)
    total = np.diag(STIFFNESS) + ARM.gravity_stiffness(REST)
    torque = np.array([0.45, -0.45, 0.4, -0.3])
    np.testing.assert_array_equal(rate(REST, REST + np.linalg.solve(total, torque), p), 0.0)


def test_what_is_led_further_is_followed_up_to_the_threshold() -> None:
    p = FollowingParameters(time_constant=0.5, threshold=0.3)
    led = REST + [0.4, -0.3, 0.2, 0.3]
    s = held_at(led, 10.0, p)
    felt = (np.diag(STIFFNESS) + ARM.gravity_stiffness(s)) @ (led - s)
    assert np.abs(felt).max() == pytest.approx(0.3, abs=0.01)
    assert np.linalg.norm(led - s) < 0.3 * np.linalg.norm(led - REST)


def test_time_constant_is_that_of_a_single_joint() -> None:
    """Without weight and threshold a set-point closes in as 1 − exp(−t/T)."""
    p = FollowingParameters(time_constant=2.0, threshold=0.0)
    s, q = np.zeros(1), np.array([0.5])
    for _ in range(1000):
        s = s + STEP * following_rate(s, q, np.zeros(1), np.ones(1), np.zeros((1, 1)), p)
    assert s[0] == pytest.approx(0.5 * (1.0 - np.exp(-1.0)), rel=1e-3)


def test_set_point_is_never_faster_than_said() -> None:
    p = FollowingParameters(time_constant=0.1, max_speed=0.4)
    assert np.abs(rate(REST, REST + 1.0, p)).max() == pytest.approx(0.4)


def test_person_goes_back_to_comfort_where_that_is_asked() -> None:
    s = REST + [0.3, -0.2, 0.1, 0.2]
    stay, back = FollowingParameters(), FollowingParameters(return_time_constant=2.0)
    after = s.copy()
    for _ in range(int(2.0 / STEP)):
        np.testing.assert_array_equal(rate(after, after, stay), 0.0)
        after = after + STEP * rate(after, after, back)
    np.testing.assert_allclose(after - REST, np.exp(-1.0) * (s - REST), rtol=1e-2)


@pytest.mark.parametrize("seed", range(4))
def test_leader_never_gains_on_the_way(seed: int) -> None:
    """From rest, springs, tone and weight give back no more than was put in, at any time."""
    p = FollowingParameters(time_constant=0.5, threshold=0.2)
    t = np.arange(0.0, 2.0, STEP)
    path = random_cycle(np.random.default_rng(seed), t)
    s, gained, most = REST.copy(), 0.0, -np.inf
    for before, after in itertools.pairwise(path):
        middle = 0.5 * (before + after)
        gained += float(pull(s, middle) @ (after - before))
        s = s + STEP * rate(s, middle, p)
        most = max(most, gained)
    assert gained < -0.05
    assert most < 2e-3


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("back", [None, 0.5])
def test_closed_cycle_costs_the_leader_work(seed: int, back: float | None) -> None:
    """Also with a return to comfort, once the set-point repeats from cycle to cycle."""
    p = FollowingParameters(time_constant=0.5, threshold=0.2, return_time_constant=back)
    t = np.linspace(0.0, 1.0, 601)
    path = random_cycle(np.random.default_rng(10 + seed), t)
    s, step = REST.copy(), 4.0 / 600
    for _ in range(4):
        start, gained = s.copy(), 0.0
        for before, after in itertools.pairwise(path):
            middle = 0.5 * (before + after)
            gained += float(pull(s, middle) @ (after - before))
            s = s + step * rate(s, middle, p)
    np.testing.assert_allclose(s, start, atol=5e-3)
    assert gained < -0.01


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time_constant": 0.0}, "time_constant: is 0.0, expected more than 0"),
        ({"return_time_constant": -1.0}, "return_time_constant: is -1.0"),
        ({"threshold": float("nan")}, "threshold: is nan"),
        ({"max_speed": float("inf")}, "max_speed: is inf"),
    ],
)
def test_unusable_parameters_are_told(change: dict[str, float], message: str) -> None:
    with pytest.raises(UserError, match=message):
        FollowingParameters(**change)
