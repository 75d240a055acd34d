"""The torso sways, turns and leans about the pelvis as a rigid body."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.learning.motion.strokes import Stroke
from drake_dress.learning.motion.torso import Torso, draw_lean, draw_turn


def torso(seed: int = 0) -> Torso:
    return Torso.drawn(np.random.default_rng(seed), 0.95)


def still() -> Torso:
    quiet = torso()
    quiet.size = 0.0
    return quiet


@pytest.mark.parametrize("seed", range(5))
def test_the_rotation_is_orthogonal_and_keeps_hands_apart(seed: int) -> None:
    moving, rng = torso(seed), np.random.default_rng(seed)
    moving.strokes += [draw_turn(rng, 0.5), draw_lean(rng, 1.0, 2.0, np.array([0.4, 0.2, 0.1]))]
    for time in np.linspace(0.0, 6.0, 25):
        rotation, _ = moving.pose(time)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_leans_keep_the_pelvis() -> None:
    leaning = still()
    way = np.array([0.0, 0.0, 0.0, 0.3, 0.2, 0.4])
    leaning.strokes.append(Stroke(1.0, 2.0, way, np.zeros(6)))
    pelvis = np.array([0.0, 0.0, leaning.pelvis])
    places = [r @ pelvis + o for r, o in (leaning.pose(t) for t in np.linspace(0.0, 4.0, 9))]
    np.testing.assert_allclose(places, [[*leaning.origin, leaning.pelvis]] * 9, atol=1e-12)
    # the head goes forward
    before, after = (r @ [0.0, 0.0, 1.6] + o for r, o in (leaning.pose(0.0), leaning.pose(4.0)))
    assert np.linalg.norm(after - before) > 0.2


def test_a_step_carries_the_torso_in_its_first_heading() -> None:
    stepping = still()
    stepping.strokes.append(Stroke(0.0, 1.0, np.array([0.3, 0, 0, 0, 0, 0]), np.zeros(6)))
    way = stepping.pose(2.0)[1] - stepping.pose(-1.0)[1]
    ahead = [np.cos(stepping.yaw), np.sin(stepping.yaw), 0.0]
    np.testing.assert_allclose(way, 0.3 * np.array(ahead), atol=1e-12)


def test_a_stroke_that_begins_now_has_not_moved_the_torso_yet() -> None:
    moving = still()
    before = moving.pose(2.0)[0].copy()
    moving.strokes.append(draw_turn(np.random.default_rng(0), 2.0))
    np.testing.assert_array_equal(moving.pose(2.0)[0], before)
    assert moving.is_moving(2.0)
    assert np.abs(moving.pose(2.5)[0] - before).max() > 1e-3


def test_quiet_stance_sways_by_millimetres() -> None:
    places = np.array([torso(s).pose(t)[1] for s in range(20) for t in np.arange(0, 10, 0.5)])
    spread = (places.reshape(20, 20, 3) - places.reshape(20, 20, 3).mean(1, keepdims=True)).std()
    assert 5e-4 < spread < 0.02


def test_turns_and_leans_stay_within_what_people_do() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        turn = draw_turn(rng, 0.0)
        assert 0.1 <= abs(turn.way[3]) <= 1.2
        assert 0.6 <= turn.duration <= 6.0
        lean = draw_lean(rng, 0.0, 1.0, rng.normal(size=3))
        assert (np.abs(lean.way[:3]) <= [0.35, 0.25, 0.04]).all()
        assert -0.14 < lean.way[5] <= 0.45
        assert abs(lean.way[4]) <= 0.225
        assert abs(lean.way[3]) <= 0.4
