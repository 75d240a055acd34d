"""Whether an opening can be seen."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.dressing.sight import (
    distance_to_opening,
    free_sight,
    is_barred,
    move_into_sight,
)

# A ring of nodes in the plane z = 0, and a curtain (two triangles) in the plane z = 1.
ANGLE = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
RING = np.stack([np.cos(ANGLE), np.sin(ANGLE), np.zeros(24)], axis=1)
CURTAIN = np.array([[-2.0, -2.0, 1.0], [2.0, -2.0, 1.0], [2.0, 2.0, 1.0], [-2.0, 2.0, 1.0]])
X = np.concatenate([RING, CURTAIN])
FACES = np.array([[24, 25, 26], [24, 26, 27]], dtype=np.int32)
LOOP = np.arange(24)


def test_an_opening_before_the_curtain_is_seen() -> None:
    assert free_sight(X, FACES, LOOP, np.array([0.0, 0.0, 0.5])) == 1.0
    assert free_sight(X, FACES, LOOP, np.array([0.3, -0.2, -3.0])) == 1.0


def test_an_opening_behind_the_curtain_is_not() -> None:
    assert free_sight(X, FACES, LOOP, np.array([0.0, 0.0, 2.0])) == 0.0


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.0, 3.0), st.floats(-1.0, 3.0))
def test_a_segment_is_barred_where_it_goes_through_the_curtain(
    x: float, y: float, low: float, high: float
) -> None:
    through = (low - 1.0) * (high - 1.0) < 0.0 and max(abs(x), abs(y)) < 2.0
    near = min(abs(low - 1.0), abs(high - 1.0)) < 1e-6 or abs(max(abs(x), abs(y)) - 2.0) < 1e-6
    # on the line that both triangles share, neither may count
    assume(not near and abs(x - y) > 1e-6)
    for ends in ((low, high), (high, low)):
        eye, target = (np.array([x, y, z]) for z in ends)
        assert is_barred(X, FACES, eye, target) == through


def test_half_a_curtain_hides_its_half() -> None:
    x = X.copy()
    x[[24, 27], 0] = 0.05  # hides the three points of nine with a greater x
    assert free_sight(x, FACES, LOOP, np.array([0.0, 0.0, 20.0])) == pytest.approx(6.0 / 9.0)


def test_rigid_motion_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        shift, eye = rng.normal(size=3), rng.normal(size=3) * 2.0
        moved = free_sight(X @ q.T + shift, FACES, LOOP, q @ eye + shift)
        assert moved == free_sight(X, FACES, LOOP, eye)


# The same at the size of an armhole, its curtain half-way to an eye 20 cm before it.
SMALL = 0.08 * X
SMALL[24:, 2] = 0.1
EYE = np.array([0.0, 0.0, 0.2])
UP = np.array([0.0, 0.0, 1.0])


def test_an_opening_that_is_seen_stays_where_it_is() -> None:
    x = SMALL.copy()
    x[24:, 0] += 1.0
    np.testing.assert_array_equal(move_into_sight(x, FACES, LOOP, UP, EYE, np.eye(3)), np.zeros(3))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_curtain_is_gone_around_on_its_nearer_side(side: float) -> None:
    x = SMALL.copy()
    x[24:, 0] += side * 0.13  # its edge is 3 cm beyond the middle
    move = move_into_sight(x, FACES, LOOP, UP, EYE, np.eye(3))
    assert free_sight(x + move, FACES, LOOP, EYE) > 0.85
    assert side * move[0] > 0.0
    assert np.linalg.norm(move) <= 0.1


def test_an_opening_at_the_eye_goes_back() -> None:
    x = SMALL.copy()
    x[24:, 0] += 1.0
    eye = np.array([0.0, 0.0, 0.02])
    move = move_into_sight(x, FACES, LOOP, UP, eye, np.eye(3))
    assert np.linalg.norm(eye - move) > 0.1
    assert move[2] < -0.05


@given(st.integers(0, 2**32 - 1))
def test_the_move_turns_with_its_frame(seed: int) -> None:
    # The edges of this curtain bar no line of sight by a hair: rounding does not choose the move.
    x = SMALL.copy()
    x[24:] += [0.117, 0.043, 0.003]
    straight = move_into_sight(x, FACES, LOOP, UP, EYE, np.eye(3))
    assert np.linalg.norm(straight) > 0.0
    q = Rotation.random(rng=seed).as_matrix()
    turned = move_into_sight(x @ q.T, FACES, LOOP, q @ UP, q @ EYE, q.T)
    np.testing.assert_allclose(turned, q @ straight, atol=1e-9)


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_distance_to_an_opening_is_that_to_its_disc(x: float, y: float, z: float) -> None:
    """A circle of 24 nodes is a disc but for 1 % of its radius."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    rim = 0.1 * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    beyond = max(0.0, float(np.hypot(x, y)) - 0.1)
    found = distance_to_opening(rim, np.array([x, y, z]))
    assert found == pytest.approx(float(np.hypot(beyond, z)), abs=1.1e-3)
