"""Masses follow volumes, and an arm may differ from the other."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.human.measures import (
    FOREARM_MASS,
    UPPER_ARM_MASS,
    ArmMeasures,
    BodyMeasures,
    arm_radius_names,
)
from drake_dress.models.sides import SIDES

TAPERED = BodyMeasures(elbow_radius=0.035, wrist_radius=0.025)


def test_default_person_has_the_default_masses_exactly() -> None:
    assert BodyMeasures().arm_masses == (UPPER_ARM_MASS, FOREARM_MASS)
    assert BodyMeasures().arm_centers == (0.5, 0.5)


@given(st.floats(0.5, 1.5), st.sampled_from([BodyMeasures(), TAPERED]))
def test_masses_grow_with_the_cube_of_all_lengths(scale: float, body: BodyMeasures) -> None:
    given_lengths = {
        f.name: scale * getattr(body, f.name)
        for f in fields(body)
        if getattr(body, f.name) is not None
    }
    grown = BodyMeasures(**given_lengths)
    for mass, before in zip(grown.arm_masses, body.arm_masses, strict=True):
        assert mass == pytest.approx(scale**3 * before)
    assert grown.arm_centers == pytest.approx(body.arm_centers)


def test_given_masses_are_kept_and_thinner_limbs_are_lighter() -> None:
    assert replace(TAPERED, upper_arm_mass=2.0).arm_masses[0] == 2.0
    assert TAPERED.arm_masses[0] < UPPER_ARM_MASS
    assert TAPERED.arm_masses[1] < FOREARM_MASS
    # the volume of a frustum, beside that of the default cylinder
    share = (0.045**2 + 0.045 * 0.035 + 0.035**2) / 3.0 / 0.045**2
    assert TAPERED.arm_masses[0] == pytest.approx(UPPER_ARM_MASS * share)
    # the thicker end is the heavier
    assert all(center < 0.5 for center in TAPERED.arm_centers)


def test_an_arm_may_differ_from_the_other() -> None:
    own = ArmMeasures(forearm_length=0.2, wrist_radius=0.02)
    body = replace(TAPERED, left=own)
    assert body.of("right") == TAPERED
    assert body.of("left") == replace(TAPERED, forearm_length=0.2, wrist_radius=0.02)
    assert body.of("left").arm_masses[1] < body.of("right").arm_masses[1]
    assert body.of("left").arm_masses[0] == body.of("right").arm_masses[0]
    plain = BodyMeasures()
    assert plain.of("left") is plain


def test_joint_radii_are_those_of_the_limbs_there() -> None:
    assert BodyMeasures().joint_radii == (0.045, 0.038, 0.040)
    assert replace(TAPERED, elbow_radius=0.041).joint_radii == (0.045, 0.041, 0.040)


@given(st.floats(-0.05, 0.05))
def test_thicker_arms_weigh_the_same(added: float) -> None:
    body = replace(TAPERED, right=ArmMeasures(elbow_radius=0.03))
    thick = body.thickened(added)
    for side in SIDES:
        before, after = body.of(side), thick.of(side)
        assert after.arm_masses == before.arm_masses
        for name in arm_radius_names(before):
            expected = max(getattr(before, name) + added, 0.005)
            assert getattr(after, name) == pytest.approx(expected)
    assert thick.chest_width == body.chest_width


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"knee_radius": 0.0}, "person: knee_radius: is 0.0, expected a positive number of m"),
        ({"upper_arm_mass": -1.0}, "person: upper_arm_mass: is -1.0, expected .* kg"),
        ({"shoulder_width": None}, "person: shoulder_width: is None"),
        ({"torso_length": 1.2}, "person: torso_length: is 1.2 m, expected less than"),
    ],
)
def test_impossible_sizes_are_told(change: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        BodyMeasures(**change)


def test_impossible_sizes_of_an_arm_are_told() -> None:
    with pytest.raises(UserError, match="person: wrist_radius: is 'thin', expected a positive"):
        ArmMeasures(wrist_radius="thin")  # type: ignore[arg-type]
