"""Sizes: every size of every cut is a coat, and all measures follow the body."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise

import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import (
    COATS,
    SIZE_TABLES,
    BodySize,
    body_of_size,
    coat_of_size,
    make_coat,
    size_codes,
)
from drake_dress.models.garment.coat.parameters import check

# By body, not by order in the table.
MEN = [str(n) for n in range(34, 61, 2)]
ADULT_LETTERS = ["XS", "S", "M", "L", "XL", "XXL", "3XL", "4XL", "5XL"]
CHILDREN = [str(n) for n in range(92, 177, 6)]


@pytest.mark.parametrize("name", sorted(COATS))
def test_every_size_of_every_cut_is_a_coat(name: str) -> None:
    for table in SIZE_TABLES:
        codes = size_codes(table)
        for code in codes:
            p = coat_of_size(COATS[name], body_of_size(table, code))
            check(p, 0.06, f"{table} {code}")
            if code in (codes[0], codes[8], codes[-1]):
                make_coat(p, 0.06, source=f"{table} {code}").validate()


def test_tables_have_the_sizes_that_are_promised() -> None:
    assert list(size_codes("men")) == ADULT_LETTERS + MEN
    assert list(size_codes("women")) == ADULT_LETTERS + MEN
    assert list(size_codes("children")) == CHILDREN


@pytest.mark.parametrize(
    ("table", "code", "low", "high"),
    [  # intervals of EN 13402-3 for chest or bust, m
        ("men", "S", 0.86, 0.94),
        ("men", "M", 0.94, 1.02),
        ("men", "XXL", 1.18, 1.29),
        ("men", "3XL", 1.29, 1.41),
        ("men", "4XL", 1.41, 1.54),
        ("men", "5XL", 1.54, 1.66),
        ("men", "48", 0.94, 0.98),
        ("women", "S", 0.82, 0.90),
        ("women", "M", 0.90, 0.98),
        ("women", "L", 0.98, 1.07),
        ("women", "XL", 1.07, 1.19),
        ("women", "36", 0.82, 0.86),
        ("women", "48", 1.07, 1.13),
        ("women", "3XL", 1.31, 1.43),
        ("women", "5XL", 1.55, 1.67),
    ],
)
def test_sizes_stand_for_the_girths_of_the_standard(
    table: str, code: str, low: float, high: float
) -> None:
    assert low < body_of_size(table, code).chest < high


def test_women_s_numbers_are_the_middles_of_the_intervals() -> None:
    edges = [*range(78, 103, 4), *range(107, 132, 6)]  # cm, from 34 on
    for number, low, high in zip(range(34, 54, 2), edges, edges[1:], strict=False):
        bust = 100.0 * body_of_size("women", str(number)).chest
        assert bust == pytest.approx(0.5 * (low + high), abs=0.51), number


@pytest.mark.parametrize(
    ("table", "codes"),
    [("men", ADULT_LETTERS), ("men", MEN), ("women", ADULT_LETTERS), ("women", MEN)],
)
def test_a_larger_size_is_larger_in_every_girth_and_width(table: str, codes: list[str]) -> None:
    bodies = [body_of_size(table, code) for code in codes]
    for one, next_one in pairwise(bodies):
        for entry in fields(BodySize):
            small, large = getattr(one, entry.name), getattr(next_one, entry.name)
            # a body does not grow taller without end
            assert small < large or (entry.name in ("stature", "arm") and small <= large)


def test_a_child_s_size_is_its_stature_and_all_measures_grow_with_it() -> None:
    bodies = [body_of_size("children", code) for code in CHILDREN]
    assert [round(100 * b.stature) for b in bodies] == [int(c) for c in CHILDREN]
    for one, next_one in pairwise(bodies):
        for entry in fields(BodySize):
            assert getattr(one, entry.name) < getattr(next_one, entry.name)


@pytest.mark.parametrize("name", sorted(COATS))
def test_a_cut_of_size_50_is_as_it_is_drawn_and_every_measure_follows_the_size(name: str) -> None:
    cut = COATS[name]
    same = coat_of_size(cut, body_of_size("men", "50"))
    assert same.lengths == pytest.approx(cut.lengths)
    sizes = [coat_of_size(cut, body_of_size("men", code)).lengths for code in ("44", "50", "56")]
    for key in cut.lengths:
        assert sizes[0][key] < sizes[1][key] < sizes[2][key], key
    assert (same.collar, same.opens, same.sleeve_slope_deg) == (
        cut.collar,
        cut.opens,
        cut.sleeve_slope_deg,
    )


@pytest.mark.parametrize("table", SIZE_TABLES)
def test_a_coat_is_wider_than_its_wearer(table: str) -> None:
    for code in size_codes(table):
        body = body_of_size(table, code)
        for cut in COATS.values():
            p = coat_of_size(cut, body)
            assert p.chest > body.chest
            assert p.cuff_girth > body.hand
            assert p.armhole_girth > body.armscye
            # a cut with sleeves to the wrist has them in all sizes
            if cut.sleeve_length > 0.55:
                assert abs(p.sleeve_length - body.arm) < 0.05


@pytest.mark.parametrize(
    ("table", "code", "key", "word"),
    [
        ("men", "Q", "size", "XS"),
        ("men", "116", "size", "50"),
        ("children", "M", "size", "116"),
        ("cats", "M", "size_table", "women"),
    ],
)
def test_an_unknown_size_is_told_with_those_that_there_are(
    table: str, code: str, key: str, word: str
) -> None:
    with pytest.raises(UserError, match=word) as caught:
        body_of_size(table, code)
    assert caught.value.key == key


def test_an_unknown_table_has_no_codes() -> None:
    with pytest.raises(UserError, match="expected one of women, men, children"):
        size_codes("dogs")
