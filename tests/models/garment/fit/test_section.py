"""The length of cloth around a body is that of the cut through it."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.fit.section import cloth_around, front_gap
from tests.present import present


def tube(columns: int, rows: int, open_part: float = 0.0) -> tuple[FloatArray, IntArray]:
    """Returns a vertical tube of radius 0.3 m from z = 0 to 1; part of its girth may be missing."""
    count = columns if open_part == 0.0 else columns + 1
    angle = np.pi * open_part + 2.0 * np.pi * (1.0 - open_part) * np.arange(count) / columns
    ring = 0.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    x = np.concatenate(
        [np.column_stack([ring, np.full(count, z)]) for z in np.linspace(0, 1, rows)]
    )
    faces = []
    for row in range(rows - 1):
        for k in range(columns):
            a, b = row * count + k, row * count + (k + 1) % count
            faces += [(a, b, b + count), (a, b + count, a + count)]
    return x, np.array(faces, dtype=np.int32)


@pytest.mark.parametrize("height", [0.05, 0.5, 0.93])
def test_around_a_tube_there_is_its_girth_at_any_height(height: float) -> None:
    x, faces = tube(64, 5)
    assert cloth_around(x, faces, height) == pytest.approx(2.0 * np.pi * 0.3, rel=2e-3)
    assert front_gap(x, faces, np.ones(len(x), dtype=bool), height) is None


@pytest.mark.parametrize("part", [0.1, 0.4])
def test_cloth_and_gap_of_an_open_tube_make_its_outline(part: float) -> None:
    x, faces = tube(64, 5, part)
    girth = 2.0 * np.pi * 0.3
    assert cloth_around(x, faces, 0.4) == pytest.approx((1.0 - part) * girth, rel=2e-3)
    gap = present(front_gap(x, faces, np.ones(len(x), dtype=bool), 0.4))
    assert gap == pytest.approx(2.0 * 0.3 * np.sin(np.pi * part), rel=1e-6)


def test_beside_the_cloth_nothing_is_cut() -> None:
    x, faces = tube(16, 3)
    assert cloth_around(x, faces, 1.2) == 0.0
    assert front_gap(x, faces, np.ones(len(x), dtype=bool), 1.2) is None


def test_edges_that_do_not_count_leave_no_gap() -> None:
    x, faces = tube(16, 3, 0.2)
    assert front_gap(x, faces, np.zeros(len(x), dtype=bool), 0.4) is None
