"""Camera pose from pictures of a board in a gripper: `drake-dress calibrate`."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.sections.station import placement
from drake_dress.errors import UserError
from drake_dress.file_output import write_bytes, write_text
from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.perception.charuco import (
    LEAST_CORNERS,
    LEAST_PICTURES,
    Board,
    CalibrationError,
    CameraCalibration,
    Corners,
    Intrinsics,
    calibrate,
    find_corners,
    find_intrinsics,
)
from drake_dress.models.sides import Side
from drake_dress.text_file import read_text

POSES = "poses.csv"
_HEADER = ["image", *(f"q{i}" for i in range(1, 8))]


def calibrate_camera(
    directory: Path,
    scenario: Scenario,
    source: Path,
    side: Side,
    board: Board,
    camera: str | None,
    out: Path,
) -> None:
    """Finds the pose of a camera, writes it as JSON and prints it.

    Args:
        directory: with `poses.csv` (image, q1 … q7 in rad) and the pictures it names.
        scenario: with the placement of the arm.
        source: its file, for messages.
        side: of the arm that holds the board.
        board: the board that the arm holds.
        camera: name of the scenario's camera whose intrinsics are used; when None, they are
            estimated from the pictures.
        out: file to write.

    Raises:
        UserError: a file cannot be used, or no pose can be found.
    """
    where = placement(scenario.station.arms, scenario.person, scenario.station.side)
    if where is None:
        raise UserError(str(source), "station.arms.model", "is floating, expected panda")
    arm = panda(where.base(side))
    rows = _poses(directory / POSES)
    seen: list[Corners] = []
    tools: list[np.ndarray] = []
    names: list[str] = []
    size = (0, 0)
    for name, q in rows:
        image = _picture(directory / name)
        if size != (0, 0) and (image.shape[1], image.shape[0]) != size:
            raise UserError(
                str(directory / name),
                "",
                f"is {image.shape[1]} × {image.shape[0]} pixels, expected {size[0]} × {size[1]} "
                "as the first",
            )
        size = (image.shape[1], image.shape[0])
        corners = find_corners(image, board)
        if corners is not None:
            seen.append(corners)
            tools.append(arm.links(q)[-1])
            names.append(name)
    try:
        intrinsics = _intrinsics(scenario, source, camera, seen, size)
        found = calibrate(seen, np.array(tools).reshape(-1, 4, 4), intrinsics)
    except CalibrationError as error:
        hint = f"; {len(rows) - len(seen)} of {len(rows)} show fewer than {LEAST_CORNERS} corners"
        raise UserError(str(directory), "", f"{error}{hint}") from error
    write_text(out, json.dumps(_written(found, names, size), indent=2) + "\n")
    _tell(found, names, len(rows))
    print(f"calibration: {out}")


def _picture(path: Path) -> np.ndarray:
    # OpenCV would block on a named pipe without a writer.
    image = cv2.imread(str(path)) if os.path.isfile(path) else None
    if image is None:
        raise UserError(str(path), "", "is no readable picture")
    return np.asarray(image, dtype=np.uint8)


def write_board(board: Board, path: Path) -> None:
    """Writes a picture of a board, to be printed at 600 dots per inch.

    Raises:
        UserError: there is no such board, or it cannot be written.
    """
    try:
        picture = board.picture(round(board.square / 0.0254 * 600))
    except CalibrationError as error:
        raise UserError("--board", "", str(error)) from error
    try:
        made, data = cv2.imencode(path.suffix, picture)
    except cv2.error:
        made = False
    if not made:
        raise UserError(str(path), "", "cannot be written as a picture, expected a .png")
    write_bytes(path, data.tobytes())
    print(f"board: {path}, to print at 600 dpi; a square is {1e3 * board.square:g} mm")


def parse_board(text: str) -> Board:
    """Returns the board described by COLUMNSxROWS:SQUARE:MARKER:DICTIONARY; lengths are in m.

    Raises:
        UserError: the text describes no board.
    """
    try:
        size, square, marker, dictionary = text.split(":")
        columns, rows = size.split("x")
        board = Board(int(columns), int(rows), float(square), float(marker), dictionary)
    except ValueError:
        raise UserError(
            "--board",
            text,
            "expected COLUMNSxROWS:SQUARE:MARKER:DICTIONARY, such as 7x5:0.03:0.022:DICT_4X4_50",
        ) from None
    try:
        board.made()
    except CalibrationError as error:
        raise UserError("--board", text, str(error)) from error
    return board


def _poses(path: Path) -> list[tuple[str, np.ndarray]]:
    text = read_text(path, f"a table {','.join(_HEADER)}")
    try:
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise UserError(str(path), "", f"cannot be read as CSV: {error}") from error
    if not lines or [word.strip() for word in lines[0]] != _HEADER:
        raise UserError(str(path), "line 1", f"expected {','.join(_HEADER)}")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        if not line:
            continue
        try:
            q = np.array([float(word) for word in line[1:]])
        except ValueError:
            q = np.array([np.nan])
        if q.shape != (7,) or not np.isfinite(q).all():
            raise UserError(str(path), f"line {number}", "expected a picture and 7 joints in rad")
        if np.any((q < LIMITS.lower - 0.01) | (q > LIMITS.upper + 0.01)):
            raise UserError(
                str(path), f"line {number}", "joints beyond their limits; expected rad, not degrees"
            )
        rows.append((line[0].strip(), q))
    return rows


def _intrinsics(
    scenario: Scenario,
    source: Path,
    camera: str | None,
    seen: list[Corners],
    size: tuple[int, int],
) -> Intrinsics:
    if camera is None:
        if len(seen) < 3:
            raise CalibrationError(
                f"the board is seen in {len(seen)} pictures, expected {LEAST_PICTURES} at least"
            )
        return find_intrinsics(seen, *size)
    for c in scenario.station.cameras:
        if c.name == camera:
            if (c.width, c.height) != size:
                raise UserError(
                    str(source),
                    "station.cameras",
                    f"{camera} has {c.width} × {c.height} pixels, its pictures {size[0]} × "
                    f"{size[1]}",
                )
            # same definition as Drake's CameraInfo
            focal = 0.5 * c.height / math.tan(0.5 * math.radians(c.fov_deg))
            matrix = np.array(
                [[focal, 0.0, 0.5 * c.width - 0.5], [0.0, focal, 0.5 * c.height - 0.5], [0, 0, 1.0]]
            )
            return Intrinsics(matrix, np.zeros(5))
    raise UserError(str(source), "station.cameras", f"has no camera {camera!r}")


def _written(found: CameraCalibration, names: list[str], size: tuple[int, int]) -> dict[str, Any]:
    return {
        "schema": "drake_dress.calibration/1",
        "position": found.camera[:3, 3].tolist(),
        "rotation": found.camera[:3, :3].tolist(),
        "position_std": found.position_std.tolist(),
        "rotation_std": found.rotation_std.tolist(),
        "camera_matrix": found.intrinsics.matrix.tolist(),
        "distortion": found.intrinsics.distortion.tolist(),
        "width": size[0],
        "height": size[1],
        "board_in_tool": found.board.tolist(),
        "rms_px": found.rms,
        "residual_px": dict(zip(names, found.residuals.tolist(), strict=True)),
    }


def _tell(found: CameraCalibration, names: list[str], count: int) -> None:
    table = Table("picture", "residual, px")
    for name, rest in zip(names, found.residuals, strict=True):
        table.add_row(name, f"{rest:.2f}")
    console = Console()
    console.print(table)
    p, std = found.camera[:3, 3], 1e3 * found.position_std
    print(f"board seen in {len(names)} of {count} pictures, {found.rms:.2f} px")
    print(f"camera at {p[0]:.4f}, {p[1]:.4f}, {p[2]:.4f} m")
    print(f"  ± {std[0]:.1f}, {std[1]:.1f}, {std[2]:.1f} mm")
    print(f"  ± {math.degrees(float(found.rotation_std.max())):.3f}° about its worst axis")
