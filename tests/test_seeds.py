"""Seeds drawn for a purpose."""

import pytest

from drake_dress.seeds import PURPOSES, drawn_seeds


@pytest.mark.parametrize("purpose", PURPOSES)
def test_a_larger_draw_begins_with_the_smaller_one(purpose: str) -> None:
    few, many = drawn_seeds(purpose, 7, root=3), drawn_seeds(purpose, 40, root=3)
    assert many[:7] == few
    assert len(set(many)) == 40
    assert all(seed in PURPOSES[purpose] for seed in many)


def test_other_roots_draw_other_seeds() -> None:
    assert drawn_seeds("report", 5, root=0) != drawn_seeds("report", 5, root=1)
