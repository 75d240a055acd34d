"""Laws of the linking number, and the false successes that it is there to catch."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.linking import (
    _apex,
    _aside,
    _height,
    arm_linking_number,
    linking_number,
)
from drake_dress.models.dressing.linking import _distance as _distance_of_points

SHOULDER = np.array([0.0, 0.18, 1.40])
ELBOW = np.array([-0.05, 0.38, 1.20])
HAND = np.array([0.05, 0.60, 1.00])
INTERIOR = np.array([0.0, 0.0, 1.30])
ARM = (SHOULDER, ELBOW, HAND, INTERIOR)


def ring(
    center: FloatArray, normal: FloatArray, radius: float = 0.1, nodes: int = 40
) -> FloatArray:
    """Returns a circle (nodes,3), counter-clockwise about `normal`."""
    normal = normal / np.linalg.norm(normal)
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    t = 2.0 * np.pi * np.arange(nodes)[:, None] / nodes
    circle: FloatArray = center + radius * (np.cos(t) * first + np.sin(t) * np.cross(normal, first))
    return circle


def wavy(loop: FloatArray, normal: FloatArray, height: float, waves: int) -> FloatArray:
    t = 2.0 * np.pi * np.arange(len(loop)) / len(loop)
    result: FloatArray = loop + height * np.sin(waves * t)[:, None] * normal
    return result


def arm_line(closing_side: FloatArray) -> FloatArray:
    """Returns the arm as a closed curve, its way back far out on `closing_side`."""
    return np.stack([HAND, ELBOW, SHOULDER, INTERIOR, INTERIOR + closing_side, HAND + closing_side])


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.98])
def test_ring_around_either_limb_links_once(share: float) -> None:
    for end, start in ((ELBOW, HAND), (SHOULDER, ELBOW), (INTERIOR, SHOULDER)):
        loop = ring(start + share * (end - start), end - start)
        assert arm_linking_number(loop, *ARM) == 1
        assert arm_linking_number(loop[::-1], *ARM) == -1


@pytest.mark.parametrize("nodes", [3, 6, 12, 40, 41])
def test_ring_centred_on_the_arm_counts_once_in_every_frame(nodes: int) -> None:
    # the arm's line meets the apex of the fan: all its spokes at once
    loop = ring(HAND + 0.5 * (ELBOW - HAND), ELBOW - HAND, nodes=nodes)
    for seed in range(30):
        rotation = Rotation.random(random_state=seed).as_matrix()
        moved = [points @ rotation.T for points in (loop, *ARM)]
        assert arm_linking_number(*moved) == 1


@pytest.mark.parametrize("radius", [0.05, 0.2])
def test_apex_of_the_fan_is_next_to_the_centre_but_not_on_the_arm(radius: float) -> None:
    line = np.stack([HAND, ELBOW, SHOULDER, INTERIOR])
    for seed in range(30):
        rotation = Rotation.random(random_state=seed).as_matrix()
        center = HAND + (0.2 + 0.02 * seed) * (ELBOW - HAND)
        loop, turned = ring(center, ELBOW - HAND, radius) @ rotation.T, line @ rotation.T
        apex = _apex(loop, turned)
        assert np.linalg.norm(apex - loop.mean(axis=0)) < 2e-6 * radius
        for p, q in itertools.pairwise(turned):
            assert _aside(apex, p, q) / np.linalg.norm(q - p) > 1e-7 * radius


def test_ring_at_the_elbow_counts_once_not_per_limb() -> None:
    fore, upper = ELBOW - HAND, SHOULDER - ELBOW
    bisector = fore / np.linalg.norm(fore) + upper / np.linalg.norm(upper)
    for seed in range(30):
        rotation = Rotation.random(random_state=seed).as_matrix()
        moved = [points @ rotation.T for points in (ring(ELBOW, bisector), *ARM)]
        assert arm_linking_number(*moved) == 1


def test_joint_exactly_in_the_plane_of_the_loop_counts_once() -> None:
    shoulder, elbow, hand = np.array([[0, 0, 1.0], [0, 0, 0.5], [0, 0, 0.0]])
    loop = np.array([[0.1, 0.05, 0.5], [-0.1, 0.1, 0.5], [-0.1, -0.1, 0.5], [0.1, -0.1, 0.5]])
    assert arm_linking_number(loop, shoulder, elbow, hand, np.array([0, 0, 1.2])) == 1


def test_line_through_a_spoke_or_a_diagonal_of_the_fan_counts_once() -> None:
    square = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]])
    for x, y in ((0.05, 0.05), (-0.03, 0.03), (0.0, 0.02), (0.02, 0.0)):
        at = np.array([x, y, 0.0])
        up = np.array([0.0, 0.0, 1.0])
        assert arm_linking_number(square, at + 2 * up, at + up, at - up, at + 3 * up) == 1


def test_armhole_at_the_shoulder_with_the_arm_outside_is_not_linked() -> None:
    # The false success: the armhole has slid up beside the arm, its centre says s = 2.
    along = (SHOULDER - ELBOW) / np.linalg.norm(SHOULDER - ELBOW)
    aside = np.cross(along, [0.0, 0.0, 1.0])
    center = SHOULDER - 0.005 * along + 0.14 * aside / np.linalg.norm(aside)
    beside = ring(center, along)
    s, _, _ = ArmAxis(HAND, ELBOW, SHOULDER).coordinates(beside.mean(axis=0))
    assert s > 1.9
    assert arm_linking_number(beside, *ARM) == 0


def test_ring_beside_the_arm_is_not_linked() -> None:
    for start, end in ((HAND, ELBOW), (ELBOW, SHOULDER)):
        along = (end - start) / np.linalg.norm(end - start)
        aside = np.cross(along, [0.0, 0.0, 1.0])
        center = 0.5 * (start + end) + 0.13 * aside / np.linalg.norm(aside)
        assert arm_linking_number(ring(center, along), *ARM) == 0
        assert arm_linking_number(ring(center, aside), *ARM) == 0


def test_ring_beyond_the_hand_is_not_linked() -> None:
    along = (ELBOW - HAND) / np.linalg.norm(ELBOW - HAND)
    for gap in (0.001, 0.02, 0.1, 0.5):
        assert arm_linking_number(ring(HAND - gap * along, along), *ARM) == 0


def test_flat_loop_that_the_arm_pierces_twice_is_not_linked() -> None:
    # in at the forearm, out at the upper arm: the loop hangs across the bend of the elbow
    shoulder, elbow, hand = np.array([[0.1, 0, 0.3], [0.0, 0, 0.0], [-0.1, 0, 0.3]])
    loop = ring(np.array([0.0, 0.0, 0.15]), np.array([0.0, 0.0, 1.0]), radius=0.3)
    assert arm_linking_number(loop, shoulder, elbow, hand, np.array([0.1, 0, 0.5])) == 0


@pytest.mark.parametrize("tilt", [-65.0, -30.0, 0.0, 45.0, 65.0])
def test_turned_ring_stays_linked_until_it_lies_along_the_arm(tilt: float) -> None:
    along = ELBOW - HAND
    aside = np.cross(along, [0.0, 0.0, 1.0])
    turn = Rotation.from_rotvec(np.deg2rad(tilt) * aside / np.linalg.norm(aside))
    assert arm_linking_number(ring(0.5 * (HAND + ELBOW), turn.apply(along)), *ARM) == 1


@pytest.mark.parametrize("waves", [2, 3, 5])
def test_wavy_loops_count_like_flat_ones(waves: int) -> None:
    along = (ELBOW - HAND) / np.linalg.norm(ELBOW - HAND)
    aside = np.cross(along, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside)
    inside = ring(0.5 * (HAND + ELBOW), along)
    assert arm_linking_number(wavy(inside, along, 0.05, waves), *ARM) == 1
    assert arm_linking_number(wavy(inside + 0.2 * aside, along, 0.05, waves), *ARM) == 0
    assert arm_linking_number(wavy(inside - 0.4 * along, along, 0.05, waves), *ARM) == 0


random = st.integers(0, 2**31)


@settings(max_examples=40)
@given(seed=random)
def test_passages_equal_gauss_linking_with_a_closed_arm(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # the way back goes off to the sides where no loop is: beside the hand and inside the torso
    back = np.array([0.0, 0.2, -5.0])
    away = np.stack([HAND, HAND + back])
    for _ in range(200):
        on_arm = HAND + rng.uniform(0.05, 0.95) * (ELBOW - HAND) + rng.normal(0.0, 0.06, 3)
        loop = wavy(ring(on_arm, rng.normal(size=3)), rng.normal(0.0, 1.0, 3), 0.02, 3)
        if _distance(loop, away) > 0.25 and _distance(loop, np.stack([INTERIOR, HAND])) > 1e-3:
            break
    else:
        pytest.fail("no loop is beside the way back")
    gauss = linking_number(loop, arm_line(back))
    assert gauss == pytest.approx(round(gauss), abs=1e-9)
    assert arm_linking_number(loop, *ARM) == round(gauss)


@settings(max_examples=40)
@given(seed=random)
def test_rigid_motion_changes_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    loop = ring(ELBOW + rng.normal(0.0, 0.1, 3), rng.normal(size=3)) + rng.normal(0, 0.005, (40, 3))
    rotation, shift = Rotation.random(random_state=seed).as_matrix(), rng.normal(0.0, 2.0, 3)
    moved = [points @ rotation.T + shift for points in (loop, *ARM)]
    assert arm_linking_number(*moved) == arm_linking_number(loop, *ARM)
    curve = arm_line(np.array([0.0, 0.2, -5.0]))
    expected = linking_number(loop, curve)
    assert linking_number(moved[0], curve @ rotation.T + shift) == pytest.approx(expected, abs=1e-8)


def test_hopf_link_is_one_and_flips_with_either_direction() -> None:
    z, y = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    first = ring(np.zeros(3), z, 1.0, 17)
    second = ring(np.array([1.0, 0.0, 0.0]), y, 1.0, 23)
    number = linking_number(first, second)
    assert abs(number) == pytest.approx(1.0, abs=1e-12)
    assert linking_number(first[::-1], second) == pytest.approx(-number, abs=1e-12)
    assert linking_number(first, second[::-1]) == pytest.approx(-number, abs=1e-12)
    assert linking_number(second, first) == pytest.approx(number, abs=1e-12)
    assert linking_number(first, second + 3.0) == pytest.approx(0.0, abs=1e-12)


def test_curve_wound_twice_links_twice() -> None:
    t = 4.0 * np.pi * np.arange(80) / 80
    r = 0.3 + 0.05 * np.cos(0.5 * t)
    curve = np.stack([1.0 + r * np.cos(t), 0.02 * np.sin(0.5 * t), r * np.sin(t)], axis=1)
    loop = ring(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.0)
    assert abs(linking_number(loop, curve)) == pytest.approx(2.0, abs=1e-9)


def test_unusable_loops_are_told() -> None:
    with pytest.raises(ValueError, match=r"shape \(2, 3\)"):
        arm_linking_number(np.zeros((2, 3)), *ARM)
    with pytest.raises(ValueError, match="NaN"):
        linking_number(np.full((4, 3), np.nan), np.eye(3))


def _distance(loop: FloatArray, segment: FloatArray) -> float:
    p, d = segment[0], segment[1] - segment[0]
    t = np.clip((loop - p) @ d / (d @ d), 0.0, 1.0)
    return float(np.min(np.linalg.norm(loop - p - t[:, None] * d, axis=1)))


@settings(max_examples=40)
@given(seed=random)
def test_distances_and_volumes_are_those_of_vector_algebra(seed: int) -> None:
    p, q, r, s = np.random.default_rng(seed).normal(size=(4, 3))
    assert _distance_of_points(p, q) == pytest.approx(np.linalg.norm(q - p))
    assert _aside(p, q, r) == pytest.approx(np.linalg.norm(np.cross(p - q, r - q)))
    volume = np.linalg.det([p - r, q - r, s - r])
    assert abs(_height(p, q, r, s)) == pytest.approx(abs(volume))
