"""Whether an opening can be seen."""

import numpy as np
import pytest

from drake_dress.models.dressing.sight import free_sight

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
