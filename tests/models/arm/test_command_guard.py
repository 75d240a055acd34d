"""An arm's driver follows sound commands and stops by itself at all others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arm.command_guard import DriveState, GuardSettings, Stop, follow
from drake_dress.models.arm.panda import LIMITS

DT = 0.004
START = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])
STILL = np.zeros(7)
AT_REST = DriveState.at_rest(START)
# A stop from a speed takes this long.
LONGEST_STOP = float((LIMITS.speed / (GuardSettings().braking * LIMITS.acceleration)).max())

numbers = st.floats(allow_nan=True, allow_infinity=True, width=32)
joints = st.lists(numbers, min_size=7, max_size=7).map(np.array)
small = st.lists(st.floats(-0.1, 0.1), min_size=7, max_size=7).map(np.array)


def moving(speed: float = 0.5, seconds: float = 0.4) -> DriveState:
    """Returns the state of drives that have followed a motion that became steady."""
    state, target, rate = AT_REST, START, STILL
    for _ in range(round(seconds / DT)):
        rate = np.minimum(rate + 5.0 * DT, speed)
        target = target + DT * rate
        state = follow(state, target, rate, True, LIMITS, DT)
        assert state.stop is Stop.NONE
    return state


def test_a_steady_motion_is_followed_without_lag() -> None:
    state = moving()
    # where the command will be when the step is over
    np.testing.assert_allclose(state.position, state.command + DT * 0.5, atol=1e-4)
    np.testing.assert_allclose(state.velocity, 0.5, atol=1e-3)


def test_commands_that_come_late_and_together_do_not_shake_the_drives() -> None:
    """Every 5 ms and 4 ms late at most, to drives that look every 4 ms."""
    rng = np.random.default_rng(0)
    rate, state = np.full(7, 0.5), moving()
    begin = state.command
    due = 0.005 * np.arange(1, 400)
    came = due + rng.uniform(0.0, 0.004, len(due))
    speeds, off = [], []
    for k in range(1, 480):
        now = k * DT
        sent = due[came <= now].max(initial=0.0)
        state = follow(state, begin + 0.5 * sent, rate, True, LIMITS, DT)
        speeds.append(state.velocity[0])
        off.append(state.position[0] - begin[0] - 0.5 * (now + DT))
    assert np.abs(np.array(speeds[50:]) - 0.5).max() < 0.15
    assert np.abs(np.array(off[50:])).max() < 5e-3


def test_velocity_mode_integrates() -> None:
    state = AT_REST
    for _ in range(50):
        state = follow(state, None, np.full(7, 0.1), True, LIMITS, DT)
    np.testing.assert_allclose(state.velocity, 0.1)
    gained = 0.1 / LIMITS.acceleration
    np.testing.assert_allclose(state.position, START + 0.1 * 50 * DT, atol=0.1 * gained.max())


@pytest.mark.parametrize(
    ("position", "velocity", "fresh", "stop"),
    [
        (START, STILL, False, Stop.ENDED),
        (START * np.nan, STILL, True, Stop.NOT_FINITE),
        (START, STILL + np.inf, True, Stop.NOT_FINITE),
        (LIMITS.upper + 0.01, STILL, True, Stop.OUTSIDE_LIMITS),
        (START, 1.01 * LIMITS.speed, True, Stop.OUTSIDE_LIMITS),
        (START + 1.0, STILL, True, Stop.JUMP),
    ],
)
def test_what_is_wrong_brakes_within_the_limits_and_is_told(
    position: np.ndarray, velocity: np.ndarray, fresh: bool, stop: Stop
) -> None:
    state = before = moving(1.0)
    for _ in range(int(LONGEST_STOP / DT) + 2):
        after = follow(state, position, velocity, fresh, LIMITS, DT)
        assert after.stop is stop
        change = np.abs(after.velocity - state.velocity)
        assert (change <= DT * LIMITS.acceleration + 1e-12).all()
        state = after
    np.testing.assert_array_equal(state.velocity, 0.0)
    # braking evenly at 80 % of the least acceleration goes on for v²/2a, and one step
    assert np.abs(state.position - before.position).max() <= 0.5 / (0.8 * 7.5) + 1.0 * DT


def test_it_goes_on_only_from_where_it_holds() -> None:
    stopped = follow(AT_REST, START, STILL, False, LIMITS, DT)
    assert follow(stopped, START + 0.05, STILL, True, LIMITS, DT).stop is Stop.ENDED
    assert follow(stopped, START + 0.01, STILL + 1.7, True, LIMITS, DT).stop is Stop.ENDED
    resumed = follow(stopped, START + 0.01, STILL, True, LIMITS, DT)
    assert resumed.stop is Stop.NONE
    for _ in range(100):
        resumed = follow(resumed, START + 0.01, STILL, True, LIMITS, DT)
    np.testing.assert_allclose(resumed.position, START + 0.01, atol=1e-6)


@settings(max_examples=300)
@given(st.lists(st.tuples(joints | small, joints | small, st.booleans()), min_size=1, max_size=30))
def test_whatever_is_commanded_drives_stay_within_limits(
    commands: list[tuple[np.ndarray, np.ndarray, bool]],
) -> None:
    state = AT_REST
    for position, velocity, fresh in commands:
        # half of them near where the drives are, so that some are followed
        near = position if np.abs(position).max() > 0.1 else state.position + position
        before = state
        state = follow(state, near, velocity, fresh, LIMITS, DT)
        change = np.abs(state.velocity - before.velocity)
        assert (change <= DT * LIMITS.acceleration + 1e-9).all()
        assert np.isfinite(state.position).all()
        assert np.isfinite(state.velocity).all()
        assert ((state.position >= LIMITS.lower) & (state.position <= LIMITS.upper)).all()
        assert (np.abs(state.velocity) <= GuardSettings().speed * LIMITS.speed + 1e-12).all()


@pytest.mark.parametrize("offset", [0.0, 0.001, 0.0037])
def test_a_command_that_swings_as_hard_as_it_may_is_not_overshot(offset: float) -> None:
    """At 85 % of the acceleration, as arms are commanded, every 5 ms; drives look every 4 ms."""
    acceleration, fastest = 0.85 * LIMITS.acceleration, 0.3
    # joints swing at speeds of a triangle wave, each with its own period
    period = 4.0 * fastest / acceleration

    def command(time: float) -> tuple[np.ndarray, np.ndarray]:
        phase = np.mod(time / period, 1.0)
        rate = fastest * (1.0 - 4.0 * np.abs(phase - 0.5))
        # from -1 up to 1 and back; its integral over a quarter counts from the middle
        gone = np.where(
            phase < 0.5,
            period * fastest * (2.0 * phase**2 - phase),
            period * fastest * (3.0 * phase - 2.0 * phase**2 - 1.0),
        )
        return START + gone, rate

    state = DriveState.at_rest(command(0.0)[0])
    off = []
    for k in range(1, 500):
        now = k * DT
        sent = 0.005 * np.floor((now - offset) / 0.005)
        position, rate = command(max(0.0, sent))
        state = follow(state, position, rate, True, LIMITS, DT)
        assert state.stop is Stop.NONE
        off.append(state.position - command(now + DT)[0])
    late = np.abs(np.array(off[250:]))
    # what is on its way for 4 ms, and held for 5 ms, at 0.3 rad/s, and some
    assert late.max() < 6e-3
