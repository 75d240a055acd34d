"""An arm with a will, in a body that does exactly what the set-point says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.active import ActiveArm, ActiveParameters, ArmState, Want
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.armhole import Armhole, find_armhole
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.motions import Motion, Reach, Turn, Wave, Withdraw

ARM = Arm(BodyMeasures(), "standing", "left")
REST = np.deg2rad([13.0, 46.0, 0.0, 10.0])
LIMITS = np.array([[-0.6, -2.6, -1.2, 0.0], [2.6, 1.2, 1.2, 2.5]])
STIFFNESS = np.array([6.0, 6.0, 6.0, 3.6])
P = ActiveParameters()
STEP = 0.004
FAR = np.array([-1.0, 0.3, 1.2])


def ring(center: np.ndarray, into: np.ndarray) -> np.ndarray:
    """Returns (24,3) nodes of an armhole of 19 cm across that is entered along `into`."""
    into = into / np.linalg.norm(into)
    u = np.cross(into, [0.0, 0.0, 1.0])
    u /= np.linalg.norm(u)
    phi = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)[:, None]
    return center + 0.095 * (np.cos(phi) * u - np.sin(phi) * np.cross(into, u))


def hole(angles: np.ndarray, center: np.ndarray, into: np.ndarray) -> Armhole:
    return find_armhole(ring(center, into), 1.0, ARM, angles, 0.0, np.zeros(3))


def play(
    motions: list[Motion],
    duration: float,
    center: Callable[[float], FloatArray] = lambda t: FAR,
    into: npt.ArrayLike = (-0.3, 0.8, -0.5),
) -> tuple[list[ArmState], np.ndarray]:
    """Returns states, and the hand (n,3), of an arm that is where its set-point is."""
    active = ActiveArm(ARM, REST, LIMITS, STIFFNESS, motions, P)
    state, states = active.initial_state(), []
    for k in range(int(duration / STEP)):
        armhole = hole(state.set_point, np.asarray(center(k * STEP)), np.array(into))
        state = active.step(state, state.set_point, armhole, k * STEP, STEP)
        states.append(state)
    return states, np.array([ARM.hand(s.set_point) for s in states])


def check_smooth(states: list[ArmState], hand: np.ndarray) -> None:
    """No jump in set-points, nor in their speed; hand and joints within their limits."""
    angles = np.array([REST] + [s.set_point for s in states])
    rates = np.diff(angles, axis=0) / STEP
    assert np.abs(rates).max() <= P.max_joint_speed + 1e-9
    assert np.abs(np.diff(rates, axis=0)).max() <= 30.0 * STEP + 1e-9
    assert (angles >= LIMITS[0]).all()
    assert (angles <= LIMITS[1]).all()
    speed = np.linalg.norm(np.diff(hand, axis=0), axis=1) / STEP
    assert speed.max() < 1.05 * P.max_hand_speed


def test_armhole_is_seen_from_the_torso() -> None:
    """Turning and shifting person and world alike changes nothing."""
    yaw, origin = 0.7, np.array([0.3, -1.0, 0.0])
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    loop = ring(ARM.hand(REST) + [0.0, 0.02, 0.05], np.array([-0.3, 0.8, -0.5]))
    here = find_armhole(loop, 1.0, ARM, REST, 0.0, np.zeros(3))
    there = find_armhole(loop @ turn.T + origin, 1.0, ARM, REST, yaw, origin)
    np.testing.assert_allclose(there.center, here.center, atol=1e-12)
    np.testing.assert_allclose(there.into, here.into, atol=1e-12)
    assert here.depth == pytest.approx(there.depth)


def test_armhole_round_the_forearm_is_entered_and_one_beside_it_is_not() -> None:
    _, elbow, hand = ARM.points(REST)
    along = (hand - elbow) / np.linalg.norm(hand - elbow)
    on = hole(REST, hand - 0.1 * along, along)
    assert on.is_entered
    assert (on.depth, on.beside) == pytest.approx((0.1, 0.0), abs=1e-9)
    beside = hole(REST, hand - 0.1 * along + [0.0, 0.3, 0.0], along)
    assert not beside.is_entered
    assert not hole(REST, hand + 0.05 * along, along).is_entered


def test_arm_that_wants_nothing_rests() -> None:
    states, _ = play([], 1.0)
    np.testing.assert_array_equal(states[-1].set_point, REST)


def test_state_survives_its_numbers() -> None:
    states, _ = play([Withdraw(start=0.1, duration=0.4)], 0.8)
    for state in states[::20]:
        again = ArmState.of(state.flat())
        assert len(state.flat()) == ArmState.SIZE
        np.testing.assert_array_equal(again.flat(), state.flat())
        assert again.want is state.want


def test_reach_goes_through_an_armhole_that_is_near_and_then_follows() -> None:
    rest = ARM.hand(REST)
    center = rest + [0.05, 0.12, 0.08]
    into = np.array([-0.3, 0.8, -0.5])
    states, hand = play([Reach(start=0.5, within=0.25, push=0.05)], 6.0, lambda t: center, into)
    check_smooth(states, hand)
    np.testing.assert_allclose(hand[: int(0.5 / STEP)], np.tile(rest, (125, 1)), atol=1e-12)
    wants = [s.want for s in states]
    assert Want.REACH in wants
    assert states[-1].through
    assert states[-1].want is Want.FOLLOW
    offset = hand - center
    unit = into / np.linalg.norm(into)
    depth = offset @ unit
    beside = np.linalg.norm(offset - depth[:, None] * unit, axis=1)
    passed = int(np.argmax(depth > 0.0))
    assert depth[passed] > 0.0
    assert beside[passed] < 0.05
    assert 0.02 < depth[-1] < 0.08
    assert np.linalg.norm(hand[-1] - hand[-250]) < 1e-3


def test_reach_follows_an_armhole_that_moves() -> None:
    rest = ARM.hand(REST)
    moving = lambda t: rest + [0.05 + 0.04 * np.sin(2.0 * t), 0.12, 0.08 + 0.03 * np.cos(2.0 * t)]  # noqa: E731
    states, hand = play([Reach()], 6.0, moving)
    check_smooth(states, hand)
    assert states[-1].through


def test_armhole_out_of_reach_is_left_alone() -> None:
    states, _ = play([Reach(within=0.25)], 1.0, lambda t: ARM.hand(REST) + [-0.2, 0.2, 0.0])
    assert {s.want for s in states} == {Want.FOLLOW}


def test_armhole_that_goes_away_is_given_up_and_the_hand_goes_back() -> None:
    rest = ARM.hand(REST)
    leaving = lambda t: rest + [0.05, 0.18, 0.05] if t < 0.6 else rest + [-0.6, 0.6, 0.0]  # noqa: E731
    states, hand = play([Reach()], 5.0, leaving)
    check_smooth(states, hand)
    assert np.linalg.norm(hand - rest, axis=1).max() > 0.02
    assert states[-1].want is Want.FOLLOW
    assert not states[-1].through
    assert np.linalg.norm(hand[-1] - rest) < 0.005


def test_withdrawn_hand_comes_as_far_as_said_and_returns() -> None:
    motion = Withdraw(start=0.5, duration=3.0, distance=0.10)
    states, hand = play([motion], 7.0)
    check_smooth(states, hand)
    rest = ARM.hand(REST)
    toward = (ARM.shoulder - rest) * [1.0, 1.0, 0.0]
    toward /= np.linalg.norm(toward)
    back = (hand - rest) @ toward
    assert back.max() < 0.115
    assert back[int(3.4 / STEP)] == pytest.approx(0.10, abs=0.005)
    assert np.linalg.norm(hand[-1] - rest) < 0.005


def test_hand_drawn_back_again_on_its_way_still_comes_back() -> None:
    motions: list[Motion] = [Withdraw(start=t, duration=0.6) for t in (0.2, 1.1, 2.0)]
    states, hand = play(motions, 6.0)
    check_smooth(states, hand)
    assert np.linalg.norm(hand[-1] - ARM.hand(REST)) < 0.005
    assert states[-1].want is Want.FOLLOW


def test_waving_hand_stays_within_its_amplitude_and_ends_where_it_was() -> None:
    motion = Wave(start=0.5, duration=3.0, amplitude=0.05, frequency=1.0)
    states, hand = play([motion], 6.0)
    check_smooth(states, hand)
    aside = hand - ARM.hand(REST)
    assert 0.04 < np.abs(aside[:, 1]).max() < 0.055
    assert np.abs(aside[:, [0, 2]]).max() < 0.02
    assert np.linalg.norm(hand[-1] - ARM.hand(REST)) < 0.005


def test_motions_that_overlap_blend() -> None:
    rest = ARM.hand(REST)
    motions: list[Motion] = [
        Reach(start=0.2),
        Withdraw(start=0.6, duration=1.0),
        Withdraw(start=1.9, duration=0.5, distance=0.05),
        Wave(start=0.8, duration=2.0, amplitude=0.03),
    ]
    states, hand = play(motions, 5.0, lambda t: rest + [0.05, 0.14, 0.06])
    check_smooth(states, hand)
    assert {Want.REACH, Want.WITHDRAW} <= {s.want for s in states}


def test_motions_of_the_other_hand_are_not_for_this_one() -> None:
    states, _hand = play([Wave(start=0.0, sides=("right",))], 1.0)
    np.testing.assert_array_equal(states[-1].set_point, REST)


def intents(motions: list[Motion], states: list[ArmState]) -> tuple[np.ndarray, np.ndarray]:
    """Returns times (n,), s, and whether the arm moves by its own will (n,) at each of them."""
    active = ActiveArm(ARM, REST, LIMITS, STIFFNESS, motions, P)
    times = STEP * np.arange(len(states))
    pairs = zip(states, times, strict=True)
    return times, np.array([active.has_intent(state, t) for state, t in pairs])


@pytest.mark.parametrize(
    "motion",
    [
        Reach(start=0.5),
        Withdraw(start=0.5, duration=1.0),
        Wave(start=0.5, duration=1.0),
    ],
    ids=lambda motion: type(motion).__name__,
)
def test_hand_moves_only_by_intent_when_nothing_leads_it(motion: Motion) -> None:
    center = ARM.hand(REST) + [0.05, 0.12, 0.08]
    states, _ = play([motion], 6.0, lambda t: center)
    times, intent = intents([motion], states)
    speed = np.array([np.abs(s.rate).max() for s in states])
    assert not intent[times < 0.5].any()
    assert intent[(times >= 0.6) & (times < 0.9)].all()
    assert not intent[-1]
    assert speed[intent].max() > 0.1
    assert speed[times < 0.5].max() == 0.0
    # without intent the arm is still; a hand at its end brakes within a tenth of a second
    falls = times[1:][np.diff(intent.astype(int)) < 0]
    braking = np.any([(times >= t) & (times < t + 0.12) for t in falls], axis=0)
    assert speed[~intent & ~braking].max() <= 0.03


def test_arm_that_is_led_away_has_no_intent() -> None:
    active = ActiveArm(ARM, REST, LIMITS, STIFFNESS, [], P)
    state, led = active.initial_state(), REST + [0.6, -0.3, 0.0, 0.4]
    for k in range(500):
        state = active.step(state, led, hole(led, FAR, np.array([0.0, 1.0, 0.0])), k * STEP, STEP)
        assert not active.has_intent(state, (k + 1) * STEP)
    assert np.abs(state.set_point - REST).max() > 0.1


def test_waving_and_turning_arm_has_intent_whatever_its_goal() -> None:
    state = ActiveArm(ARM, REST, LIMITS, STIFFNESS, [], P).initial_state()
    motions: list[Motion] = [
        Wave(start=1.0, duration=1.0),
        Wave(start=3.0, duration=1.0, sides=("right",)),
        Turn(start=5.0, angle=-0.2, duration=1.0),
    ]
    active = ActiveArm(ARM, REST, LIMITS, STIFFNESS, motions, P)
    assert state.want is Want.FOLLOW
    times = (0.9, 1.0, 1.9, 2.0, 3.5, 4.9, 5.0, 5.9, 6.0)
    found = [active.has_intent(state, t) for t in times]
    assert found == [False, True, True, False, False, False, True, True, False]
