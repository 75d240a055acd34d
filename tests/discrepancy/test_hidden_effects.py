"""Effects that were hidden at random are found, and where nothing is hidden nothing is named.

Seeds are drawn when the tests run, and printed; answers are read after the verdict is out. Each
case is judged, right or wrong, and one rule decides. A tool that is right in 96 % of its cases
fails a test here with the first probability below; one that is right in half of them passes with
the second.

    made up, nothing hidden   60 cases, at most 8 wrong      0.1 %   2e-9
    made up, weight hidden    12 cases, at most 2 wrong      1.1 %   1.9 %
    simulated, nothing hidden 2 right before 2 are wrong     0.5 %   50 %
    simulated, an effect      1 right before 2 are wrong     0.2 %   75 %

Simulated cases take minutes, so that few are run: they tell that the whole tool works. Made-up ones
(made_up.py) take a part of a second: they tell how often its search for causes is right, and catch
what the few simulated ones would let pass.
"""

import json
from collections.abc import Callable
from itertools import count
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.discrepancy import search
from drake_dress.discrepancy.attribution import compare
from drake_dress.discrepancy.commands import explain_files, write_dataset
from drake_dress.discrepancy.explained import Explained
from drake_dress.discrepancy.search import Search
from drake_dress.models.effects.fabric import StretchStiffness
from drake_dress.models.effects.mass import SurfaceDensity
from drake_dress.models.effects.registry import EFFECTS
from tests.discrepancy.data import SCENARIO
from tests.discrepancy.made_up import DECOY, TRUTH, MadeUp, probe_of
from tests.drawing import drawn_seed

# Half of the scenario's nodes and free motions only, so that a case takes a minute.
COARSER = ("plant.spacing=0.042", "plant.time_step=0.005", "plant.tolerance=2e-3")
MOTIONS = ("sway", "lift", "pull")
# Of simulated cases: so many right ones pass, if they come before two wrong ones.
ENOUGH_RIGHT = {"an effect": 1, "nothing": 2}
TOO_MANY_WRONG = 2
# Of made-up ones: how many, and how many of them may be wrong.
NOTHING_MADE_UP, NOTHING_WRONG = 60, 8
WEIGHT_MADE_UP, WEIGHT_WRONG = 12, 2
GOOD, HALF = 0.96, 0.5
# What the wrong one of two made-up effects does besides and was not seen, m: twice the noise.
APART = 2e-3


def passes(right: Callable[[], bool], enough: int) -> bool:
    """Returns whether enough cases are right before too many are wrong; `right` gives the next."""
    seen: list[bool] = []
    while seen.count(True) < enough and seen.count(False) < TOO_MANY_WRONG:
        seen.append(right())
    return seen.count(True) == enough


def test_the_rules_separate_good_tools_from_bad_ones_as_often_as_is_said() -> None:
    def at_most(wrong: int, cases: int, p: float) -> float:
        return sum(comb(cases, k) * (1 - p) ** k * p ** (cases - k) for k in range(wrong + 1))

    nothing, weight = (NOTHING_WRONG, NOTHING_MADE_UP), (WEIGHT_WRONG, WEIGHT_MADE_UP)
    assert 1.0 - at_most(*nothing, GOOD) < 0.001
    assert at_most(*nothing, HALF) < 3e-9
    assert 1.0 - at_most(*weight, GOOD) < 0.011
    assert at_most(*weight, HALF) < 0.02
    # so many right ones, and at most one wrong one, which is not the last
    for enough, failing, passing in ((2, 0.005, 0.5), (1, 0.002, 0.75)):
        assert 1.0 - GOOD**enough * (1.0 + enough * (1.0 - GOOD)) < failing
        assert HALF**enough * (1.0 + enough * (1.0 - HALF)) <= passing
    assert set(ENOUGH_RIGHT.values()) == {1, 2}
    # and the rule is what is computed here
    of = [[True] * 2, [True, False, True], [False, True, True]]
    assert all(passes(iter(row).__next__, 2) for row in of)
    wrong = [[False, False], [True, False, False], [False, True, False]]
    assert not any(passes(iter(row).__next__, 2) for row in wrong)
    assert passes(iter([False, True]).__next__, 1)
    assert not passes(iter([False, False]).__next__, 1)


def causes_made_up(lab: MadeUp, monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Returns the names of causes that a search among two effects finds, rivals among them."""
    comparison = compare(lab)
    effects = (SurfaceDensity(added=0.03), StretchStiffness(added=0.03 * DECOY))
    monkeypatch.setattr(search, "probe", probe_of(lab, effects))
    found = Search(lab, comparison, np.random.default_rng(0), lambda _: None, None).run()
    named = {n.name for n in found.named}
    return named if found.rival is None else named | {found.rival[0].name}


@pytest.mark.parametrize(
    ("truth", "cases", "most_wrong"),
    [(0.0, NOTHING_MADE_UP, NOTHING_WRONG), (TRUTH, WEIGHT_MADE_UP, WEIGHT_WRONG)],
    ids=["nothing", "weight"],
)
def test_of_made_up_cases_nearly_all_are_right(
    monkeypatch: pytest.MonkeyPatch, truth: float, cases: int, most_wrong: int
) -> None:
    seed = drawn_seed()
    wrong = []
    for k in range(cases):
        lab = MadeUp(np.random.default_rng([seed, k]), np.inf, truth=truth, apart=APART)
        causes = causes_made_up(lab, monkeypatch)
        if not ("surface_density" in causes if truth else not causes):
            wrong.append((k, causes))
    assert len(wrong) <= most_wrong, wrong


def verdict_and_answer(hide: str, seed: int, directory: Path) -> tuple[Explained, dict[str, Any]]:
    """Returns what was found, and only then what was hidden."""
    print(f"hide {hide}, seed {seed}")
    write_dataset(hide, seed, directory, str(SCENARIO), COARSER, motions=MOTIONS)
    measured = str(directory / "measured.h5")
    found = explain_files([measured], str(SCENARIO), COARSER, directory / "out", None)
    answer = json.loads((directory / "answer.json").read_text())
    print(f"found {found.verdict} {[c.name for c in found.causes]}, hidden {answer}")
    return found, answer


def is_right(found: Explained, answer: dict[str, Any]) -> bool:
    named = {c.name for c in found.causes}
    if answer["effect"] == "nothing":
        return found.verdict == "nothing"
    return found.verdict in ("named", "ambiguous") and answer["effect"] in named


@pytest.mark.parametrize("kind", list(ENOUGH_RIGHT))
def test_simulated_cases_are_judged_right_nearly_always(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(drawn_seed())
    names = sorted(n for n, kind in EFFECTS.items() if not kind.NEEDS_CONTACT)
    number = count()

    def right() -> bool:
        hide = str(rng.choice(names)) if kind == "an effect" else "nothing"
        directory = tmp_path / str(next(number))
        return is_right(*verdict_and_answer(hide, int(rng.integers(10**6)), directory))

    assert passes(right, ENOUGH_RIGHT[kind])
