"""Bodies have the sizes that were measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.human.body import (
    ArmMeasures,
    ArmPose,
    BodyMeasures,
    Capsule,
    Posture,
    arm_points,
    body_capsules,
    capsule_arrays,
    posed_capsules,
)
from drake_dress.models.human.shape import CHAIR, met_by_mesh
from drake_dress.models.sides import SIDES, Side

M = BodyMeasures()
SHAPED = BodyMeasures(
    elbow_radius=0.038,
    wrist_radius=0.028,
    knee_radius=0.055,
    ankle_radius=0.04,
    neck_base_radius=0.07,
    neck_length=0.10,
    waist_width=0.28,
    waist_depth=0.19,
    hip_width=0.36,
    hip_depth=0.23,
)
POSTURES: tuple[Posture, Posture] = ("standing", "sitting")


def torso(m: BodyMeasures, posture: Posture = "standing") -> list[Capsule]:
    return [c for c in body_capsules(m, posture) if c.body == "torso"]


def extent(m: BodyMeasures, z: float) -> tuple[float, float]:
    """Returns width and depth of the trunk without head, arms and legs at a height, m."""
    first = next(k for k, c in enumerate(torso(m)) if c.a_B[1] == -0.5 * m.shoulder_width)
    trunk = Obstacles.resting(*capsule_arrays(torso(m)[:first]))
    found = []
    for axis in (1, 0):
        low, high = 0.0, 1.0
        x = np.array([[0.0, 0.0, z]])
        for _ in range(40):
            x[0, axis] = 0.5 * (low + high)
            inside = find_proximity(x, trunk, 0.0).gap[0] < 0.0
            low, high = (x[0, axis], high) if inside else (low, x[0, axis])
        found.append(2.0 * high)
    return found[0], found[1]


@given(st.tuples(*[st.floats(0.15, 0.45)] * 6), st.floats(0.45, 0.6))
def test_trunk_has_at_least_the_measured_sections(sizes: tuple[float, ...], length: float) -> None:
    chest_w, chest_d, waist_w, waist_d, hip_w, hip_d = sizes
    m = replace(
        SHAPED,
        torso_length=length,
        chest_width=chest_w,
        chest_depth=chest_d,
        waist_width=waist_w,
        waist_depth=waist_d,
        hip_width=hip_w,
        hip_depth=hip_d,
    )
    top = m.shoulder_height
    upper = top - 0.5 * min(chest_w, chest_d) - 0.02
    heights = (min(top - 0.35 * length, upper), top - 0.62 * length, top - 0.92 * length)
    for z, width, depth in zip(heights, sizes[::2], sizes[1::2], strict=True):
        # wider parts above and below may reach into a section
        found = extent(m, z)
        assert found[0] >= width - 1e-9
        assert found[1] >= depth - 1e-9
    width, depth = extent(m, upper)
    assert (width, depth) >= (chest_w - 1e-9, chest_d - 1e-9)


def test_sections_of_usual_bodies_are_as_measured_within_a_centimetre() -> None:
    top, length = SHAPED.shoulder_height, SHAPED.torso_length
    for share, name in ((0.35, "chest"), (0.62, "waist"), (0.92, "hip")):
        width, depth = extent(SHAPED, top - share * length)
        assert width == pytest.approx(getattr(SHAPED, f"{name}_width"), abs=0.01)
        assert depth == pytest.approx(getattr(SHAPED, f"{name}_depth"), abs=0.01)


def test_chest_may_be_deeper_than_wide() -> None:
    deep = replace(M, chest_width=0.19, chest_depth=0.245)
    width, depth = extent(deep, deep.shoulder_height - 0.2)
    assert width == pytest.approx(0.19)
    assert depth == pytest.approx(0.245)


@pytest.mark.parametrize("posture", POSTURES)
def test_shaped_person_stands_on_the_floor(posture: Posture) -> None:
    lowest = min(min(c.a_B[2] - c.radii[0], c.b_B[2] - c.radii[1]) for c in torso(SHAPED, posture))
    assert 0.0 <= lowest < 0.01


@pytest.mark.parametrize("posture", POSTURES)
def test_legs_taper_to_knee_and_ankle(posture: Posture) -> None:
    below = [c for c in torso(SHAPED, posture) if c.b_B[2] == SHAPED.ankle_radius]
    above = [c for c in torso(SHAPED, posture) if c.radii == (SHAPED.thigh_radius, 0.055)]
    assert len(below) == len(above) == 2
    for thigh, shank in zip(above, below, strict=True):
        np.testing.assert_array_equal(thigh.b_B, shank.a_B)
        assert shank.radii == (0.055, 0.04)


def test_arms_taper_from_joint_to_joint() -> None:
    for side in SIDES:
        upper, fore, hand = (c for c in body_capsules(SHAPED, "sitting") if c.body.startswith(side))
        assert upper.radii == (SHAPED.upper_arm_radius, 0.038)
        assert fore.radii == (SHAPED.forearm_radius, 0.028)
        assert hand.radii == (SHAPED.hand_radius, SHAPED.hand_radius)


def test_person_without_new_sizes_is_all_capsules() -> None:
    for posture in POSTURES:
        radii = capsule_arrays(body_capsules(M, posture))[2]
        np.testing.assert_array_equal(radii[:, 0], radii[:, 1])


def test_one_arm_alone_is_shorter_and_thinner() -> None:
    own = ArmMeasures(upper_arm_length=0.2, upper_arm_radius=0.03, hand_radius=0.03)
    changed = body_capsules(replace(SHAPED, right=own), "standing")
    for before, after in zip(body_capsules(SHAPED, "standing"), changed, strict=True):
        same = before.radii == after.radii and np.array_equal(before.b_B, after.b_B)
        girdle = before.body == "torso" and before.a_B[1] == -0.18 and before.b_B[1] == 0.18
        hand = np.array_equal(before.a_B, before.b_B)
        upper = before.body == "right_upper_arm"
        assert same == (not (girdle or upper or (hand and before.body == "right_forearm")))
        if girdle:
            # the shoulder girdle is as thick as each arm at its end
            assert after.radii == (0.03, SHAPED.upper_arm_radius)


@given(st.integers(0, 2**31))
def test_posed_limbs_lie_between_the_joints(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arms: dict[Side, ArmPose] = {side: ArmPose(*rng.uniform(-1.0, 1.0, 4)) for side in SIDES}
    body = replace(SHAPED, left=ArmMeasures(forearm_length=0.25))
    a, b, radius = posed_capsules(body, "standing", arms)
    capsules = body_capsules(body, "standing")
    for side in SIDES:
        joints = arm_points(body, "standing", side, arms[side])
        rows = [k for k, c in enumerate(capsules) if c.body.startswith(side)]
        np.testing.assert_allclose(a[rows], joints, atol=1e-12)
        np.testing.assert_allclose(b[rows], joints[[1, 2, 2]], atol=1e-12)
    still = [k for k, c in enumerate(capsules) if c.body == "torso"]
    np.testing.assert_array_equal(a[still], [capsules[k].a_B for k in still])
    np.testing.assert_array_equal(radius, capsule_arrays(capsules)[2])


@given(
    spacing=st.floats(0.005, 0.06),
    radius=st.floats(0.01, 0.06),
    angles=st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3),
    seed=st.integers(0, 1000),
)
def test_a_taut_triangle_cuts_a_chair_by_at_most_its_depth(
    spacing: float, radius: float, angles: list[float], seed: int
) -> None:
    tube = Capsule("torso", np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), radius)
    chair, limb = met_by_mesh([replace(tube, part=CHAIR), tube], spacing)
    assert limb is tube
    assert chair.radius >= radius
    # nodes of a triangle with the circumradius of an equilateral one, as near as they may be
    draw = np.random.default_rng(seed)
    across = spacing / np.sqrt(3.0) * np.exp(2j * np.pi * (np.arange(3) / 3.0 + angles[0]))
    turn = Rotation.random(random_state=draw)
    corners = turn.apply(np.stack([across.real, across.imag, np.zeros(3)], axis=1))
    for height in np.linspace(-2.0, 2.0, 401) * (radius + spacing):
        placed = corners + [0.0, 0.0, height]
        if (np.hypot(placed[:, 1], placed[:, 2]) >= chair.radius).all():
            middle = placed.mean(axis=0)
            assert radius - np.hypot(middle[1], middle[2]) <= 3e-3 + 1e-9
