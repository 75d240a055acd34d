"""Drawn coats: decided by the seed, sound, and of all cuts and sizes."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.scenario.coat import COAT_MEASURES, coat_parameters
from drake_dress.diagrams.scenario.drawn_coat import MEASURE_WIDTH, draw_coat, in_size, own_size
from drake_dress.diagrams.scenario.loading import checked_scenario
from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, body_of_size, size_codes


def drawn(seed: int, count: int) -> list[Coat]:
    rng = np.random.default_rng(seed)
    return [draw_coat(rng) for _ in range(count)]


def test_the_seed_decides_the_coats() -> None:
    assert drawn(1, 3) == drawn(1, 3)
    assert drawn(1, 3) != drawn(2, 3)


def test_drawn_coats_are_scenarios_near_their_size_and_differ() -> None:
    coats = drawn(0, 12)
    for coat in coats:
        scenario = checked_scenario(Scenario())
        scenario.garment.coat = coat
        assert checked_scenario(scenario).garment.coat == coat
        nominal = coat_parameters(
            Coat(preset=coat.preset, size=coat.size, size_table=coat.size_table)
        )
        own = coat_parameters(coat)
        assert own.lengths.keys() == nominal.lengths.keys()
        ratios = [own.lengths[k] / nominal.lengths[k] for k in own.lengths]
        assert all(abs(r - 1.0) <= MEASURE_WIDTH * (1 + 1e-9) for r in ratios)
        assert len(set(ratios)) == len(ratios)
        assert own.opens == "front"
    # the chance that 12 draws from 8 cuts give fewer than 4 is below 1 in 100,000
    assert len({coat.preset for coat in coats}) >= 4
    assert {coat.size_table for coat in coats} == {"women", "men"}
    assert len({coat.chest for coat in coats}) == 12


def test_cuts_tables_and_opening_can_be_chosen() -> None:
    rng = np.random.default_rng(5)
    assert draw_coat(rng, opens="back").preset == "gown"
    child = draw_coat(rng, cuts=["raincoat"], tables=["children"], width=0.0)
    assert (child.preset, child.size_table) == ("raincoat", "children")
    plain = coat_parameters(Coat(preset="raincoat", size=child.size, size_table="children"))
    assert coat_parameters(child) == plain


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"cuts": ["cape"]}, "preset"),
        ({"tables": ["cats"]}, "size_table"),
        ({"width": 0.9}, "width"),
    ],
)
def test_what_cannot_be_drawn_is_told(arguments: dict[str, object], key: str) -> None:
    with pytest.raises(UserError, match=r"expected|no drawn") as caught:
        draw_coat(np.random.default_rng(0), **arguments)  # type: ignore[arg-type]
    assert caught.value.key == key


def test_every_measure_of_a_cut_is_drawn() -> None:
    coat = draw_coat(np.random.default_rng(1), cuts=["bathrobe"])
    bathrobe = COATS["bathrobe"]
    for name in COAT_MEASURES:
        assert (getattr(coat, name) is None) == (getattr(bathrobe, name) is None)


def test_in_another_size_a_coat_keeps_its_ratios_to_the_cut_and_comes_back() -> None:
    for coat in drawn(3, 4):
        other = in_size(coat, "XXL")
        back = in_size(other, str(coat.size))
        assert (other.size, other.preset, other.size_table) == ("XXL", coat.preset, coat.size_table)
        for name in COAT_MEASURES:
            before, after = getattr(coat, name), getattr(back, name)
            assert after == (None if before is None else pytest.approx(before))
        own, plain = (
            coat_parameters(each)
            for each in (other, Coat(preset=coat.preset, size="XXL", size_table=coat.size_table))
        )
        ratios = [own.lengths[k] / plain.lengths[k] for k in own.lengths]
        assert all(abs(r - 1.0) <= MEASURE_WIDTH * (1 + 1e-9) for r in ratios)
    assert in_size(Coat(size="M"), "L") == Coat(size="L")
    with pytest.raises(UserError, match="expected one of"):
        in_size(coat, "7XL")


@pytest.mark.parametrize("table", ["women", "men", "children"])
def test_the_body_of_a_size_has_this_size(table: str) -> None:
    for code in size_codes(table):
        chest = body_of_size(table, code).chest
        for near in (chest - 1e-3, chest + 1e-3):
            assert body_of_size(table, own_size(table, near)).chest == chest
    assert own_size("men", 1.0, ["S", "3XL"]) == "S"
