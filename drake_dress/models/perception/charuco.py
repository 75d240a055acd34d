"""Calibrates the pose of a camera from pictures of a ChArUco board that an arm holds.

An arm holds the board in many poses; each picture shows the corners of the board at pixels

    u = π(K, d, X_CW X_WT(q) X_TB p_B)

with X_WT from the arm's joints. The camera's pose X_WC and the board's pose in the tool X_TB, which
is hard to measure, are those that fit all pixels best (least squares, robust against mismatched
corners). The initial guess comes from the board's pose in each picture and the closed form of Shah
(2013) for two unknown transforms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from drake_dress.models.arrays import FloatArray

Image = npt.NDArray[np.uint8]

# Fewest corners of a usable picture, fewest pictures, and least spread of their rotations about a
# second axis, rad.
LEAST_CORNERS, LEAST_PICTURES, LEAST_TURN = 6, 5, 0.15
# Residual beyond which a corner's influence is reduced, px.
_ROBUST = 1.0


class CalibrationError(ValueError):
    """The board is invalid, or no pose can be found from the pictures."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board: `columns` by `rows` squares of `square`, with markers of `marker`, m."""

    columns: int = 7
    rows: int = 5
    square: float = 0.03
    marker: float = 0.022
    dictionary: str = "DICT_4X4_50"

    def made(self) -> cv2.aruco.CharucoBoard:
        """Returns OpenCV's board.

        Raises:
            CalibrationError: there is no such dictionary, or no such board.
        """
        number = getattr(cv2.aruco, self.dictionary, None)
        # the module has other names than dictionaries
        if not self.dictionary.startswith("DICT_") or not isinstance(number, int):
            raise CalibrationError(f"dictionary {self.dictionary!r} is none of OpenCV's")
        if min(self.columns, self.rows) < 3 or not 0.0 < self.marker < self.square:
            raise CalibrationError(
                "no such board, expected 3 × 3 squares at least and markers smaller than squares"
            )
        dictionary = cv2.aruco.getPredefinedDictionary(number)
        needed, there = self.columns * self.rows // 2, len(dictionary.bytesList)
        if needed > there:
            raise CalibrationError(
                f"{self.columns} × {self.rows} squares need {needed} markers, of which "
                f"{self.dictionary} has {there}"
            )
        return cv2.aruco.CharucoBoard(
            (self.columns, self.rows), self.square, self.marker, dictionary
        )

    def picture(self, pixels_per_square: int) -> Image:
        """Returns an image of the board for printing, without a border."""
        size = (self.columns * pixels_per_square, self.rows * pixels_per_square)
        picture: Image = np.asarray(self.made().generateImage(size), dtype=np.uint8)
        return picture


@dataclass(frozen=True)
class Corners:
    """Corners of the board in one picture: (k,3) p_B, m, and (k,2) pixels."""

    points: FloatArray
    pixels: FloatArray


@dataclass(frozen=True)
class Intrinsics:
    """Intrinsics of a camera: K (3,3), pixels, and distortion (5,) as in OpenCV."""

    matrix: FloatArray
    distortion: FloatArray


@dataclass(frozen=True)
class CameraCalibration:
    """Result of a calibration.

    Attributes:
        camera: X_WC (4,4); z ahead, y down.
        board: X_TB (4,4) of the board in the tool.
        intrinsics: intrinsics that were given or found.
        residuals: of each picture, root mean square over its corners, px.
        rms: root mean square over all corners, px.
        position_std: standard deviation of p_WC (3,), m.
        rotation_std: standard deviation of the camera's rotation about the world's axes (3,), rad.
    """

    camera: FloatArray
    board: FloatArray
    intrinsics: Intrinsics
    residuals: FloatArray
    rms: float
    position_std: FloatArray
    rotation_std: FloatArray


def find_corners(image: Image, board: Board) -> Corners | None:
    """Returns the board's corners in a picture (h,w) or (h,w,3); None if they fix no pose."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    made = board.made()
    pixels, ids, _, _ = cv2.aruco.CharucoDetector(made).detectBoard(grey)
    if ids is None or len(ids) < LEAST_CORNERS:
        return None
    points = np.asarray(made.getChessboardCorners(), dtype=np.float64)[ids.ravel()]
    # corners on one line do not determine the pose
    if np.linalg.matrix_rank(points[:, :2] - points[0, :2], tol=1e-6) < 2:
        return None
    return Corners(points, np.asarray(pixels, dtype=np.float64).reshape(-1, 2))


def find_intrinsics(corners: Sequence[Corners], width: int, height: int) -> Intrinsics:
    """Returns the camera's intrinsics from pictures of the board."""
    _, matrix, distortion, _, _ = cv2.calibrateCamera(
        [c.points.astype(np.float32) for c in corners],
        [c.pixels.astype(np.float32) for c in corners],
        (width, height),
        None,
        None,
    )
    return Intrinsics(
        np.asarray(matrix, dtype=np.float64),
        np.asarray(distortion, dtype=np.float64).ravel()[:5],
    )


def calibrate(
    corners: Sequence[Corners], tools: FloatArray, intrinsics: Intrinsics
) -> CameraCalibration:
    """Returns the pose of the camera.

    Args:
        corners: corners in N pictures.
        tools: (N,4,4) X_WT of the tool that holds the board, in each picture.
        intrinsics: intrinsics of the camera.

    Raises:
        CalibrationError: there are too few pictures, their poses are too similar, or the board's
            pose in one of them cannot be found.
    """
    if len(corners) < LEAST_PICTURES:
        raise CalibrationError(
            f"the board is seen in {len(corners)} pictures, expected {LEAST_PICTURES} at least"
        )
    turns = tools[:, :3, :3] @ tools[0, :3, :3].T
    vectors = np.array([cv2.Rodrigues(r)[0].ravel() for r in turns])
    spread = np.linalg.svd(vectors - vectors.mean(axis=0), compute_uv=False)
    if spread[1] < LEAST_TURN:
        raise CalibrationError(
            "the board is turned about one axis alone, expected it to be turned about two"
        )
    first = np.concatenate(_first_guess(corners, tools, intrinsics))
    found = least_squares(
        lambda x: _residuals(x, corners, tools, intrinsics),
        first,
        loss="soft_l1",
        f_scale=_ROBUST,
        x_scale=np.tile([0.1] * 3 + [0.1] * 3, 2),
    )
    rest = _residuals(found.x, corners, tools, intrinsics)
    counts = [len(c.points) for c in corners]
    of_each = np.split(rest.reshape(-1, 2), np.cumsum(counts)[:-1])
    freedom = max(1, len(rest) - len(first))
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * float(rest @ rest) / freedom
    to_world = _camera_derivative(found.x[:6])
    std = np.sqrt(np.diag(to_world @ covariance[:6, :6] @ to_world.T))
    return CameraCalibration(
        camera=np.asarray(np.linalg.inv(_pose(found.x[:6])), dtype=np.float64),
        board=_pose(found.x[6:]),
        intrinsics=intrinsics,
        residuals=np.array([np.sqrt((r**2).sum(axis=1).mean()) for r in of_each]),
        rms=float(np.sqrt((rest.reshape(-1, 2) ** 2).sum(axis=1).mean())),
        position_std=std[3:6],
        rotation_std=std[:3],
    )


def _camera_derivative(x: FloatArray) -> FloatArray:
    """Returns (6,6) how X_WC moves with the parameters of X_CW: rotation about W's axes, p_WC.

    By central differences; `x` (6,) is the rotation vector and the translation of X_CW.
    """
    about = np.linalg.inv(_pose(x))
    columns = []
    for step in 1e-6 * np.eye(6):
        moved = []
        for sign in (1.0, -1.0):
            camera = np.linalg.inv(_pose(x + sign * step))
            # of a small rotation, which Rodrigues rounds to none: its skew part
            skew = camera[:3, :3] @ about[:3, :3].T
            turn = 0.5 * (skew - skew.T)[[2, 0, 1], [1, 2, 0]]
            moved.append(np.concatenate([turn, camera[:3, 3]]))
        columns.append((moved[0] - moved[1]) / 2e-6)
    return np.stack(columns, axis=1)


def _first_guess(
    corners: Sequence[Corners], tools: FloatArray, intrinsics: Intrinsics
) -> tuple[FloatArray, FloatArray]:
    """Returns X_CW and X_TB as (6,) rotation vectors and translations."""
    boards = []
    for seen in corners:
        ok, turn, shift = cv2.solvePnP(
            seen.points, seen.pixels, intrinsics.matrix, intrinsics.distortion
        )
        if not ok:
            raise CalibrationError("the board's pose in a picture cannot be found")
        boards.append(_pose(np.concatenate([turn.ravel(), shift.ravel()])))
    camera, board = _two_transforms(np.stack(boards), tools)
    return _packed(camera), _packed(board)


def _two_transforms(seen: FloatArray, tools: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns X_CW and X_TB (4,4) with seen_i ≈ X_CW tools_i X_TB (Shah 2013).

    Rotations: R_i R_TB' = R_CW T_i for all i, whose two unknowns are the left and right singular
    vectors of Σ T_i ⊗ R_i for its largest singular value. Positions then follow linearly.
    """
    both = sum(np.kron(t[:3, :3], r[:3, :3]) for t, r in zip(tools, seen, strict=True))
    u, _, vt = np.linalg.svd(both)
    # column-major
    r_cw = _nearest_rotation(u[:, 0].reshape(3, 3, order="F"))
    r_tb = _nearest_rotation(vt[0].reshape(3, 3, order="F")).T
    # t_i = R_CW T_i t_TB + R_CW p_i + t_CW
    rows = np.concatenate([np.hstack([r_cw @ t[:3, :3], np.eye(3)]) for t in tools])
    rest = np.concatenate([r[:3, 3] - r_cw @ t[:3, 3] for r, t in zip(seen, tools, strict=True)])
    shifts, *_ = np.linalg.lstsq(rows, rest, rcond=None)
    camera, board = np.eye(4), np.eye(4)
    camera[:3, :3], camera[:3, 3] = r_cw, shifts[3:]
    board[:3, :3], board[:3, 3] = r_tb, shifts[:3]
    return camera, board


def _nearest_rotation(matrix: FloatArray) -> FloatArray:
    """Returns the rotation nearest to a matrix whose sign may be wrong."""
    u, _, vt = np.linalg.svd(matrix * np.sign(np.linalg.det(matrix)))
    rotation: FloatArray = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return rotation


def _residuals(
    x: FloatArray, corners: Sequence[Corners], tools: FloatArray, intrinsics: Intrinsics
) -> FloatArray:
    """Returns the reprojection errors of all corners, (2K,) px."""
    camera, board = _pose(x[:6]), _pose(x[6:])
    rest = []
    for seen, tool in zip(corners, tools, strict=True):
        pose = _packed(camera @ tool @ board)
        pixels, _ = cv2.projectPoints(
            seen.points, pose[:3], pose[3:], intrinsics.matrix, intrinsics.distortion
        )
        rest.append(pixels.reshape(-1, 2) - seen.pixels)
    residuals: FloatArray = np.concatenate(rest).ravel()
    return residuals


def _pose(vector: FloatArray) -> FloatArray:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(vector[:3])[0]
    pose[:3, 3] = vector[3:]
    return pose


def _packed(pose: FloatArray) -> FloatArray:
    packed: FloatArray = np.concatenate([cv2.Rodrigues(pose[:3, :3])[0].ravel(), pose[:3, 3]])
    return packed
