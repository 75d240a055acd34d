"""What edges of a garment may be, with noise on its nodes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.supervision.garment_shape import ShapeBounds, impossible_shape

# A grid of 8 × 8 nodes, 4 cm apart, with the edges along both sides.
COLUMNS, SPACING = 8, 0.04
NODES = SPACING * np.stack(
    [*np.divmod(np.arange(COLUMNS**2), COLUMNS), np.full(COLUMNS**2, 30.0)], axis=1
).astype(float)
NUMBER = np.arange(COLUMNS**2).reshape(COLUMNS, COLUMNS)
EDGES = np.concatenate(
    [
        np.stack([NUMBER[:, :-1].ravel(), NUMBER[:, 1:].ravel()], axis=1),
        np.stack([NUMBER[:-1].ravel(), NUMBER[1:].ravel()], axis=1),
    ]
)


def bounds(**values: float) -> ShapeBounds:
    rest = np.full(len(EDGES), SPACING)
    return ShapeBounds(EDGES, rest, (NUMBER[0], NUMBER[-1]), extent=1.0, **values)


@pytest.mark.parametrize("noise", [0.002, 0.01, 0.05])
def test_greatest_mean_edge_is_that_of_a_stretched_garment_with_noise(noise: float) -> None:
    """Noise moves both ends of an edge on three axes: six variances are added to its square."""
    b = bounds(node_noise=noise)
    rng = np.random.default_rng(0)
    squares = []
    for _ in range(400):
        x = (1.0 + b.strain) * NODES + rng.normal(scale=noise, size=NODES.shape)
        squares.append(((x[EDGES[:, 0]] - x[EDGES[:, 1]]) ** 2).sum(axis=1).mean())
    assert b.mean_edge[1] ** 2 == pytest.approx(float(np.mean(squares)), rel=0.01)


@given(st.permutations(range(0, len(EDGES), 9)), st.floats(1.05, 3.0))
def test_the_edge_that_is_told_is_the_one_most_beyond_its_length(
    order: list[int], factor: float
) -> None:
    """Whichever place it has among others that are too long."""
    b = bounds(node_noise=0.001)
    x = NODES.copy()
    most, others = order[0], order[1:3]
    length = b.longest[0]
    # apart from the grid, so that no other edge of a node is as long
    for k in (*others, most):
        i, j = EDGES[k]
        away = length * (factor if k == most else 1.0 + 0.2 * (factor - 1.0))
        x[j] = x[i] + [0.0, 0.0, away]
    told = impossible_shape(x, None, b)
    assert told is not None
    lengths = np.linalg.norm(x[EDGES[:, 0]] - x[EDGES[:, 1]], axis=1)
    beyond = lengths**2 - b.longest**2
    found = re.match(r"edge between nodes (\d+) and (\d+) ", told)
    assert found is not None, told
    named = (EDGES == [int(found[1]), int(found[2])]).all(axis=1)
    # edges may be equally long
    assert beyond[named] == pytest.approx(beyond.max(), rel=1e-9)
