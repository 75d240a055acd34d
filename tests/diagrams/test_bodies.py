"""Scenarios of persons of other sizes: girths, arms that differ, masses and joint limits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.diagrams.person import person_arms
from drake_dress.diagrams.scenario import (
    Scenario,
    apply_variation,
    checked_scenario,
    load_scenario,
    resolved_yaml,
)
from drake_dress.diagrams.scenario.schema import Measures, SideMeasures, Variation
from drake_dress.diagrams.sections.person import arm, arms, chair, joints, measures
from drake_dress.errors import UserError
from drake_dress.models.human.body import BodyMeasures, body_capsules
from drake_dress.models.human.girths import girth_of
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.wheelchair import room_of_arms
from drake_dress.models.sides import SIDES
from drake_dress.shipped import shipped_scenario

# Bodies as a parametric model of skin gives them, m.
SMALL = (
    "{shoulder_height: 1.119, shoulder_width: 0.293, upper_arm_length: 0.221, "
    "forearm_length: 0.225, upper_arm_radius: 0.0363, forearm_radius: 0.0289, "
    "hand_radius: 0.0456, chest_width: 0.248, chest_depth: 0.172, torso_length: 0.458, "
    "hip_width: 0.305, neck_radius: 0.0461, leg_length: 0.721, thigh_radius: 0.0836}"
)
HEAVY = (
    "{shoulder_height: 1.527, shoulder_width: 0.404, upper_arm_length: 0.293, "
    "forearm_length: 0.339, upper_arm_radius: 0.0561, forearm_radius: 0.0398, "
    "hand_radius: 0.0487, chest_width: 0.193, chest_depth: 0.245, torso_length: 0.569, "
    "hip_width: 0.395, neck_radius: 0.0719, leg_length: 1.019, thigh_radius: 0.0976}"
)


def loaded(folder: Path, person: str) -> Scenario:
    path = folder / "scenario.yaml"
    path.write_text(f"person: {person}\n")
    return load_scenario(path)


def test_girths_stand_for_radii_and_sections(tmp_path: Path) -> None:
    body = measures(
        loaded(
            tmp_path,
            "{measures: {upper_arm_girth: 0.30, wrist_girth: 0.16, chest_girth: 0.95, "
            "waist_girth: 0.80, waist_depth: 0.2, neck_length: 0.1}, "
            "left_measures: {forearm_girth: 0.2}}",
        ).person
    )
    assert 2.0 * np.pi * body.upper_arm_radius == pytest.approx(0.30)
    assert 2.0 * np.pi * body.of("right").forearm_radii[1] == pytest.approx(0.16)
    assert 2.0 * np.pi * body.of("left").forearm_radius == pytest.approx(0.2)
    assert body.of("right").forearm_radius == BodyMeasures.forearm_radius
    assert girth_of(body.chest_width, body.chest_depth) == pytest.approx(0.95)
    assert body.waist_width is not None
    assert body.waist_depth == 0.2
    assert girth_of(body.waist_width, 0.2) == pytest.approx(0.80)


def test_girths_set_in_python_replace_default_radii() -> None:
    scenario = Scenario()
    scenario.person.measures = Measures(upper_arm_girth=0.3)
    scenario.person.right_measures = SideMeasures(hand_girth=0.2)
    checked = checked_scenario(scenario)
    assert checked.person.measures.upper_arm_radius == pytest.approx(0.3 / (2.0 * np.pi))
    assert checked.person.measures.upper_arm_girth is None
    assert checked_scenario(checked) == checked
    scenario.person.measures = Measures(upper_arm_girth=0.3, upper_arm_radius=0.05)
    with pytest.raises(UserError, match="upper_arm_girth: is given beside upper_arm_radius"):
        checked_scenario(scenario)


@pytest.mark.parametrize(
    ("person", "words"),
    [
        (
            "{measures: {upper_arm_girth: 0.3, upper_arm_radius: 0.045}}",
            ["person.measures.upper_arm_girth", "upper_arm_radius, 0.045", "one of both"],
        ),
        (
            "{right_measures: {wrist_girth: 0.15, wrist_radius: 0.02}}",
            ["person.right_measures.wrist_girth", "wrist_radius"],
        ),
        ("{measures: {chest_girth: 0.9, chest_width: 0.3}}", ["chest_girth", "chest_width, 0.3"]),
        (
            "{measures: {chest_girth: 0.45, chest_depth: 0.25}}",
            ["chest_girth", "more than twice"],
        ),
        ("{measures: {waist_girth: 9}}", ["person.measures.waist_girth", "0.35 to 2.2"]),
        ("{measures: {upper_arm_girth: 0.0}}", ["upper_arm_girth", "is 0.0, expected 0.0942"]),
        ("{measures: {chest_width: 0.0}}", ["person.measures.chest_width", "is 0.0, expected"]),
        ("{left_measures: {chest_girth: 1.0}}", ["left_measures.chest_girth", "unknown key"]),
        ("{left_measures: {forearm_length: 3}}", ["left_measures.forearm_length", "0.1 to 0.55"]),
        ("{joints: {elbow_limits_deg: [5]}}", ["person.joints.elbow_limits_deg", "smallest"]),
        ("{joints: {elbow_limits_deg: [9, 5]}}", ["person.joints.elbow_limits_deg", "largest"]),
        ("{joints: {elbow_limits_deg: [0, 500]}}", ["elbow_limits_deg[1]", "-180 to 180"]),
        ("{left_joints: {elbow_limits_deg: [9, 5]}}", ["person.left_joints.elbow", "largest"]),
        ("{right_joints: {tone: 1.5}}", ["person.right_joints.tone", "0 to 1"]),
        (
            "{right_joints: {tone: 0}, behaviour: {kind: active, motions: [{withdraw: {}}]}}",
            ["person.behaviour.motions[0].withdraw.side", "both", "right arm is paralysed"],
        ),
        ("{behaviour: {spasm: {side: middle}}}", ["person.behaviour.spasm.side", "left"]),
        ("{behaviour: {spasm: {interval: 2.0}}}", ["person.behaviour.spasm.interval", "4.7"]),
    ],
)
def test_unusable_sizes_and_limits_are_told_by_key(
    tmp_path: Path, person: str, words: list[str]
) -> None:
    with pytest.raises(UserError) as told:
        loaded(tmp_path, person)
    assert "\n" not in str(told.value)
    for word in words:
        assert word in str(told.value)


def test_limits_in_degrees_are_those_of_the_joints(tmp_path: Path) -> None:
    limits = "elbow_limits_deg: [0, 90], abduction_limits_deg: [-10, 80]"
    person = loaded(tmp_path, f"{{joints: {{{limits}}}}}").person
    found = joints(person)
    assert found.elbow_limits == pytest.approx((0.0, 0.5 * np.pi))
    assert found.abduction_limits == pytest.approx(np.deg2rad((-10.0, 80.0)))
    assert found.rotation_limits == JointParameters.rotation_limits
    both = person_arms(BodyMeasures(), "standing", arms(person), found)
    np.testing.assert_allclose(both.limits[:, 1, 3], 0.5 * np.pi)
    assert joints(Scenario().person) == JointParameters()


def test_an_arm_has_its_own_joints_and_sags_without_tone(tmp_path: Path) -> None:
    own = "{tone: 0.0, elbow_stiffness: 1.0, elbow_limits_deg: [5, 60]}"
    text = f"{{joints: {{elbow_stiffness: 9.0, elbow_damping: 2.0}}, right_joints: {own}}}"
    person = loaded(tmp_path, text).person
    found = joints(person)
    assert found.of("left").elbow_stiffness == 9.0
    assert found.of("right").elbow_stiffness == 1.0
    assert found.of("right").elbow_damping == 2.0
    assert found.of("right").elbow_limits == pytest.approx(np.deg2rad((5.0, 60.0)))
    left, right = arms(person)["left"], arms(person)["right"]
    assert left == arm(person.left_arm)
    # default pose: back by 46 degrees
    assert 0.1 < right.extension < np.deg2rad(40.0)
    # loads again as it is, although the pose that is given is not the one in which it rests
    assert arms(checked_scenario(loaded(tmp_path, text)).person) == arms(person)


@pytest.mark.parametrize("sizes", [SMALL, HEAVY])
def test_bodies_of_a_model_of_skin_can_be_dressed(tmp_path: Path, sizes: str) -> None:
    body = measures(loaded(tmp_path, f"{{measures: {sizes}}}").person)
    assert len(body_capsules(body, "sitting")) == len(body_capsules(BodyMeasures(), "sitting"))
    upper, fore = body.arm_masses
    # Winter: 2.8 and 2.2 % of the body's weight, of 38 and 90 kg
    weight = 38.0 if sizes is SMALL else 90.0
    assert 0.5 < upper / (0.028 * weight) < 2.0
    assert 0.5 < fore / (0.022 * weight) < 2.0


@given(st.integers(0, 2**32), st.floats(0.01, 0.1), st.floats(0.001, 0.03))
@settings(max_examples=20)
def test_variation_scales_an_arm_that_differs_as_the_other(
    seed: int, scale: float, own: float
) -> None:
    scenario = Scenario(seed=seed, variation=Variation(person_scale=scale, person_measures=own))
    scenario.person.measures = Measures(elbow_radius=0.04)
    scenario.person.left_measures = SideMeasures(upper_arm_length=0.2, wrist_radius=0.02)
    plain = Scenario(seed=seed, variation=scenario.variation)
    drawn, other = apply_variation(scenario).person, apply_variation(plain).person
    ratio: dict[str, Any] = {
        name: getattr(other.measures, name) / getattr(BodyMeasures, name)
        for name in ("shoulder_height", "upper_arm_length", "forearm_length", "thigh_radius")
    }
    # what was there before is drawn as before
    for name, factor in ratio.items():
        assert getattr(drawn.measures, name) == pytest.approx(
            factor * getattr(BodyMeasures, name), rel=1e-12
        )
    left = drawn.left_measures
    assert left.upper_arm_length == pytest.approx(0.2 * ratio["upper_arm_length"])
    bound = (1.0 + scale) * (1.0 + own)
    assert 0.02 / bound**2 <= left.wrist_radius <= 0.02 * bound
    before, after = measures(scenario.person), measures(drawn)
    for side in SIDES:
        for old, new in zip(before.of(side).arm_masses, after.of(side).arm_masses, strict=True):
            assert 1.0 / bound**6 <= new / old <= bound**3
    assert measures(checked_scenario(apply_variation(scenario)).person) == after


def test_resolved_scenario_keeps_bodies(tmp_path: Path) -> None:
    scenario = loaded(
        tmp_path,
        "{measures: {hip_girth: 1.0, knee_radius: 0.06}, right_measures: {hand_girth: 0.2}, "
        "joints: {rotation_limits_deg: [-30, 60]}}",
    )
    again = tmp_path / "again.yaml"
    again.write_text(resolved_yaml(scenario))
    assert load_scenario(again) == scenario


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 99))
def test_a_drawn_arm_is_outside_of_the_wheelchair(seed: int) -> None:
    scenario = load_scenario(shipped_scenario("wheelchair"), seed=seed)
    scenario.variation = Variation(
        arm_angle_deg=12.0, person_scale=0.05, person_measures=0.03, start_offset=0.03
    )
    drawn = apply_variation(scenario).person
    seat = chair(drawn)
    assert seat is not None
    assert min(room_of_arms(seat, measures(drawn), arms(drawn)).values()) >= 0.005
    scenario.person.chair = None
    free = apply_variation(scenario).person
    for led, pose in ((drawn.left_arm, free.left_arm), (drawn.right_arm, free.right_arm)):
        # led outward only, and only where the chair is
        assert led.abduction_deg >= pose.abduction_deg
        assert (led.extension_deg, led.elbow_deg) == (pose.extension_deg, pose.elbow_deg)


def test_without_variation_no_arm_is_led_anywhere() -> None:
    scenario = load_scenario(shipped_scenario("wheelchair"))
    assert apply_variation(scenario).person.left_arm == scenario.person.left_arm
