"""The benchmark of holds sees more of an armhole where it is open to the front."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.hold import hung, main, seen_from
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.hold import held_at_edges


def test_an_overcoat_held_at_its_edges_is_open_to_the_front() -> None:
    coat = make_coat(COATS["overcoat"], 0.06)
    assert seen_from(coat) < 0.2
    assert seen_from(held_at_edges(coat, 0.4, "test")) > 0.4


def test_it_hangs_by_its_weight_from_grippers_that_spread_it() -> None:
    coat = held_at_edges(make_coat(COATS["jacket"], 0.06), 0.4, "test")
    x, rest = hung(coat), coat.rest_position
    assert np.isfinite(x).all()

    def apart(of: np.ndarray) -> float:
        left, right = (of[coat.grasp[side]].mean(axis=0) for side in ("left", "right"))
        return float(np.linalg.norm(left - right))

    assert apart(x) > 1.2 * apart(rest)
    # its middle hangs below the grippers
    assert x[:, 2].mean() < x[coat.held, 2].mean() - 0.1


def test_a_size_that_there_is_not_is_told() -> None:
    with pytest.raises(Exception, match="size"):
        main(["--size", "Q"])
