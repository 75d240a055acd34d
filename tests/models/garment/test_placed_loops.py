"""Loops named by places and planes are those that are named by nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import orientation
from drake_dress.models.garment.load import MeshOptions, WholeGarment, read_garment
from drake_dress.models.garment.mesh import loop_length
from tests.models.garment.test_axes import JACKET, write

X = JACKET.rest_position


def center(name: str) -> np.ndarray:
    return np.asarray(X[JACKET.loops[name]].mean(axis=0))


def said(point: np.ndarray) -> str:
    return "({:.4f}, {:.4f}, {:.4f})".format(*point)


def read(path: Path, up: str, loops: dict[str, str]) -> WholeGarment:
    return read_garment(path, MeshOptions(up=up, loops=dict(loops)))


@pytest.mark.parametrize("up", ["z", "-y"])
def test_places_name_cuffs_and_armholes(tmp_path: Path, up: str) -> None:
    path = write(tmp_path / "coat.obj", up)
    axes = orientation(up)
    loops = {
        f"{side}_cuff": f"near {said(center(f'{side}_cuff') @ axes)} m"
        for side in ("left", "right")
    }
    for side in ("left", "right"):
        point = 0.9 * center(f"{side}_armhole") + 0.1 * center(f"{side}_cuff")
        nearest = X[np.argmin(np.linalg.norm(X - point - [0.1, 0.0, 0.0], axis=1))]
        loops[f"{side}_armhole"] = f"near {said(nearest @ axes)}"
    whole = read(path, up, loops)
    for side in ("left", "right"):
        cuff, armhole = (whole.loops[f"{side}_{end}"] for end in ("cuff", "armhole"))
        assert loop_length(whole.position, cuff) == pytest.approx(
            loop_length(X, JACKET.loops[f"{side}_cuff"]), rel=1e-6
        )
        middle = whole.position[armhole].mean(axis=0)
        assert np.linalg.norm(middle - center(f"{side}_armhole")) < 0.12
        girth = loop_length(X, JACKET.loops[f"{side}_armhole"])
        assert 0.6 * girth < loop_length(whole.position, armhole) < 1.2 * girth
    whole.mesh().validate()
    whole.at_spacing(0.05).validate()


def test_a_plane_names_an_armhole(tmp_path: Path) -> None:
    path = write(tmp_path / "coat.obj", "z")
    point = 0.7 * center("left_armhole") + 0.3 * center("left_cuff")
    whole = read(path, "z", {"left_armhole": f"plane {said(point)} m, (0, 1, -0.4)"})
    off = (whole.position[whole.loops["left_armhole"]] - point) @ [0.0, 1.0, -0.4]
    assert np.abs(off).max() < 0.02
    # the other one is found as before
    plain = read(path, "z", {})
    np.testing.assert_array_equal(whole.loops["right_armhole"], plain.loops["right_armhole"])


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("left_cuff", "there", "loops.left_cuff: is 'there', expected a list of nodes or 'near"),
        ("left_cuff", "plane (0, 0, 0) m, (1, 0, 0)", "expected a list of nodes or 'near"),
        ("left_armhole", "near (9, 0, 0) m", "the point is .* m off the garment, which reaches"),
        ("left_armhole", "plane (0.1, 0.2, -0.5) m, (0, 0, 1)", "cuts no closed line"),
        ("left_armhole", "near (1, 2)", "'plane"),
    ],
)
def test_what_names_no_loop_is_told(tmp_path: Path, name: str, text: str, expected: str) -> None:
    path = write(tmp_path / "coat.obj", "z")
    with pytest.raises(UserError, match=expected):
        read(path, "z", {name: text})
