from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.phenotype import DENSITY, Phenotype, phenotype_skin
from drake_dress.models.sides import SIDES
from tests.models.human.skin.bodies import BOY, MAN, OLD_WOMAN, PERSONS, WOMAN, skin_of

OTHERS = (
    Phenotype("female", 55, 1.50, 42),
    Phenotype("male", 25, 1.98, 110),
    Phenotype(0.5, 40, 1.70, 70, muscle=0.7, proportions=0.2),
    Phenotype("female", 4, 1.02, 16.5),
    Phenotype("female", 60, 1.60, 105),
)


@pytest.mark.parametrize("person", [*PERSONS, *OTHERS])
def test_height_and_weight_are_reached(person: Phenotype) -> None:
    skin = skin_of(person)
    assert skin.stature == pytest.approx(person.height, abs=1e-3)
    assert DENSITY * skin.volume == pytest.approx(person.weight, abs=0.1)


@pytest.mark.parametrize("person", PERSONS)
def test_body_is_symmetric(person: Phenotype) -> None:
    skin = skin_of(person)
    mirrored = skin.vertices * [1.0, -1.0, 1.0]

    def rows(points: np.ndarray) -> np.ndarray:
        rounded = np.round(points, 9) + 0.0
        return rounded[np.lexsort(rounded.T)]

    assert np.array_equal(rows(skin.vertices), rows(mirrored))
    for name, place in skin.joints.items():
        if name.startswith("left_"):
            other = skin.joints[name.replace("left_", "right_")]
            assert place == pytest.approx(other * [1.0, -1.0, 1.0], abs=1e-12)


@pytest.mark.parametrize("person", PERSONS)
def test_origin_is_on_the_floor_below_the_shoulders(person: Phenotype) -> None:
    skin = skin_of(person)
    middle = np.mean([skin.joints[f"{side}_shoulder"] for side in SIDES], axis=0)
    assert middle[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert skin.vertices[:, 2].min() == 0.0
    # the person faces +x, with the left at +y
    assert skin.joints["left_shoulder"][1] > 0.1
    toes = skin.vertices[skin.vertices[:, 2] < 0.02][:, 0].max()
    assert toes > skin.joints["left_ankle"][0] + 0.05


@pytest.mark.parametrize("person", [MAN, OLD_WOMAN, BOY])
def test_taller_people_have_longer_limbs(person: Phenotype) -> None:
    # of the same body mass index
    taller = replace(person, height=1.05 * person.height, weight=1.05**2 * person.weight)
    for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee")):
        lengths = [
            np.linalg.norm(s.joints[f"left_{end}"] - s.joints[f"left_{start}"])
            for s in (skin_of(person), skin_of(taller))
        ]
        assert lengths[1] > 1.02 * lengths[0]


def test_sexes_differ_and_meet_in_the_middle() -> None:
    same = {"age": 30.0, "height": 1.70, "weight": 70.0}
    man, woman, between = (
        skin_of(Phenotype(sex, **same)).joints["left_shoulder"][1]
        for sex in ("male", "female", 0.5)
    )
    assert man > between > woman
    words, number = (skin_of(Phenotype(sex, **same)).vertices for sex in ("female", 1.0))
    assert np.array_equal(words, number)


BAD: list[tuple[dict[str, Any], str]] = [
    ({"height": 1.1}, "height: is 1.1 m, expected 1.2"),
    ({"weight": 30.0}, "weight: is 30 kg, expected 3"),
    ({"weight": 180.0}, "at this sex, age, height and muscle"),
    ({"age": 2.0}, "4 to 100 years"),
    ({"age": float("nan")}, "4 to 100 years"),
    ({"height": True}, "0.8 to 2.3 m"),
    ({"sex": "man"}, "expected female, male or 0 to 1"),
    ({"sex": 2}, "from 0 to 1"),
    ({"muscle": 1.5}, "from 0 to 1"),
]


@pytest.mark.parametrize(("changes", "message"), BAD)
def test_what_no_body_has_is_told(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        phenotype_skin(replace(WOMAN, **changes))


def test_any_person_has_a_body_or_is_told_why_not() -> None:
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(60):
        height, index = rng.uniform(0.85, 2.25), rng.uniform(12.0, 50.0)
        person = Phenotype(
            rng.choice([0.0, 0.3, 1.0]),
            rng.uniform(4.0, 100.0),
            height,
            index * height**2,
            muscle=rng.choice([0.0, 0.4, 1.0]),
        )
        try:
            skin = phenotype_skin(person)
        except UserError as error:
            assert error.key in ("height", "weight")
            continue
        found += 1
        assert skin.stature == pytest.approx(height, abs=1e-3)
        assert DENSITY * skin.volume == pytest.approx(person.weight, abs=0.1)
        assert body_measures(skin_measures(skin)).shoulder_height < height
    assert found > 10


def test_told_limits_of_the_weight_are_reached() -> None:
    with pytest.raises(UserError) as caught:
        phenotype_skin(replace(WOMAN, weight=390.0))
    low, high = (float(x) for x in caught.value.message.split("expected ")[1].split()[:3:2])
    for weight in (low + 0.1, high - 0.1):
        skin = phenotype_skin(replace(WOMAN, weight=weight))
        assert DENSITY * skin.volume == pytest.approx(weight, abs=0.1)
