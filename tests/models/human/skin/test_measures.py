"""Measures of the parametric body beside published ones.

ANSUR II: Gordon and others 2014, Anthropometric Survey of U.S. Army Personnel, Natick/TR-15/007;
means of 4082 men and 1986 women, of whom the ages' mean is 30. Its acromia are outside of the
shoulder joints and above them, and its upper arm and forearm are flexed.
"""

from collections.abc import Callable
from dataclasses import astuple, replace
from functools import lru_cache

import numpy as np
import pytest

from drake_dress.models.human.body import body_capsules
from drake_dress.models.human.shape import capsule_arrays
from drake_dress.models.human.skin.arm_girths import arm_girths
from drake_dress.models.human.skin.measures import (
    MEASURED,
    SkinMeasures,
    body_measures,
    body_values,
    skin_measures,
)
from drake_dress.models.human.skin.phenotype import DENSITY, Phenotype
from tests.models.human.skin.bodies import BOY, MAN, OLD_WOMAN, PERSONS, WOMAN, skin_of

TURN = 2.0 * np.pi


@lru_cache
def measures_of(person: Phenotype) -> SkinMeasures:
    return skin_measures(skin_of(person))


# What is measured, the means of men and women in m, and how far the body may be from them.
ANSUR: dict[str, tuple[Callable[[SkinMeasures], float], float, float, float]] = {
    "chest": (lambda m: m.trunk.chest[0], 1.059, 0.947, 0.05),
    "waist": (lambda m: m.trunk.waist[0], 0.941, 0.861, 0.08),
    "hips": (lambda m: m.trunk.hips[0], 1.021, 1.021, 0.10),
    "neck": (lambda m: TURN * m.trunk.neck, 0.397, 0.330, 0.06),
    "head": (lambda m: TURN * m.trunk.head, 0.574, 0.561, 0.08),
    "upper arm": (lambda m: TURN * m.arm.upper_arm, 0.358, 0.306, 0.05),
    "forearm": (lambda m: TURN * m.arm.forearm, 0.310, 0.264, 0.15),
    "wrist": (lambda m: TURN * m.arm.wrist, 0.176, 0.155, 0.12),
    "hand": (lambda m: TURN * m.arm.palm, 0.212, 0.187, 0.09),
    "calf": (lambda m: TURN * m.trunk.calf, 0.392, 0.374, 0.08),
    "ankle": (lambda m: TURN * m.trunk.ankle, 0.229, 0.216, 0.14),
    "crotch height": (lambda m: m.trunk.crotch_height, 0.846, 0.782, 0.05),
    "elbow to wrist": (lambda m: m.lower_arm_length, 0.268, 0.241, 0.14),
}


@pytest.mark.parametrize("name", ANSUR)
def test_means_of_a_survey_are_met(name: str) -> None:
    measure, man, woman, tolerance = ANSUR[name]
    assert measure(measures_of(MAN)) == pytest.approx(man, rel=tolerance)
    assert measure(measures_of(WOMAN)) == pytest.approx(woman, rel=tolerance)


def test_shoulder_joints_are_below_and_within_the_acromia() -> None:
    for person, height, width in ((MAN, 1.440, 0.415), (WOMAN, 1.335, 0.365)):
        measures = measures_of(person)
        assert 0.02 < height - measures.shoulder_height < 0.06
        assert 0.02 < width - measures.shoulder_width < 0.06


@pytest.mark.parametrize("person", PERSONS)
def test_both_arms_have_the_same_girths(person: Phenotype) -> None:
    left, right = (arm_girths(skin_of(person), side) for side in ("left", "right"))
    assert astuple(left) == pytest.approx(astuple(right), rel=1e-6)


@pytest.mark.parametrize("person", PERSONS)
def test_arms_taper_and_the_thumb_widens_the_hand(person: Phenotype) -> None:
    arm = measures_of(person).arm
    assert arm.shoulder > arm.upper_arm > arm.elbow > arm.wrist
    assert arm.forearm > arm.wrist
    assert 1.02 * arm.palm < arm.hand < 1.2 * arm.palm


@pytest.mark.parametrize("person", [MAN, WOMAN])
def test_arms_have_their_share_of_the_mass(person: Phenotype) -> None:
    arm = measures_of(person).arm
    # de Leva 1996: upper arm 2.6, forearm and hand 2.1 to 2.2 % of the mass
    assert DENSITY * arm.upper_arm_volume / person.weight == pytest.approx(0.0265, abs=0.005)
    assert DENSITY * arm.forearm_volume / person.weight == pytest.approx(0.021, abs=0.006)


def test_heavier_people_have_greater_girths() -> None:
    heavier = measures_of(replace(WOMAN, weight=90))
    lighter = measures_of(replace(WOMAN, weight=50))
    for name in ("upper_arm", "elbow", "forearm", "wrist"):
        assert getattr(heavier.arm, name) > getattr(lighter.arm, name)
    for name in ("chest", "waist", "hips"):
        assert getattr(heavier.trunk, name)[0] > getattr(lighter.trunk, name)[0]


@pytest.mark.parametrize("person", [*PERSONS, replace(WOMAN, weight=105), replace(MAN, height=2.0)])
def test_person_of_capsules_stands_on_the_floor(person: Phenotype) -> None:
    body = body_measures(measures_of(person))
    for posture in ("standing", "sitting"):
        torso = [c for c in body_capsules(body, posture) if c.body == "torso"]
        a, b, radii = capsule_arrays(torso)
        heights = np.stack([a[:, 2], b[:, 2]], axis=1)
        lowest = (heights - radii).min()
        assert lowest == pytest.approx(0.0, abs=0.04)
        if posture == "standing":
            top = (heights + radii).max()
            assert top == pytest.approx(person.height, abs=0.08)


def test_every_size_of_the_person_is_measured() -> None:
    man, boy = (body_measures(measures_of(p)) for p in (MAN, BOY))
    assert set(body_values(measures_of(MAN))) == set(MEASURED)
    for name in MEASURED:
        assert getattr(man, name) > getattr(boy, name), name
    assert measures_of(OLD_WOMAN).stature == pytest.approx(OLD_WOMAN.height, abs=1e-3)
