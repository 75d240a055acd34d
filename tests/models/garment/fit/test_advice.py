"""The size that is advised suits, and a size that suits is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.fit.advice import size_advice
from drake_dress.models.garment.fit.girths import PersonGirths, person_girths
from drake_dress.models.garment.fit.judge import Fit, judge
from drake_dress.models.garment.fit.sizes import garment_sizes
from drake_dress.models.human.body import BodyMeasures
from tests.closed_coat import closed_coat
from tests.present import present

PERSON = person_girths(BodyMeasures())
COAT = make_coat(
    replace(COATS["jacket"], chest=1.28, shoulder_width=0.52, armhole_girth=0.6, cuff_girth=0.36),
    0.05,
)
SIZES = garment_sizes(COAT)


def verdict(factor: float, person: PersonGirths = PERSON) -> Fit:
    return judge(garment_sizes(COAT.scaled(factor)), person)


def test_a_size_that_suits_is_kept() -> None:
    advice = size_advice(verdict(1.0))
    assert advice.scale == 1.0
    assert advice.least < 1.0
    assert advice.measures == {}


@pytest.mark.parametrize("factor", [0.2, 0.5, 0.65])
def test_the_advised_scale_suits_and_a_little_less_than_the_least_does_not(factor: float) -> None:
    advice = size_advice(verdict(factor))
    scale = present(advice.scale)
    assert scale > 1.0
    assert verdict(factor * scale).reasons == ()
    assert verdict(factor * advice.least * 1.001).reasons == ()
    assert verdict(factor * advice.least * 0.999).reasons


def test_the_limits_do_not_depend_on_the_size_that_they_are_told_at() -> None:
    least = [factor * size_advice(verdict(factor)).least for factor in (0.4, 1.0, 1.6)]
    assert np.allclose(least, least[0])


def test_measures_that_are_too_small_are_told_with_what_suits() -> None:
    loops = tuple(
        replace(loop, girth=0.2) if loop.name == "left_cuff" else loop for loop in SIZES.loops
    )
    advice = size_advice(judge(replace(SIZES, loops=loops), PERSON))
    assert list(advice.measures) == ["cuff_girth"]
    wanted = advice.measures["cuff_girth"]
    loops = tuple(
        replace(loop, girth=wanted) if loop.name == "left_cuff" else loop for loop in SIZES.loops
    )
    assert judge(replace(SIZES, loops=loops), PERSON).fits is True


def test_no_size_of_a_closed_front_or_of_a_garment_without_sleeves_suits() -> None:
    closed = size_advice(judge(garment_sizes(closed_coat(COAT)), PERSON))
    assert closed.scale is None
    bare = replace(SIZES, sleeve_length={"left": 0.01, "right": 0.01})
    assert size_advice(judge(bare, PERSON)).scale is None
