from __future__ import annotations

import numpy as np
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.models.perception.pulls import (
    Outline,
    Pulls,
    PullSettings,
    joined,
    out_of_free_space,
    to_points,
)

BALL = trimesh.creation.icosphere(subdivisions=4, radius=0.4)
X, FACES = np.array(BALL.vertices), np.array(BALL.faces, dtype=np.int32)
# looks along +x at the origin, from 2 m away; its columns run along -y, its rows along -z
CAMERA = Pinhole(
    160,
    120,
    150.0,
    np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    np.array([-2.0, 0.0, 0.0]),
)
SETTINGS = PullSettings()


def points_of(offset: np.ndarray) -> np.ndarray:
    """Points on the near side of the ball, moved."""
    middle = X[FACES].mean(axis=1)
    return middle[middle[:, 0] < -0.2][::7] + offset


def along_and_across(pulls: Pulls) -> tuple[slice, slice]:
    count = len(pulls.residual) // 4
    return slice(0, count), slice(count, 4 * count)


@given(st.tuples(*[st.floats(-0.02, 0.02)] * 3))
def test_moving_the_mesh_to_the_points_leaves_nothing_to_pull(off: tuple[float, ...]) -> None:
    offset = np.array(off)
    pulls = to_points(CAMERA, points_of(offset), X, FACES, 0.1, SETTINGS)
    along, across = along_and_across(pulls)
    left = pulls.residual - pulls.matrix @ np.tile(offset, len(X))
    # the nearest place is another one by the slide along the ball, whose radius is 0.4 m
    slide = np.linalg.norm(offset) ** 2 / 0.4 + 1.5e-3
    assert np.abs(left[along]).max() < slide
    assert (np.abs(pulls.residual[along]) <= np.linalg.norm(offset) + 1e-9).all()
    assert pulls.weight[across].max() <= SETTINGS.across * pulls.weight[along].max() + 1e-9


def test_points_pull_only_what_their_camera_sees() -> None:
    behind = points_of(np.zeros(3)) * [-1.0, 1.0, 1.0]
    assert len(to_points(CAMERA, behind, X, FACES, 0.1, SETTINGS).residual) == 0
    pulls = to_points(CAMERA, points_of(np.zeros(3)), X, FACES, 0.1, SETTINGS)
    pulled = np.unique(pulls.matrix.indices // 3)
    assert X[pulled, 0].max() < 0.0


def test_points_out_of_reach_do_not_pull_and_far_ones_pull_weakly() -> None:
    near, far = (
        to_points(CAMERA, points_of(np.array([-d, 0.0, 0.0])), X, FACES, 0.1, SETTINGS)
        for d in (0.005, 0.08)
    )
    assert len(far.residual) > 0
    assert np.median(far.weight) < 0.25 * np.median(near.weight)
    none = to_points(CAMERA, points_of(np.array([-0.5, 0.0, 0.0])), X, FACES, 0.1, SETTINGS)
    assert len(none.residual) == 0
    assert len(to_points(CAMERA, np.zeros((0, 3)), X, FACES, 0.1, SETTINGS).residual) == 0


def seen_at(columns: slice) -> tuple[np.ndarray, np.ndarray]:
    """Depth and garment of an image whose garment is in these columns, before a far wall."""
    depth, garment = np.full((120, 160), 4.0), np.zeros((120, 160), dtype=bool)
    garment[40:80, columns] = True
    depth[garment] = 2.0
    return depth, garment


@given(st.integers(0, 30), st.integers(130, 159))
def test_a_node_that_is_seen_through_is_pulled_to_the_garment_in_the_image(
    first: int, last: int
) -> None:
    depth, garment = seen_at(slice(first, 60))
    depth2, garment2 = seen_at(slice(100, last))
    # a node in the middle of the image, between both
    node = np.array([[0.0, 0.0, 0.0]])
    for d, g, sign in ((depth, garment, 1.0), (depth2, garment2, -1.0)):
        pulls = out_of_free_space(CAMERA, d, Outline.of(g), node, SETTINGS)
        assert len(pulls.residual) == 2
        # columns to the left lie toward +y
        moved = pulls.matrix.T @ pulls.residual
        assert moved[0] == 0.0
        assert sign * moved[1] > 0.1
        assert np.linalg.norm(moved) <= SETTINGS.through_reach + 1e-9


def test_a_node_that_is_hidden_or_on_the_garment_is_not_seen_through() -> None:
    depth, garment = seen_at(slice(20, 60))
    person = np.where(garment, depth, 1.5)
    node = np.array([[0.0, 0.0, 0.0], [-9.0, 0.0, 0.0]])
    assert len(out_of_free_space(CAMERA, person, Outline.of(garment), node, SETTINGS).residual) == 0
    on = np.array([[0.0, 0.5, 0.0]])
    assert len(out_of_free_space(CAMERA, depth, Outline.of(garment), on, SETTINGS).residual) == 0
    nowhere = np.zeros_like(garment)
    assert len(out_of_free_space(CAMERA, depth, Outline.of(nowhere), node, SETTINGS).residual) == 0


def test_equations_are_joined_in_their_order() -> None:
    one = to_points(CAMERA, points_of(np.array([0.01, 0.0, 0.0])), X, FACES, 0.1, SETTINGS)
    both = joined([one, one], len(X))
    assert both.matrix.shape == (2 * len(one.residual), 3 * len(X))
    np.testing.assert_array_equal(both.residual, np.tile(one.residual, 2))
    assert joined([], 5).matrix.shape == (0, 15)
