"""Laws of the arm's axis and of the dressing coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.coordinates import ArmAxis

HAND = np.array([0.05, 0.60, 1.00])
ELBOW = np.array([-0.05, 0.38, 1.20])
SHOULDER = np.array([0.0, 0.18, 1.40])

seeds = st.integers(0, 2**31)
laws = settings(max_examples=40)


def random_arm(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns hand, elbow, shoulder of a human-sized arm bent by 1° to 150°."""
    rng = np.random.default_rng(seed)
    frame = Rotation.random(random_state=seed).as_matrix()
    bend = np.deg2rad(rng.uniform(1.0, 150.0))
    hand = rng.normal(size=3)
    elbow = hand + rng.uniform(0.2, 0.4) * frame[0]
    along = np.cos(bend) * frame[0] + np.sin(bend) * frame[1]
    return hand, elbow, elbow + rng.uniform(0.2, 0.4) * along


@laws
@given(seeds)
def test_axis_runs_from_hand_to_shoulder(seed: int) -> None:
    hand, elbow, shoulder = random_arm(seed)
    axis = ArmAxis(hand, elbow, shoulder)
    np.testing.assert_allclose(axis.G(0.0), hand, atol=1e-12)
    np.testing.assert_allclose(axis.G(2.0), shoulder, atol=1e-12)
    np.testing.assert_allclose(axis.G(-3.0), hand, atol=1e-12)
    np.testing.assert_allclose(axis.G(7.0), shoulder, atol=1e-12)
    np.testing.assert_allclose(axis.D(-1.0), axis.D(0.0))
    assert axis.to_shoulder(2.0) == axis.to_shoulder(3.0) == 0.0
    s = np.linspace(0.0, 2.0, 400)
    steps = np.linalg.norm(np.diff(axis.points(s), axis=0), axis=1)
    left = [axis.to_shoulder(value) for value in s]
    np.testing.assert_allclose(-np.diff(left), steps, rtol=1e-3)
    assert left[-1] == 0.0
    np.testing.assert_allclose(axis.D(3.0), axis.D(2.0))
    lower, upper = elbow - hand, shoulder - elbow
    np.testing.assert_allclose(axis.D(0.0), lower / np.linalg.norm(lower), atol=1e-12)
    np.testing.assert_allclose(axis.D(2.0), upper / np.linalg.norm(upper), atol=1e-12)


@laws
@given(seeds)
def test_middle_of_the_arc_is_on_the_bisector_at_the_elbow(seed: int) -> None:
    hand, elbow, shoulder = random_arm(seed)
    axis = ArmAxis(hand, elbow, shoulder)
    u, w = axis.D(0.0), axis.D(2.0)
    np.testing.assert_allclose(axis.D(1.0), (u + w) / np.linalg.norm(u + w), atol=1e-9)
    offset = axis.G(1.0) - elbow
    np.testing.assert_allclose(np.cross(offset, w - u), 0.0, atol=1e-10)
    assert offset @ (w - u) >= 0.0


@laws
@given(seeds)
def test_direction_is_unit_continuous_and_that_of_the_curve(seed: int) -> None:
    axis = ArmAxis(*random_arm(seed))
    s = np.linspace(0.0, 2.0, 801)
    position, direction = np.array([axis.G(t) for t in s]), np.array([axis.D(t) for t in s])
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, atol=1e-12)
    assert np.max(np.linalg.norm(np.diff(direction, axis=0), axis=1)) < 0.15
    step = np.diff(position, axis=0)
    length = np.linalg.norm(step, axis=1)
    assert np.max(length) < 2.0 / 800 * 0.45
    # the chord between two samples leads between the two directions
    middle = direction[:-1] + direction[1:]
    cosine = np.einsum("ij,ij->i", step, middle) / length / np.linalg.norm(middle, axis=1)
    assert np.min(cosine) > 0.999
    # and on either side of the elbow s grows with length
    for half in (length[:400], length[400:]):
        np.testing.assert_allclose(half, half.mean(), rtol=1e-2)


@laws
@given(seeds)
def test_a_point_is_found_again_from_its_coordinates(seed: int) -> None:
    arm = random_arm(seed)
    axis = ArmAxis(*arm)
    rng = np.random.default_rng(seed)
    s, theta = rng.uniform(0.0, 2.0), rng.uniform(-3.1, 3.1)
    zero = np.cross(arm[1] - arm[0], arm[2] - arm[1])
    zero /= np.linalg.norm(zero)
    l = 0.01  # less than the arc's radius at every bend drawn
    side = np.cross(axis.D(s), zero)
    point = axis.G(s) + l * (np.cos(theta) * zero + np.sin(theta) * side)
    np.testing.assert_allclose(axis.coordinates(point), (s, l, theta), atol=1e-7)


@laws
@given(seeds)
def test_foot_is_the_nearest_point_of_the_axis(seed: int) -> None:
    axis = ArmAxis(*random_arm(seed))
    point = axis.G(1.0) + np.random.default_rng(seed).normal(0.0, 0.3, 3)
    s, l, _ = axis.coordinates(point)
    assert np.linalg.norm(point - axis.G(s)) == pytest.approx(l, abs=1e-12)
    distances = [np.linalg.norm(point - axis.G(t)) for t in np.linspace(0.0, 2.0, 201)]
    assert l <= min(distances) + 1e-12


@laws
@given(seeds)
def test_rigid_motion_moves_the_axis_and_keeps_coordinates(seed: int) -> None:
    arm = random_arm(seed)
    rng = np.random.default_rng(seed)
    rotation, shift = Rotation.random(random_state=seed + 1).as_matrix(), rng.normal(size=3)
    axis, moved = ArmAxis(*arm), ArmAxis(*(rotation @ p + shift for p in arm))
    for s in (0.0, 0.4, 0.99, 1.3, 2.0):
        np.testing.assert_allclose(moved.G(s), rotation @ axis.G(s) + shift, atol=1e-9)
        np.testing.assert_allclose(moved.D(s), rotation @ axis.D(s), atol=1e-9)
    point = axis.G(rng.uniform(0.0, 2.0)) + 0.01 * rng.normal(size=3)
    expected = axis.coordinates(point)
    actual = moved.coordinates(rotation @ point + shift)
    np.testing.assert_allclose(actual[:2], expected[:2], atol=1e-8)
    assert np.cos(actual.theta - expected.theta) == pytest.approx(1.0, abs=1e-8)


def test_theta_is_zero_out_of_the_plane_and_a_quarter_turn_in_it() -> None:
    axis = ArmAxis(HAND, ELBOW, SHOULDER)
    zero = np.cross(ELBOW - HAND, SHOULDER - ELBOW)
    zero /= np.linalg.norm(zero)
    foot = axis.G(0.3)
    quarter = np.cross(axis.D(0.3), zero)
    for angle in (0.0, 0.5 * np.pi, -0.5 * np.pi, 2.0):
        point = foot + 0.05 * (np.cos(angle) * zero + np.sin(angle) * quarter)
        assert axis.coordinates(point).theta == pytest.approx(angle, abs=1e-9)


def test_progress_rests_at_zero_beyond_the_hand_and_the_distance_past_it_is_told() -> None:
    axis = ArmAxis(HAND, ELBOW, SHOULDER)
    aside = np.cross(axis.D(0.0), [0.0, 0.0, 1.0])
    for gap in (0.01, 0.2):
        point = HAND - gap * axis.D(0.0) + 0.05 * aside
        assert axis.coordinates(point).s == 0.0
        assert axis.beyond_hand(point) == pytest.approx(gap, abs=1e-12)
    assert axis.beyond_hand(ELBOW) == pytest.approx(-np.linalg.norm(ELBOW - HAND))


@pytest.mark.parametrize("bend", [0.0, 1e-9, 1e-7, 1e-5, 1e-3])
def test_nearly_straight_arm_behaves_like_a_straight_one(bend: float) -> None:
    hand, elbow = np.zeros(3), np.array([0.3, 0.0, 0.0])
    shoulder = elbow + 0.3 * np.array([np.cos(bend), np.sin(bend), 0.0])
    axis = ArmAxis(hand, elbow, shoulder)
    for s in np.linspace(0.0, 2.0, 41):
        np.testing.assert_allclose(axis.G(s), [0.3 * s, 0.0, 0.0], atol=4e-4)
        np.testing.assert_allclose(axis.D(s), [1.0, 0.0, 0.0], atol=2e-3)
        found = axis.coordinates(axis.G(s) + np.array([0.0, 0.0, 0.05]))
        assert found.s == pytest.approx(s, abs=1e-6)
        assert found.l == pytest.approx(0.05, abs=1e-9)
        assert np.isfinite(found.theta)


@laws
@given(seeds, st.booleans())
def test_many_points_are_those_that_are_asked_for_one_by_one(seed: int, straight: bool) -> None:
    hand, elbow, shoulder = random_arm(seed)
    axis = ArmAxis(hand, elbow, 2.0 * elbow - hand if straight else shoulder)
    s = np.linspace(-0.5, 2.5, 61)
    np.testing.assert_allclose(axis.points(s), [axis.G(x) for x in s], atol=1e-14)


def test_arc_has_the_radius_asked_for_as_far_as_the_limbs_allow() -> None:
    hand, elbow, shoulder = np.array([[0.3, 0, 0], [0.0, 0, 0], [0.0, 0.3, 0]])
    for radius in (0.02, 0.1):
        axis = ArmAxis(hand, elbow, shoulder, fillet_radius=radius)
        # a right angle: the middle of the arc is (√2 − 1) radii from the corner
        distance = float(np.linalg.norm(axis.G(1.0) - elbow))
        assert distance == pytest.approx((np.sqrt(2.0) - 1.0) * radius)
    largest = ArmAxis(hand, elbow, shoulder, fillet_radius=5.0)
    distance = float(np.linalg.norm(largest.G(1.0) - elbow))
    assert distance == pytest.approx((np.sqrt(2.0) - 1.0) * 0.9 * 0.3)


def test_unusable_arms_are_told() -> None:
    with pytest.raises(ValueError, match="coincide"):
        ArmAxis(HAND, HAND, SHOULDER)
    with pytest.raises(ValueError, match="folded back"):
        ArmAxis(HAND, ELBOW, HAND)
    with pytest.raises(ValueError, match="not finite"):
        ArmAxis(HAND, ELBOW, np.array([0.0, np.nan, 0.0]))
    with pytest.raises(ValueError, match="fillet_radius is -1"):
        ArmAxis(HAND, ELBOW, SHOULDER, fillet_radius=-1.0)


@pytest.mark.parametrize("seed", range(20))
def test_outward_is_away_from_the_inside_of_the_elbow(seed: int) -> None:
    hand, elbow, shoulder = np.random.default_rng(seed).normal(size=(3, 3))
    axis = ArmAxis(hand, elbow, shoulder)
    u, w = elbow - hand, shoulder - elbow
    way = u / np.linalg.norm(u) - w / np.linalg.norm(w)
    at_elbow = axis.outward(1.0)
    # half of the difference of two unit vectors is as long as the sine of half their angle
    np.testing.assert_allclose(at_elbow, 0.5 * way, atol=1e-9)
    # from the axis, which cuts the corner, outward is where the elbow is
    assert (elbow - axis.G(1.0)) @ at_elbow > 0.0
    sizes = [np.linalg.norm(axis.outward(s)) for s in np.linspace(1.0, 2.0, 50)]
    assert np.all(np.diff(sizes) <= 1e-12)
    for s in (0.0, 0.6, 1.4, 2.0):
        np.testing.assert_allclose(axis.outward(s), 0.0, atol=1e-12)
    straight = ArmAxis(hand, elbow, elbow + 0.7 * u)
    np.testing.assert_array_equal(straight.outward(1.0), 0.0)
