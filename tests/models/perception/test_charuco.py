"""A camera's pose from a board: exact without noise, and as sure as it says with it."""

import cv2
import numpy as np
import pytest

from drake_dress.models.perception.charuco import (
    Board,
    CalibrationError,
    Corners,
    Intrinsics,
    calibrate,
    find_corners,
    find_intrinsics,
)

BOARD = Board()
POINTS = np.asarray(BOARD.made().getChessboardCorners(), dtype=float)
LENS = Intrinsics(
    np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]]), np.zeros(5)
)


def pose(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    x = np.eye(4)
    x[:3, :3], x[:3, 3] = cv2.Rodrigues(np.asarray(turn, dtype=float))[0], shift
    return x


def scene(
    rng: np.random.Generator, count: int = 12, noise: float = 0.0, turning: float = 0.5
) -> tuple[np.ndarray, np.ndarray, list[Corners], np.ndarray]:
    """Returns X_WC, X_TB, corners and tools of so many pictures."""
    camera = pose(rng.uniform(-1.5, 1.5, 3), rng.uniform(-1.0, 1.0, 3))
    board = pose(rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.1, 0.1, 3))
    corners, tools = [], []
    for _ in range(count):
        at = [rng.uniform(-0.2, 0.05), rng.uniform(-0.15, 0.05), rng.uniform(0.6, 1.0)]
        seen = pose(rng.uniform(-turning, turning, 3), np.array(at))
        tools.append(camera @ seen @ np.linalg.inv(board))
        turn = cv2.Rodrigues(seen[:3, :3])[0]
        pixels, _ = cv2.projectPoints(POINTS, turn, seen[:3, 3], LENS.matrix, LENS.distortion)
        pixels = pixels.reshape(-1, 2)
        corners.append(Corners(POINTS, pixels + noise * rng.normal(size=pixels.shape)))
    return camera, board, corners, np.array(tools)


@pytest.mark.parametrize("seed", range(5))
def test_without_noise_poses_are_exact(seed: int) -> None:
    camera, board, corners, tools = scene(np.random.default_rng(seed))
    found = calibrate(corners, tools, LENS)
    np.testing.assert_allclose(found.camera, camera, atol=1e-6)
    np.testing.assert_allclose(found.board, board, atol=1e-6)
    assert found.rms < 1e-4


def test_errors_of_position_and_rotation_are_as_large_as_it_says() -> None:
    off = []
    for seed in range(40):
        camera, _, corners, tools = scene(np.random.default_rng(seed), noise=0.3)
        found = calibrate(corners, tools, LENS)
        assert found.rms == pytest.approx(0.3 * np.sqrt(2.0), rel=0.15)
        error = found.camera[:3, 3] - camera[:3, 3]
        turn = cv2.Rodrigues(found.camera[:3, :3] @ camera[:3, :3].T)[0].ravel()
        assert np.linalg.norm(error) < 5e-3
        off.append(np.concatenate([error / found.position_std, turn / found.rotation_std]))
    # 40 errors of a right deviation scatter by more than a third with less than 1 % chance an axis
    scatter = np.sqrt(np.mean(np.square(off), axis=0))
    assert (scatter > 1.0 / 1.4).all(), scatter
    assert (scatter < 1.4).all(), scatter


def test_a_corner_taken_for_another_hardly_matters() -> None:
    camera, _, corners, tools = scene(np.random.default_rng(3), noise=0.2)
    corners[2].pixels[5] += 60.0
    found = calibrate(corners, tools, LENS)
    np.testing.assert_allclose(found.camera[:3, 3], camera[:3, 3], atol=3e-3)
    assert int(np.argmax(found.residuals)) == 2


def test_too_few_pictures_or_too_much_alike_are_refused() -> None:
    rng = np.random.default_rng(0)
    _, _, corners, tools = scene(rng)
    with pytest.raises(CalibrationError, match="seen in 4 pictures"):
        calibrate(corners[:4], tools[:4], LENS)
    _, _, corners, tools = scene(rng, turning=1e-3)
    with pytest.raises(CalibrationError, match="turned about"):
        calibrate(corners, tools, LENS)


def test_intrinsics_are_found() -> None:
    _, _, corners, _ = scene(np.random.default_rng(1), count=20, noise=0.1)
    found = find_intrinsics(corners, 640, 480)
    np.testing.assert_allclose(found.matrix, LENS.matrix, atol=15.0)


def test_corners_are_found_in_a_picture_and_none_in_another() -> None:
    picture = BOARD.picture(60)
    canvas = np.full((480, 640), 128, dtype=np.uint8)
    canvas[60 : 60 + picture.shape[0], 80 : 80 + picture.shape[1]] = picture
    corners = find_corners(canvas, BOARD)
    assert corners is not None
    assert len(corners.points) == 24
    expected = corners.points[:, :2] / BOARD.square * 60.0 + [79.5, 59.5]
    np.testing.assert_allclose(corners.pixels, expected, atol=0.6)
    assert find_corners(np.full((480, 640), 128, dtype=np.uint8), BOARD) is None


def test_a_board_that_cannot_be_is_refused() -> None:
    with pytest.raises(CalibrationError, match="DICT_NONE"):
        Board(dictionary="DICT_NONE").made()
    with pytest.raises(CalibrationError, match="no such board"):
        Board(marker=0.05).made()
