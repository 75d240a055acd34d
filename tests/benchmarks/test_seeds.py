"""Seeds are drawn for a purpose from a root: apart, different, and the same again."""

from __future__ import annotations

import argparse
import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.seeds import (
    Draw,
    add_seed_options,
    chosen_seeds,
    draw_of,
    draw_seeds,
)
from drake_dress.errors import UserError
from drake_dress.seeds import PURPOSES

purposes = st.sampled_from(sorted(PURPOSES))


def parsed(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_seed_options(parser, range(13))
    return parser.parse_args(words)


@given(purposes, st.integers(1, 60), st.integers(0, 2**63 - 1))
def test_seeds_of_a_purpose_differ_and_lie_in_its_range(
    purpose: str, count: int, root: int
) -> None:
    seeds = draw_seeds(Draw(purpose, count), root)
    assert len(set(seeds)) == count
    assert all(seed in PURPOSES[purpose] for seed in seeds)
    assert seeds == draw_seeds(Draw(purpose, count), root)
    assert seeds != draw_seeds(Draw("report", count), root + 1) or purpose != "report"


@given(purposes, st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32))
def test_a_longer_draw_holds_the_shorter_one(purpose: str, a: int, b: int, root: int) -> None:
    few, many = sorted((a, b))
    assert set(draw_seeds(Draw(purpose, few), root)) <= set(draw_seeds(Draw(purpose, many), root))


def test_all_seeds_of_a_purpose_can_be_drawn() -> None:
    assert draw_seeds(draw_of("develop:100"), 3) == list(range(100))


def test_purposes_share_no_seed() -> None:
    ranges = sorted(PURPOSES.values(), key=lambda r: r.start)
    assert all(a.stop == b.start for a, b in itertools.pairwise(ranges))


@pytest.mark.parametrize("text", ["report", "report:0", "develop:101", "show:3", "report:-1", "7"])
def test_what_is_no_draw_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="expected"):
        draw_of(text)


def test_a_root_is_printed_and_gives_the_same_seeds_again() -> None:
    seeds, said = chosen_seeds(parsed("--draw", "report:5"))
    root = said.split("--root ")[1].rstrip("`.")
    again, _ = chosen_seeds(parsed("--draw", "report:5", "--root", root))
    assert seeds == again


def test_given_seeds_take_no_root() -> None:
    assert chosen_seeds(parsed("--seeds", "3-5")) == (range(3, 6), "Seeds 3 to 5.")
    with pytest.raises(UserError, match="--draw"):
        chosen_seeds(parsed("--root", "1"))
