"""Movements by will: what the hand does, and where it ends."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.learning.motion.movements import (
    SHARES,
    Armhole,
    Movement,
    MovementKind,
    Movements,
)
from drake_dress.learning.motion.strokes import Stroke
from drake_dress.models.arrays import FloatArray
from tests.learning.motion.persons import ARM, HOME, LIMITS

PLACE = ARM.hand(np.array([0.6, -0.5, 0.3, 1.0]))


def movements(seed: int) -> Movements:
    return Movements(ARM, HOME, LIMITS, np.random.default_rng(seed))


def drawn(kind: MovementKind, seed: int, hand: FloatArray = PLACE) -> Movement:
    movement = movements(seed).draw(kind, 1.0, hand, None)
    assert movement is not None
    return movement


def test_overlapping_strokes_add_up() -> None:
    a = Stroke(0.0, 2.0, np.array([0.4, 0.0, 0.0]), np.zeros(3))
    b = Stroke(1.0, 2.0, np.array([0.0, 0.3, 0.0]), np.zeros(3))
    movement = Movement(PLACE, (a, b))
    assert movement.end == 3.0
    for time in (0.5, 1.5, 2.5, 3.0):
        expected = PLACE + a.position(time) + b.position(time)
        np.testing.assert_allclose(movement.position(time), expected, atol=1e-15)


@pytest.mark.parametrize("kind", SHARES)
@pytest.mark.parametrize("seed", range(8))
def test_a_movement_begins_where_the_hand_is(kind: MovementKind, seed: int) -> None:
    movement = drawn(kind, seed)
    np.testing.assert_allclose(movement.position(1.0), PLACE, atol=1e-12)
    assert movement.end > 1.3


@pytest.mark.parametrize("seed", range(8))
def test_a_hand_that_withdraws_goes_toward_the_shoulder_and_comes_back(seed: int) -> None:
    movement = drawn("withdraw", seed)
    np.testing.assert_allclose(movement.position(movement.end), PLACE, atol=1e-12)
    places = [movement.position(t) for t in np.linspace(1.0, movement.end, 200)]
    level = [np.linalg.norm((p - ARM.shoulder)[:2]) for p in places]
    assert min(level) < level[0]
    assert max(np.linalg.norm(p - PLACE) for p in places) < 0.27


def test_a_hand_returns_to_its_comfortable_place_unless_it_is_there() -> None:
    movement = drawn("return", 0)
    np.testing.assert_allclose(movement.position(movement.end), ARM.hand(HOME), atol=1e-12)
    assert movements(0).draw("return", 1.0, ARM.hand(HOME) + 0.01, None) is None


def test_a_reach_goes_to_a_place_that_the_hand_can_reach_outside_the_trunk() -> None:
    changed = 0
    for seed in range(60):
        movement = drawn("reach", seed)
        end = movement.position(movement.end)
        away = np.linalg.norm(end - ARM.shoulder) / ARM.length
        assert 0.35 < away < 0.98 or np.allclose(end, ARM.hand(HOME))
        assert not (end[0] < 0.12 and abs(end[1]) < 0.16)
        # a change of mind begins before the first stroke has ended
        changed += any(
            b.start < a.end for a, b in zip(movement.strokes, movement.strokes[1:], strict=False)
        )
    # one in five of 60, outside this range once in 10,000 seeds
    assert 1 <= changed <= 26


def test_a_hand_goes_into_an_armhole_that_is_near_and_only_there() -> None:
    into = np.array([0.0, 0.0, -1.0])
    near = Armhole(PLACE + 0.25 * (ARM.shoulder - PLACE), into)
    far = Armhole(PLACE + [0.9, 0.0, 0.0], into)
    for seed in range(10):
        movement = movements(seed).draw("sleeve", 1.0, PLACE, near)
        assert movement is not None
        off = movement.position(movement.end) - near.center
        assert np.linalg.norm(off - (off @ into) * into) < 0.15
        assert -0.2 < off @ into < 0.35
        assert movements(seed).draw("sleeve", 1.0, PLACE, far) is None
        assert movements(seed).draw("sleeve", 1.0, PLACE, None) is None
