"""What a person wants starts and ends at rest, and is as large and fast as it says."""

from collections.abc import Callable

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.human.motions import Turn, Wave, Withdraw, minimum_jerk, stance


def slope(of: Callable[[float], float], t: float) -> float:
    return (of(t + 1e-6) - of(t - 1e-6)) / 2e-6


def test_minimum_jerk_goes_from_rest_to_rest() -> None:
    assert minimum_jerk(-1.0) == (0.0, 0.0)
    assert minimum_jerk(2.0) == (1.0, 0.0)
    assert minimum_jerk(0.5) == (0.5, 15.0 / 8.0)
    for u in (0.1, 0.4, 0.9):
        assert slope(lambda t: minimum_jerk(t)[0], u) == pytest.approx(minimum_jerk(u)[1])


def test_turns_add_up_and_end_at_their_angle() -> None:
    turns = (Turn(start=1.0, angle=0.3, duration=2.0), Turn(start=2.0, angle=-0.1, duration=3.0))
    np.testing.assert_array_equal(stance(turns, 1.0), 0.0)
    np.testing.assert_allclose(stance(turns, 6.0), [0.2, 0.0])
    fastest = max(abs(stance((turns[0],), t)[1]) for t in np.linspace(0.0, 4.0, 401))
    assert fastest == pytest.approx(turns[0].speed, rel=1e-3)
    for t in (1.3, 2.5, 4.0):
        expected = slope(lambda u: stance(turns, u)[0], t)
        assert stance(turns, t)[1] == pytest.approx(expected, abs=1e-6)


def test_wave_is_bounded_and_smooth() -> None:
    wave = Wave(start=2.0, duration=4.0, amplitude=0.06, frequency=1.5)
    times = np.linspace(1.0, 7.0, 6001)
    offsets = np.array([wave.offset(t) for t in times])
    assert 0.055 < np.abs(offsets[:, 0]).max() <= 0.06
    assert np.abs(offsets[:, 1]).max() <= wave.speed
    assert not offsets[(times < 2.0) | (times >= 6.0)].any()
    # no jump in position, none in velocity
    assert np.abs(np.diff(offsets[:, 0])).max() <= wave.speed * 1.001e-3
    assert np.abs(np.diff(offsets[:, 1])).max() < 0.02
    for t in (2.2, 3.7, 5.8):
        assert wave.offset(t)[1] == pytest.approx(slope(lambda u: wave.offset(u)[0], t), abs=1e-6)


def test_withdrawal_is_on_in_its_time() -> None:
    withdraw = Withdraw(start=3.0, duration=2.0)
    assert [withdraw.is_on(t) for t in (2.9, 3.0, 4.9, 5.0)] == [False, True, True, False]


def test_turn_is_on_while_the_body_turns() -> None:
    turn = Turn(start=1.0, angle=-0.3, duration=2.0)
    for t in np.linspace(0.05, 3.95, 40):
        assert turn.is_on(t) == (stance((turn,), t)[1] != 0.0)
    assert [turn.is_on(t) for t in (1.0, 3.0)] == [True, False]
    assert not Turn(start=1.0, angle=0.0, duration=2.0).is_on(2.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Wave(amplitude=-0.1), "amplitude: is -0.1"),
        (lambda: Wave(frequency=0.0), "frequency: is 0, expected more"),
        (lambda: Withdraw(duration=float("nan")), "duration: is nan"),
        (lambda: Turn(start=-1.0), "start: is -1.0"),
    ],
)
def test_unusable_motions_are_told(make: Callable[[], object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        make()
