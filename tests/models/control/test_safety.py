"""Limits hold whatever is asked and measured; what is within them passes unchanged."""

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.control.safety import (
    GovernorState,
    Measurement,
    Request,
    SafetyLimits,
    Skin,
    Verdict,
    step,
)

DT = 0.01
START = np.array([[0.0, 0.3, 1.4], [0.0, -0.3, 1.4]])
LIMITS = SafetyLimits(person_distance=0.0, held_distance=0.0, least_distance=0.0)
X, Y = np.eye(3)[:2]
NOTHING = np.zeros((2, 3))
ANY_NUMBER = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.floats(-1.0, 1.0),
    st.floats(-50.0, 50.0),
)


class Arms:
    """Governed grippers that follow at once, unless they are told to stand still."""

    def __init__(self, limits: SafetyLimits = LIMITS, follow: bool = True) -> None:
        self.limits, self.follow = limits, follow
        self.state = GovernorState(START)
        self.time = 0.0
        self.verdicts = (Verdict.NONE, Verdict.NONE)
        self.path = [START]
        self.seen = Verdict.NONE

    def ask(
        self,
        velocity: np.ndarray,
        force: npt.ArrayLike = NOTHING,
        duration: float = DT,
        stamp: float | None = None,
        position: np.ndarray | None = None,
        wall: float | None = None,
    ) -> np.ndarray:
        """Asks for `duration`; returns (T,2,3) the commands' velocities by their positions."""
        path = [self.state.position]
        for _ in range(round(duration / DT)):
            measured = self.state.position if self.follow else START
            self.state, self.verdicts = step(
                self.state,
                Request(np.broadcast_to(velocity, (2, 3)), self.time if stamp is None else stamp),
                Measurement(
                    measured if position is None else position, np.broadcast_to(force, (2, 3))
                ),
                self.limits,
                self.time,
                DT,
                skin=None if wall is None else self._skin(wall),
            )
            self.time += DT
            self.seen |= self.verdicts[0] | self.verdicts[1]
            self.path.append(self.state.position)
            path.append(self.state.position)
        return np.diff(path, axis=0) / DT

    def _skin(self, wall: float) -> Skin:
        """Returns a person who is all that lies beyond x = `wall`, m."""
        return Skin(wall - self.state.position[:, 0], np.tile(-X, (2, 1)))


def test_request_within_all_limits_passes_unchanged() -> None:
    arms = Arms()
    rng = np.random.default_rng(0)
    wanted = NOTHING
    for _ in range(200):
        change = rng.normal(size=(2, 3))
        change *= 0.9 * LIMITS.max_acceleration * DT / np.linalg.norm(change, axis=1)[:, None]
        if np.linalg.norm(wanted + change, axis=1).max() < LIMITS.max_speed:
            wanted = wanted + change
        arms.ask(wanted, force=8.0 * X)
        np.testing.assert_array_equal(arms.state.velocity, wanted)
        assert arms.verdicts == (Verdict.NONE, Verdict.NONE)


@settings(max_examples=150)
@given(
    st.lists(st.lists(ANY_NUMBER, min_size=19, max_size=19), min_size=2, max_size=12),
    st.booleans(),
)
def test_no_input_gets_past_speed_and_acceleration(rows: list[list[float]], fresh: bool) -> None:
    arms = Arms(replace(LIMITS, workspace=START.mean(axis=0) + [[-0.5] * 3, [0.5] * 3]))
    before = NOTHING
    for row in rows:
        values = np.array(row)
        velocity = arms.ask(
            values[:6].reshape(2, 3),
            values[6:12].reshape(2, 3),
            stamp=None if fresh else float(values[18]),
            position=values[12:18].reshape(2, 3),
        )[0]
        assert np.isfinite(arms.state.position).all()
        assert np.linalg.norm(velocity, axis=1).max() <= LIMITS.max_speed + 1e-9
        change = np.linalg.norm(velocity - before, axis=1).max()
        assert change <= LIMITS.max_braking * DT + 1e-9
        before = velocity


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_pull_at_the_hard_limit_only_falls_until_it_is_gone(seed: int) -> None:
    # other limits want otherwise: the workspace ends here, and the gripper stands still behind
    rng = np.random.default_rng(seed)
    last = rng.normal(size=(2, 3))
    last *= LIMITS.max_speed * rng.random() / np.linalg.norm(last, axis=1).max()
    limits = replace(
        LIMITS,
        workspace=START.mean(axis=0) + [[-0.01, -0.31, -0.01], [0.01, 0.31, 0.01]],
        largest_distance=0.605,
    )
    force = rng.normal(size=(2, 3))
    size = np.linalg.norm(force, axis=1)[:, None]
    force *= LIMITS.hard_force * rng.uniform(1.0, 3.0, size=(2, 1)) / size
    against = -force / np.linalg.norm(force, axis=1)[:, None]
    state = GovernorState(START, last)
    measured = START + 0.02 * rng.normal(size=(2, 3))
    for k in range(20):
        pull = np.sum(against * state.velocity, axis=1)
        request = Request(0.3 * rng.normal(size=(2, 3)), k * DT)
        state, _ = step(state, request, Measurement(measured, force), limits, k * DT, DT)
        left = np.maximum(0.0, pull - limits.max_braking * DT)
        assert np.all(np.sum(against * state.velocity, axis=1) <= left + 1e-9)
    assert np.all(np.sum(against * state.velocity, axis=1) <= 1e-9)


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_pull_fades_as_force_rises_and_the_rest_stays(share: float) -> None:
    arms = Arms(follow=True)
    force = LIMITS.hard_force - share * (LIMITS.hard_force - LIMITS.soft_force)
    wanted = np.array([0.08, 0.06, 0.0])
    velocity = arms.ask(wanted, -force * X, duration=1.0)[-1]
    np.testing.assert_allclose(velocity, np.tile([0.08 * share, 0.06, 0.0], (2, 1)), atol=1e-6)
    assert (arms.verdicts[0] & Verdict.FORCE != 0) == (share < 1.0)


def test_moving_with_the_force_is_not_held_back() -> None:
    velocity = Arms().ask(0.1 * X, 0.9 * LIMITS.hard_force * X, duration=1.0)[-1]
    np.testing.assert_allclose(velocity, np.tile(0.1 * X, (2, 1)), atol=1e-9)


def test_beyond_the_limit_the_gripper_gives_way_along_the_force() -> None:
    arms = Arms(replace(LIMITS, stop_time=60.0))
    velocity = arms.ask(0.2 * X + 0.05 * Y, -(LIMITS.hard_force + 10.0) * X, duration=1.0)[-1]
    np.testing.assert_allclose(velocity, np.tile(-0.05 * X + 0.05 * Y, (2, 1)), atol=1e-6)
    velocity = arms.ask(0.2 * X, -(LIMITS.hard_force + 1e5) * X, duration=1.0)[-1]
    np.testing.assert_allclose(velocity, np.tile(-LIMITS.yield_speed * X, (2, 1)), atol=1e-6)


def test_force_over_the_limit_is_answered_at_once_and_flutter_is_not() -> None:
    arms = Arms()
    arms.ask(0.12 * X, duration=0.5)
    velocity = arms.ask(0.12 * X, -0.99 * LIMITS.hard_force * X)[-1]
    np.testing.assert_allclose(velocity, np.tile(0.12 * X, (2, 1)))  # one sample: flutter
    velocity = arms.ask(0.12 * X, -1.0 * LIMITS.hard_force * X)[-1]
    np.testing.assert_allclose(velocity[:, 0], 0.12 - LIMITS.max_braking * DT)
    assert Verdict.BRAKING in arms.verdicts[0]


def test_lasting_force_stops_both_until_it_is_under_the_soft_limit() -> None:
    arms = Arms()
    left = np.stack([-(LIMITS.hard_force + 1.0) * X, 0.0 * X])
    arms.ask(0.1 * Y, left, duration=LIMITS.stop_time - DT)
    assert Verdict.STOPPED not in arms.verdicts[0]
    arms.ask(0.1 * Y, left, duration=2 * DT)
    assert Verdict.STOPPED in arms.verdicts[0]
    assert Verdict.STOPPED in arms.verdicts[1]
    # between soft and hard it stays stopped: the pulled gripper gives way, the other rests
    velocity = arms.ask(0.1 * Y, 0.6 * left, duration=3.0)[-1]
    np.testing.assert_allclose(velocity, [-LIMITS.relax_speed * X, 0.0 * X], atol=1e-9)
    velocity = arms.ask(0.1 * Y, 0.4 * left, duration=1.0)[-1]
    np.testing.assert_allclose(velocity, np.tile(0.1 * Y, (2, 1)), atol=1e-9)
    assert arms.verdicts == (Verdict.NONE, Verdict.NONE)


def test_a_stop_ends_though_the_person_is_in_the_way_of_the_gripper_that_is_pulled() -> None:
    limits = replace(LIMITS, person_distance=0.03)
    arms, soft = Arms(limits), limits.soft_force
    wall = float(START[:, 0].max()) + limits.person_distance

    def feels() -> np.ndarray:
        # the pull of the left gripper is what the right one feels, beside a weight
        tension = soft - 0.5 + 300.0 * (arms.state.position[0, 0] - START[0, 0])
        return np.stack([-tension * X, (tension + 1.5) * X])

    hard = np.stack([0.0 * X, (limits.hard_force + 1.0) * X])
    arms.ask(NOTHING, hard, duration=1.2 * limits.stop_time, wall=wall)
    assert Verdict.STOPPED in arms.verdicts[0]
    for _ in range(300):
        arms.ask(NOTHING, feels(), wall=wall)
    assert Verdict.STOPPED not in arms.verdicts[0]
    assert arms.state.position[1, 0] == pytest.approx(START[1, 0], abs=1e-3)
    # it gave way as far as needed
    assert 0.5 * soft < np.linalg.norm(feels()[1]) < soft


def test_gripper_that_gives_way_while_stopped_does_not_leave_the_workspace() -> None:
    # a weight over the soft limit would draw it down for ever
    box = START.mean(axis=0) + np.array([[-0.1, -0.5, -0.1], [0.1, 0.5, 0.1]])
    arms = Arms(replace(LIMITS, workspace=box))
    arms.ask(NOTHING, [0.0, 0.0, -22.0], duration=1.5 * LIMITS.stop_time)
    arms.ask(NOTHING, [0.0, 0.0, -15.0], duration=10.0)
    assert Verdict.STOPPED in arms.verdicts[0]
    np.testing.assert_allclose(arms.state.position[:, 2], box[0, 2], atol=1e-4)
    assert np.array(arms.path)[:, :, 2].min() >= box[0, 2] - 1e-12


def test_force_that_chatters_about_the_limit_stops_in_the_end() -> None:
    arms = Arms()
    for k in range(300):
        arms.ask(0.1 * Y, -(24.0 if k % 3 else 15.0) * X)
    assert Verdict.STOPPED in arms.verdicts[0]


def test_stale_request_comes_to_rest_by_ordinary_braking() -> None:
    arms = Arms()
    arms.ask(LIMITS.max_speed * X, duration=0.5)
    last = arms.time - DT
    arms.ask(LIMITS.max_speed * X, duration=LIMITS.stale_time, stamp=last)
    assert not arms.verdicts[0]
    braking = LIMITS.max_speed / LIMITS.max_acceleration
    velocity = arms.ask(LIMITS.max_speed * X, duration=braking + DT, stamp=last)
    assert np.linalg.norm(velocity[0], axis=1).max() < LIMITS.max_speed
    np.testing.assert_array_equal(velocity[-1], 0.0)
    changes = np.linalg.norm(np.diff(velocity, axis=0), axis=2)
    assert changes.max() <= LIMITS.max_acceleration * DT + 1e-9
    assert Verdict.STALE in arms.verdicts[0]


def test_old_request_is_not_obeyed_after_a_newer_one() -> None:
    arms = Arms()
    arms.ask(NOTHING, duration=0.5)
    arms.ask(0.02 * X, stamp=arms.time - 0.05)
    assert Verdict.STALE in arms.verdicts[0]
    np.testing.assert_array_equal(arms.state.velocity, 0.0)


def test_request_from_the_future_is_not_obeyed_and_shuts_nobody_out() -> None:
    arms = Arms()
    arms.ask(0.02 * X, stamp=1e9)
    np.testing.assert_array_equal(arms.state.velocity, 0.0)
    arms.ask(0.02 * X)
    np.testing.assert_array_equal(arms.state.velocity, np.tile(0.02 * X, (2, 1)))


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300, 100.0])
def test_one_side_that_is_no_velocity_brings_both_to_rest(bad: float) -> None:
    arms = Arms()
    arms.ask(0.1 * X, duration=0.5)
    arms.ask(np.array([[0.1, 0.0, 0.0], [0.0, bad, 0.0]]), duration=0.1)
    np.testing.assert_allclose(arms.state.velocity, 0.0, atol=1e-12)
    assert Verdict.INVALID in arms.verdicts[0]
    assert Verdict.INVALID in arms.verdicts[1]


@pytest.mark.parametrize("quantity", ["force", "position"])
def test_one_side_unmeasured_stops_both_until_it_is_measured(quantity: str) -> None:
    arms = Arms()
    arms.ask(0.2 * X, duration=0.5)
    hidden = np.array([[np.nan, 0.0, 0.0], [0.0, 0.0, 0.0]])
    hidden = hidden + (arms.state.position if quantity == "position" else 0.0)
    unmeasured: dict[str, Any] = {quantity: hidden}
    arms.ask(0.2 * X, duration=0.2 / LIMITS.max_braking + DT, **unmeasured)
    np.testing.assert_allclose(arms.state.velocity, 0.0, atol=1e-12)
    assert Verdict.UNMEASURED in arms.verdicts[0]
    assert Verdict.UNMEASURED not in arms.verdicts[1]
    arms.ask(0.2 * X, duration=0.5)
    np.testing.assert_allclose(arms.state.velocity, np.tile(0.2 * X, (2, 1)))


def test_command_does_not_run_away_from_a_gripper_that_stands_still() -> None:
    arms = Arms(follow=False)
    rng = np.random.default_rng(3)
    for _ in range(100):
        arms.ask(rng.normal(size=(2, 3)), duration=0.12)
    furthest = np.linalg.norm(np.array(arms.path) - START, axis=2).max()
    assert 0.9 * LIMITS.max_lead < furthest <= LIMITS.max_lead + 1e-12
    assert Verdict.LEAD in arms.seen


def test_nothing_winds_up_while_a_gripper_is_held_back() -> None:
    arms = Arms(follow=False)
    arms.ask(0.2 * X, duration=10.0)
    velocity = arms.ask(-0.2 * X, duration=DT)[0]
    assert np.all(velocity[:, 0] < 0.0)


def test_workspace_is_reached_and_not_left() -> None:
    box = START.mean(axis=0) + np.array([[-0.1, -0.5, -0.1], [0.1, 0.5, 0.1]])
    arms = Arms(replace(LIMITS, workspace=box))
    rng = np.random.default_rng(5)
    for _ in range(30):
        arms.ask(0.25 * rng.choice([-1.0, 1.0], size=(2, 3)), duration=0.8)
    path = np.array(arms.path)
    assert np.all(path >= box[0] - 1e-12)
    assert np.all(path <= box[1] + 1e-12)
    assert path[:, :, 2].min() < box[0, 2] + 1e-3
    assert Verdict.WORKSPACE in arms.seen


def test_full_speed_lasts_until_ordinary_braking_stops_at_the_border() -> None:
    box = START.mean(axis=0) + np.array([[-1.0, -1.0, -1.0], [0.2, 1.0, 1.0]])
    arms = Arms(replace(LIMITS, workspace=box))
    velocity = arms.ask(LIMITS.max_speed * X, duration=1.5)[:, 0, 0]
    room = box[1, 0] - np.array(arms.path)[1:, 0, 0]
    # of what is left after a step, another step at that speed is needed to begin braking
    needed = LIMITS.max_speed**2 / (2.0 * LIMITS.max_acceleration) + LIMITS.max_speed * DT
    free = (room > needed) & (np.arange(len(room)) > 20)
    assert free.sum() > 20
    np.testing.assert_allclose(velocity[free], LIMITS.max_speed)
    assert 0.0 <= room[-1] < 1e-4
    assert np.diff(velocity).min() >= -LIMITS.max_acceleration * DT - 1e-12


@pytest.mark.parametrize(
    ("limits", "measured", "back", "flag"),
    [
        ({"workspace": START.mean(axis=0) + [[-1.0] * 3, [-0.05, 1.0, 1.0]]}, 0.0, -X, "WORKSPACE"),
        (
            {"workspace": START.mean(axis=0) + [[0.05, -1, -1], [1.0, 1.0, 1.0]]},
            0.0,
            X,
            "WORKSPACE",
        ),
        ({"largest_distance": 0.5}, 0.0, -Y, "DISTANCE"),
        # each has half of what is left
        ({"least_distance": 0.7}, 0.0, 0.5 * Y, "DISTANCE"),
        ({}, -0.2 * X, -X, "LEAD"),
    ],
)
def test_a_limit_of_place_that_is_broken_is_made_good_slowly(
    limits: dict[str, Any], measured: np.ndarray, back: np.ndarray, flag: str
) -> None:
    arms = Arms(replace(LIMITS, **limits))
    for _ in range(20):
        arms.ask(NOTHING, position=arms.state.position + measured)
        assert all(Verdict[flag] in verdict for verdict in arms.verdicts)
    mirrored = np.array([[1.0], [-1.0 if flag == "DISTANCE" else 1.0]])
    expected = LIMITS.relax_speed * back * mirrored
    np.testing.assert_allclose(arms.state.velocity, expected, atol=1e-9)


def test_distances_that_are_broken_end_where_they_may_be() -> None:
    for limits, apart in (
        (replace(LIMITS, largest_distance=0.55), 0.55),
        (replace(LIMITS, least_distance=0.65), 0.65),
    ):
        arms = Arms(limits)
        arms.ask(NOTHING, duration=8.0)
        left, right = arms.state.position
        assert np.linalg.norm(left - right) == pytest.approx(apart, abs=1e-3)


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
def test_what_was_cut_is_told_and_nothing_else(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arms = Arms(replace(LIMITS, stop_time=60.0))
    arms.ask(0.1 * rng.normal(size=3), duration=0.2)
    last = arms.state.velocity.copy()
    wanted = 0.2 * rng.normal(size=(2, 3))
    force = rng.choice([0.5, 0.9, 1.0, 1.5]) * LIMITS.hard_force * X
    arms.ask(wanted, force)
    slowed = LIMITS.max_acceleration * DT * (1.0 + 1e-6)
    for i, verdict in enumerate(arms.verdicts):
        assert (Verdict.SPEED in verdict) == (np.linalg.norm(wanted[i]) > LIMITS.max_speed)
        assert (Verdict.ACCELERATION in verdict) == (np.linalg.norm(wanted[i] - last[i]) > slowed)
        changed = np.linalg.norm(arms.state.velocity[i] - last[i])
        assert (Verdict.BRAKING in verdict) == (changed > slowed)
        rest = Verdict.WORKSPACE | Verdict.DISTANCE | Verdict.PERSON | Verdict.STALE
        assert not verdict & (rest | Verdict.INVALID | Verdict.UNMEASURED | Verdict.HELD)


def test_all_reasons_to_stand_still_are_told_together() -> None:
    arms = Arms()
    arms.ask(NOTHING, -(LIMITS.hard_force + 5.0) * X, duration=2.0 * LIMITS.stop_time)
    hidden = arms.state.position + [[np.nan, 0.0, 0.0], [0.0, 0.0, 0.0]]
    arms.ask(np.full(3, np.inf), -LIMITS.hard_force * X, stamp=-9.0, position=hidden)
    both = Verdict.STOPPED | Verdict.STALE | Verdict.INVALID
    assert arms.verdicts[0] & (both | Verdict.UNMEASURED) == both | Verdict.UNMEASURED
    assert arms.verdicts[1] & (both | Verdict.UNMEASURED) == both


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_grippers_keep_their_distances(sign: float) -> None:
    arms = Arms(replace(LIMITS, least_distance=0.2, largest_distance=0.8))
    for k in range(400):
        turning = 0.1 * np.array([[np.sin(0.02 * k), 0.0, 0.1], [-np.sin(0.02 * k), 0.0, -0.1]])
        outward = sign * np.array([[0.0, 0.2, 0.0], [0.0, -0.2, 0.0]])
        arms.ask(outward + turning)
    path = np.array(arms.path)
    apart = np.linalg.norm(path[:, 0] - path[:, 1], axis=1)
    if sign > 0.0:
        assert 0.79 < apart.max() <= 0.8 + 1e-12
    else:
        assert 0.2 - 1e-12 <= apart.min() < 0.21
    assert Verdict.DISTANCE in arms.seen


@pytest.mark.parametrize("aside", [0.0, 0.2])
def test_a_gripper_stops_before_the_person(aside: float) -> None:
    arms = Arms(replace(LIMITS, person_distance=0.03))
    velocity = arms.ask(0.25 * X + aside * Y, duration=2.0, wall=0.2)
    path = np.array(arms.path)
    assert 0.165 < path[-1, 0, 0] <= 0.17 + 1e-12
    assert path[:, :, 0].max() <= 0.17 + 1e-12
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=2).max()
    assert change <= LIMITS.max_acceleration * DT + 1e-9
    np.testing.assert_allclose(velocity[-1, :, 1], aside, atol=1e-9)
    assert Verdict.PERSON in arms.seen
    assert Verdict.BRAKING not in arms.seen


def test_a_gripper_gives_way_to_a_person_who_comes() -> None:
    arms = Arms(replace(LIMITS, person_distance=0.03))
    nearest = []
    for k in range(300):
        wall = 0.2 - 0.08 * k * DT
        arms.ask(NOTHING, wall=wall)
        nearest.append(wall - arms.state.position[:, 0].max())
    # it goes as fast as they come where what is lacking over the time to make it good is that speed
    assert 0.02 < min(nearest) < 0.03
    assert arms.state.velocity[0, 0] == pytest.approx(-0.08, abs=2e-3)


def test_a_force_over_the_limit_counts_more_than_the_distance_to_the_person() -> None:
    arms = Arms(replace(LIMITS, person_distance=0.03))
    velocity = arms.ask(NOTHING, force=(LIMITS.hard_force + 4.0) * X, duration=0.3, wall=0.02)
    np.testing.assert_allclose(velocity[-1, :, 0], 4.0 * LIMITS.yield_rate, rtol=1e-6)


def test_without_a_distance_to_keep_a_person_is_touched() -> None:
    arms = Arms()
    arms.ask(0.25 * X, duration=1.0, wall=0.1)
    assert arms.state.position[0, 0] > 0.2
    assert Verdict.PERSON not in arms.seen


def test_state_survives_being_packed() -> None:
    arms = Arms()
    arms.ask(0.1 * X, -30.0 * Y, duration=0.7)
    assert arms.state.stopped
    packed = arms.state.packed()
    assert packed.shape == (GovernorState.SIZE,)
    np.testing.assert_array_equal(GovernorState.unpacked(packed).packed(), packed)


@pytest.mark.parametrize(
    "bad",
    [
        {"max_speed": 0.0},
        {"max_speed": np.nan},
        {"max_braking": 1.0},
        {"soft_force": 30.0},
        {"least_distance": 0.3, "largest_distance": 0.2},
        {"workspace": np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])},
    ],
)
def test_limits_that_contradict_each_other_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(reversed(bad)).split("_")[-1]):
        SafetyLimits(**bad)


def test_start_outside_the_limits_of_place_is_told() -> None:
    assert LIMITS.broken_at(START) is None
    assert "0.600 m apart" in str(replace(LIMITS, largest_distance=0.5).broken_at(START))
    box = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.3]])
    assert "outside the workspace" in str(replace(LIMITS, workspace=box).broken_at(START))


@pytest.mark.parametrize("gripper", [0, 1])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("beyond", "broken"), [(-0.31, True), (0.31, True), (0.29, False), (-0.29, False)]
)
def test_a_start_beyond_any_side_of_the_workspace_is_told(
    gripper: int, axis: int, beyond: float, broken: bool
) -> None:
    at = np.array([[0.0, 0.2, 1.0], [0.0, -0.2, 1.0]])
    box = np.stack([at.min(axis=0) - 0.3, at.max(axis=0) + 0.3])
    limits = SafetyLimits(workspace=box, least_distance=0.01)
    assert limits.broken_at(at) is None
    edge = box[0, axis] + 0.3 if beyond < 0.0 else box[1, axis] - 0.3
    at[gripper, axis] = edge + beyond
    told = limits.broken_at(at)
    assert (told is not None) == broken
    assert told is None or "outside the workspace" in told
