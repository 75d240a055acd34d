"""The card tells how the set was made, what it holds and what it does not."""

from drake_dress.learning.motion.card import card
from drake_dress.learning.motion.dataset import MotionSet
from drake_dress.learning.motion.figures import Figures

FIGURES = Figures(40, 400.0, 0.123, 0.456, (0.01, 0.23), (0.45, 0.67), (0.02, 0.03), 0.789)
KNOWN = MotionSet(4, "9.8", {"passive": 40, "active": 0, "free": 4})


def test_a_card_names_command_seed_version_and_figures() -> None:
    text = card(KNOWN, "drake-dress dataset motion --seed 4", {"passive": FIGURES}, {}, 0)
    assert "drake_dress 9.8, seed 4" in text
    assert "\ndrake-dress dataset motion --seed 4\n" in text
    row = next(line for line in text.splitlines() if line.startswith("| passive | 40 "))
    told = "6.7 | 12.3 % | 45.6 % | 0.01 / 0.23 | 0.45 / 0.67 | 0.02 / 0.03 | 78.9 %"
    assert row == f"| passive | 40 | {told} |"
    assert "## What it does not hold" in text
    assert "Whole dressings" not in text


def test_a_card_gives_the_numbers_of_each_part() -> None:
    lines = card(KNOWN, "", {}, {}, 0).splitlines()
    assert "| passive | 0 to 29 | 30 to 33 | 34 to 39 |" in lines
    assert "| free | 0 to 2 | none | 3 to 3 |" in lines
    assert not any(line.startswith("| active") for line in lines)


def test_a_card_says_that_nothing_is_trained_on_dressings() -> None:
    text = card(KNOWN, "", {}, {"active": FIGURES}, 30)
    assert "Nothing is trained on these files" in text
    assert "30\nof 40 runs ended with both sleeves on" in text
    assert "| active | 40 |" in text


def test_tables_of_a_card_have_as_many_cells_in_each_row() -> None:
    text = card(KNOWN, "", {"passive": FIGURES}, {"active": FIGURES}, 1)
    for block in text.split("\n\n"):
        cells = [line.count("|") for line in block.splitlines() if line.startswith("|")]
        assert len(set(cells)) <= 1, block
