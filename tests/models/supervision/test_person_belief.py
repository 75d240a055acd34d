"""An estimate is believed if the person that is described can be so, and only then."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import JOINT_NAMES
from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points, shoulder_joint
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.fault import Fault
from drake_dress.models.supervision.person_belief import (
    PersonBounds,
    PersonTrack,
    judge_person,
)
from drake_dress.models.supervision.person_pose import POINT_NAMES, PoseBounds, impossible_pose
from drake_dress.models.supervision.wrong_points import WRONG_POINTS, Moment

BODY = BodyMeasures()
# as of the joints of `diagrams.person.JointParameters`
LOW, HIGH = np.array([-0.6, -2.6, -1.2, 0.0]), np.array([2.6, 1.2, 1.2, 2.5])
POSE = PoseBounds(
    shoulders=np.stack([shoulder_joint(BODY, "standing", side) for side in SIDES]),
    limbs=((BODY.upper_arm_length, BODY.forearm_length),) * 2,
    limits=np.stack([[LOW, HIGH]] * 2),
)
BOUNDS = PersonBounds(POSE)
REST = np.deg2rad([13.0, 46.0, 0.0, 10.0])
PERIOD = 0.02

share = st.floats(0.0, 1.0)
angles = st.tuples(share, share, share, share).map(lambda s: LOW + np.array(s) * (HIGH - LOW))
# a mistake is found in each draw, or in none
few = settings(max_examples=40)
seeds = st.integers(0, 2**32 - 1)


def person(left: np.ndarray, right: np.ndarray, yaw: float = 0.0) -> np.ndarray:
    c, s = np.cos(yaw), np.sin(yaw)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3)
    return np.vstack(
        [
            arm_points(BODY, "standing", side, ArmPose(*map(float, q)), turned)
            for side, q in zip(SIDES, (left, right), strict=True)
        ]
    )


def noise(seed: int, shape: tuple[int, int] = (6, 3)) -> np.ndarray:
    """Returns errors of points, each as long as it may be."""
    error = np.random.default_rng(seed).normal(size=shape)
    return POSE.point_error * error / np.linalg.norm(error, axis=1, keepdims=True)


def refused(points: np.ndarray) -> str:
    told = impossible_pose(points, POSE)
    assert told is not None
    return told


@few
@given(angles, angles, st.floats(-np.pi / 2, np.pi / 2), seeds)
def test_whatever_the_person_can_do_is_believed(
    left: np.ndarray, right: np.ndarray, yaw: float, seed: int
) -> None:
    # the errors of the shoulders turn them by some degrees
    points = person(left, right, np.clip(yaw, -1.4, 1.4)) + noise(seed)
    assert impossible_pose(points, POSE) is None
    assert impossible_pose(person(left, right, yaw), POSE) is None


@few
@given(angles, angles, seeds, st.floats(2.0, 1e4), st.booleans())
def test_other_units_are_refused(
    left: np.ndarray, right: np.ndarray, seed: int, factor: float, larger: bool
) -> None:
    refused((factor if larger else 1.0 / factor) * (person(left, right) + noise(seed)))


@few
@given(angles, angles, seeds, st.sampled_from([(1e3, "mm"), (1e2, "cm"), (1 / 0.0254, "inches")]))
def test_usual_units_are_named(
    left: np.ndarray, right: np.ndarray, seed: int, unit: tuple[float, str]
) -> None:
    told = refused(unit[0] * (person(left, right) + noise(seed)))
    assert told.startswith(f"coordinates are in {unit[1]}: ")


@few
@given(angles, angles, st.floats(-1.0, 1.0), seeds)
def test_swapped_sides_are_refused_and_named(
    left: np.ndarray, right: np.ndarray, yaw: float, seed: int
) -> None:
    points = (person(left, right, yaw) + noise(seed))[[3, 4, 5, 0, 1, 2]]
    assert refused(points).startswith("left and right are swapped")


@pytest.mark.parametrize(
    "turn",
    [
        lambda x: np.stack([x[:, 0], x[:, 2], -x[:, 1]], axis=1),
        lambda x: x[:, [1, 2, 0]],
        lambda x: x[:, [0, 2, 1]],
    ],
)
@few
@given(angles, angles, seeds)
def test_y_up_is_refused_and_named(
    turn: Callable[[FloatArray], FloatArray], left: np.ndarray, right: np.ndarray, seed: int
) -> None:
    assert refused(turn(person(left, right) + noise(seed))).startswith("coordinates are y up")


@few
@given(angles, angles, seeds, st.integers(0, 5))
def test_a_lost_point_is_named(left: np.ndarray, right: np.ndarray, seed: int, k: int) -> None:
    points = person(left, right) + noise(seed)
    points[k] = 0.0
    assert refused(points) == f"{POINT_NAMES[k]} at (0, 0, 0), as a lost point written as zero"


@few
@given(angles, angles, seeds, st.floats(1e3, 1e37), st.integers(0, 5))
def test_a_huge_value_is_told_with_its_limb(
    left: np.ndarray, right: np.ndarray, seed: int, size: float, k: int
) -> None:
    points = person(left, right) + noise(seed)
    points[k] *= size
    assert ", expected " in refused(points)


@few
@given(angles, angles, seeds, st.sampled_from([0, 1, 2]), st.booleans())
def test_a_person_elsewhere_is_told_by_how_much(
    left: np.ndarray, right: np.ndarray, seed: int, axis: int, back: bool
) -> None:
    points = person(left, right) + noise(seed)
    points[:, axis] += -1.0 if back else 1.0
    assert "m from where the scenario's person has them, expected 0.25 m at most" in refused(points)


def test_a_limb_is_told_with_its_length_and_bounds() -> None:
    points = person(REST, REST)
    points[2] += 4.0 * (points[2] - points[1])
    assert refused(points) == "left forearm 1.6 m, expected 0.21 to 0.43 m"


def test_an_elbow_that_bends_backward_is_told() -> None:
    points = person(np.array([0.3, 0.0, np.pi, 1.5]), REST)
    told = refused(points)
    found = re.search(r"left arm's (\w+) (-?\d+)°, expected (-?\d+) to (-?\d+)°", told)
    assert found is not None, told
    angle, low, high = map(int, found.groups()[1:])
    # wider than the joint's limits: by a supple person's room, and by what errors of points turn
    limit = np.degrees([bound[JOINT_NAMES.index(found[1])] for bound in (LOW, HIGH)])
    assert limit[0] - 180.0 < low < limit[0] - 9.0
    assert limit[1] + 9.0 < high < limit[1] + 180.0
    assert not low <= angle <= high


@settings(max_examples=20)
@given(seeds, st.sampled_from([1.0, 0.5, 0.1, 0.02]), st.floats(-0.9, 0.9))
def test_motion_within_the_bounds_is_believed(seed: int, speed_share: float, way: float) -> None:
    """Each point moves by no more than the bound, whatever it is doing, with noise."""
    rng = np.random.default_rng(seed)
    track: PersonTrack | None = None
    # of a hand that is all of an arm from the shoulder
    rate = speed_share * BOUNDS.speed / (BODY.upper_arm_length + BODY.forearm_length)
    for k in range(40):
        swing = 0.4 * np.sin(rate * k * PERIOD / 0.4) + way
        arms = np.array([0.9, swing, 0.0, 0.3])
        error = noise(int(rng.integers(2**32)))
        found, track = judge_person(person(arms, REST) + error, PERIOD * k, track, BOUNDS)
        assert not found.fault, found.reason


@pytest.mark.parametrize("point", range(6))
def test_a_point_that_leaps_is_told(point: int) -> None:
    at_first, then = person(REST, REST), person(REST, REST)
    track = None
    _, track = judge_person(at_first, 1.0, track, BOUNDS)
    # of arms whose points are elsewhere, and possible
    other = np.array([1.5, -1.0, 0.0, 0.4])
    moved = person(other if point < 3 else REST, REST if point < 3 else other)
    if point % 3 == 0:
        moved[:, :2] += [0.15, 0.1]
    then[:] = moved
    found, again = judge_person(then, 1.0 + PERIOD, track, BOUNDS)
    assert found.fault is Fault.LEAP
    assert "expected 0.12 m at most" in found.reason
    assert again is track
    # a moment later it may have moved there
    found, _ = judge_person(then, 2.0, track, BOUNDS)
    assert not found.fault


def test_steps_within_the_error_of_a_point_do_not_add_up() -> None:
    slow = replace(BOUNDS, speed=0.1)
    track, faults = None, set()
    for k in range(20):
        arms = np.array([0.5, -0.09 * k, 0.0, 0.2])
        found, track = judge_person(person(arms, REST), PERIOD * k, track, slow)
        faults.add(found.fault)
    assert Fault.LEAP in faults


def judged(points: list[np.ndarray], bounds: PersonBounds = BOUNDS) -> list[Fault]:
    track, faults = None, []
    for k, x in enumerate(points):
        found, track = judge_person(x, PERIOD * k, track, bounds)
        faults.append(found.fault)
    return faults


@settings(max_examples=5)
@given(seeds)
def test_a_tracker_that_freezes_is_told_and_one_without_noise_is_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    still = person(REST, REST)
    noisy = [still + 1e-4 * rng.normal(size=(6, 3)) for _ in range(40)]
    frozen = judged(noisy + [noisy[-1]] * 40)
    begin = 40 + round(BOUNDS.frozen_time / PERIOD)
    assert set(frozen[: begin - 2]) == {Fault.NONE}
    assert set(frozen[begin:]) == {Fault.FROZEN}
    assert set(judged([still] * 100)) == {Fault.NONE}
    unjudged = replace(BOUNDS, frozen_time=0.0)
    assert set(judged(noisy + [noisy[-1]] * 40, unjudged)) == {Fault.NONE}
    # one that lives again is believed again
    assert judged(noisy + [noisy[-1]] * 40 + noisy)[-1] is Fault.NONE


def test_one_repeated_estimate_of_a_slow_sensor_is_not_frozen() -> None:
    """However long its period is: a rounded number may come twice."""
    slow = 2.0 * BOUNDS.frozen_time
    points = [person(REST, REST) + 1e-6 * k for k in range(40)]
    repeated = [*points, points[-1], points[-1]]
    track: PersonTrack | None = None
    for k, p in enumerate(repeated):
        finding, track = judge_person(p, k * slow, track, BOUNDS)
        assert not finding.fault & Fault.FROZEN
    for k in range(len(repeated), len(repeated) + 4):
        finding, track = judge_person(points[-1], k * slow, track, BOUNDS)
    assert finding.fault & Fault.FROZEN


def test_a_frozen_hand_is_told_by_name() -> None:
    rng = np.random.default_rng(0)
    track, held, found = None, None, None
    for k in range(80):
        x = person(REST, REST) + 1e-4 * rng.normal(size=(6, 3))
        if k >= 40:
            held = x[2].copy() if held is None else held
            x[2] = held
        found, track = judge_person(x, PERIOD * k, track, BOUNDS)
    assert found is not None
    assert found.fault is Fault.FROZEN
    assert found.reason.startswith("left hand the same to the last bit for 0.")


@pytest.mark.parametrize("kind", [k for k in WRONG_POINTS if k.startswith("person")])
def test_all_that_a_lab_plays_is_refused(kind: str) -> None:
    rng = np.random.default_rng(1)
    track, first, faults = None, None, []
    for k in range(90):
        x = person(REST, REST) + 1e-4 * rng.normal(size=(6, 3))
        if k >= 40:
            first = x if first is None else first
            x = WRONG_POINTS[kind](Moment(x, first, k - 40))
        found, track = judge_person(x, PERIOD * k, track, BOUNDS)
        faults.append(found.fault)
    assert set(faults[:40]) == {Fault.NONE}
    if kind == "person_jump":
        assert set(faults[40::2]) == {Fault.LEAP}
    elif kind == "person_frozen":
        assert set(faults[66:]) == {Fault.FROZEN}
    else:
        assert set(faults[40:]) == {Fault.IMPOSSIBLE}
