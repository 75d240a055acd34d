"""Verdicts: what is large enough fits, what is smaller than a limb cannot go on, and size alone
decides nothing: garment and person of twice the size get the same verdict."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest

from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.fit.girths import PersonGirths, person_girths
from drake_dress.models.garment.fit.judge import (
    ARMHOLE,
    ARMHOLE_AT_EDGES,
    BACK,
    CUFF,
    Fit,
    Limits,
    judge,
)
from drake_dress.models.garment.fit.sizes import GarmentSizes, garment_sizes
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.sides import SIDES
from tests.closed_coat import closed_coat

PERSON = person_girths(BodyMeasures())
# The coat of scenarios/dummy_standing.yaml.
SHIPPED = replace(
    COATS["jacket"],
    body_length=0.70,
    chest=1.28,
    shoulder_width=0.52,
    armhole_girth=0.60,
    cuff_girth=0.36,
    front_opening=0.34,
)
COAT = make_coat(SHIPPED, 0.05)
SIZES = garment_sizes(COAT)


def fit_of(mesh: GarmentMesh, person: PersonGirths = PERSON) -> Fit:
    return judge(garment_sizes(mesh), person)


def with_girths(sizes: GarmentSizes, **girths: float) -> GarmentSizes:
    """Returns measures with other girths of loops."""
    loops = tuple(replace(loop, girth=girths.get(loop.name, loop.girth)) for loop in sizes.loops)
    return replace(sizes, loops=loops)


def states(fit: Fit) -> dict[str, str]:
    return {row.name: row.state for row in fit.comparisons}


def test_the_shipped_coat_fits() -> None:
    fit = fit_of(COAT)
    assert fit.fits is True
    assert fit.reasons == ()
    assert set(states(fit).values()) == {"", "fits"}


def test_a_coat_of_half_the_size_cannot_go_on() -> None:
    fit = fit_of(COAT.scaled(0.5))
    assert fit.fits is False
    assert {finding.measure for finding in fit.impossible} >= {"cuff_girth"}
    assert any("cuff" in finding.text and "hand" in finding.text for finding in fit.impossible)


@pytest.mark.parametrize("factor", [0.4, 0.9, 2.0])
def test_garment_and_person_of_another_size_get_the_same_verdict(factor: float) -> None:
    larger = PersonGirths(
        **{entry.name: factor * getattr(PERSON, entry.name) for entry in fields(PERSON)}
    )
    for mesh in (COAT, COAT.scaled(0.5), COAT.scaled(0.8)):
        alone, both = fit_of(mesh), fit_of(mesh.scaled(factor), larger)
        assert both.fits is alone.fits
        assert states(both) == states(alone)
        for before, after in zip(alone.comparisons, both.comparisons, strict=True):
            assert after.ratio == pytest.approx(before.ratio)


def test_a_front_that_is_closed_is_told_whatever_the_size() -> None:
    for factor in (1.0, 3.0):
        fit = fit_of(closed_coat(COAT).scaled(factor))
        assert fit.fits is False
        assert fit.impossible[0].text.startswith("closed front")
        assert fit.impossible[0].measure == ""


def test_a_front_that_opens_at_the_back_is_not_judged() -> None:
    fit = judge(replace(SIZES, opening="back"), PERSON)
    assert fit.fits is None
    assert "opens at the back" in fit.reasons[0].text
    assert fit.impossible == ()
    # but what is too narrow is so from either side
    narrow = judge(with_girths(replace(SIZES, opening="back"), left_cuff=0.1), PERSON)
    assert narrow.fits is False


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    ("name", "limits", "girth", "at_edges"),
    [
        ("cuff", CUFF, PERSON.hand, False),
        ("cuff", CUFF, PERSON.hand, True),
        ("armhole", ARMHOLE, PERSON.upper_arm, False),
        ("armhole", ARMHOLE_AT_EDGES, PERSON.upper_arm, True),
    ],
)
def test_a_girth_is_told_just_below_its_limits(
    side: str, name: str, limits: Limits, girth: float, at_edges: bool
) -> None:
    def at(ratio: float) -> Fit:
        return judge(with_girths(SIZES, **{f"{side}_{name}": ratio * girth}), PERSON, at_edges)

    assert at(limits.wanted + 1e-3).reasons == ()
    narrow = at(limits.least - 1e-3)
    assert narrow.fits is False
    assert [finding.measure for finding in narrow.impossible] == [f"{name}_girth"]
    assert f"{side} {name}" in narrow.impossible[0].text
    for ratio, level, fits in ((limits.fails, "fails", False), (limits.tight, "tight", True)):
        if ratio > limits.least:
            below = at(ratio - 1e-3)
            assert below.fits is fits
            assert below.impossible == ()
            assert [finding.level for finding in below.reasons] == [level]


def test_both_sides_are_told_once() -> None:
    fit = judge(with_girths(SIZES, left_cuff=0.1, right_cuff=0.1), PERSON)
    told = [finding.text for finding in fit.findings if "cuff" in finding.text]
    assert told == ["the cuffs are narrower than the hand: 10.0 cm and 25.1 cm"]
    assert [name for name, state in states(fit).items() if state == "too narrow"] == [
        "left cuff",
        "right cuff",
    ]


def test_a_narrow_back_is_tight() -> None:
    width = BACK.tight * PERSON.shoulder_width
    assert judge(replace(SIZES, back_width=1.001 * width), PERSON).reasons == ()
    fit = judge(replace(SIZES, back_width=0.999 * width), PERSON)
    assert fit.fits is True
    assert fit.impossible == ()
    assert fit.reasons[0].measure == "back_width"


def test_a_garment_without_sleeves_cannot_go_on() -> None:
    fit = judge(replace(SIZES, sleeve_length={"left": 0.02, "right": 0.5}), PERSON)
    assert fit.impossible[0].text == "no sleeves: the left one is 2.0 cm long"


@pytest.mark.parametrize(
    ("length", "told"),
    [
        (0.3, "the sleeves end 31.0 cm before the middle of the hand"),
        (0.75, "the sleeves reach 10.0 cm beyond the tip of the hand, which stays in them"),
    ],
)
def test_short_and_long_sleeves_are_noted(length: float, told: str) -> None:
    fit = judge(replace(SIZES, sleeve_length={"left": length, "right": length}), PERSON)
    assert fit.fits is True
    assert told in [note.text for note in fit.notes]


def test_a_front_that_cannot_be_closed_is_noted() -> None:
    small: CoatParameters = replace(SHIPPED, chest=1.1, shoulder_width=0.46)
    sizes = garment_sizes(make_coat(small, 0.05))
    fit = judge(sizes, PERSON)
    open_by = 100.0 * (PERSON.chest - sizes.chest)
    assert f"the front stays open by {open_by:.1f} cm at the chest" in [n.text for n in fit.notes]
    assert not any("stays open" in note.text for note in fit_of(COAT).notes)


def test_unequal_sides_are_noted() -> None:
    fit = judge(with_girths(SIZES, left_cuff=0.36, right_cuff=0.40), PERSON)
    assert [note.text for note in fit.notes] == ["left and right cuffs differ: 36.0 cm and 40.0 cm"]


def test_the_worst_is_told_first() -> None:
    sizes = with_girths(replace(SIZES, opening="back"), left_cuff=0.1, left_armhole=0.4)
    levels = [finding.level for finding in judge(sizes, PERSON).findings]
    assert levels == sorted(levels, key=["cannot", "fails", "unknown", "tight", "note"].index)
    assert levels[0] == "cannot"
    assert "fails" in levels
