from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.load import load_garment

JACKET = make_coat(COATS["jacket"], 0.06)
BUTTON = np.array([[0.1, 0.0, -0.2], [0.11, 0.0, -0.2], [0.1, 0.01, -0.2]])


def write(path: Path, parts: Sequence[tuple[str, FloatArray, IntArray]]) -> Path:
    """An OBJ of named parts, each of positions and faces."""
    lines, n = [], 0
    for name, x, faces in parts:
        lines.append(f"o {name}")
        lines += [f"v {a} {b} {c}" for a, b, c in x]
        lines += [f"f {a} {b} {c}" for a, b, c in faces + 1 + n]
        n += len(x)
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def buttoned(tmp_path: Path) -> Path:
    jacket = ("Jacket", JACKET.rest_position, JACKET.faces)
    return write(tmp_path / "coat.obj", [jacket, ("Button", BUTTON, np.array([[0, 1, 2]]))])


def refusal(path: Path, **kwargs: Any) -> str:
    with pytest.raises(UserError) as caught:
        load_garment(path, unit="m", **kwargs)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_loose_part_is_told_with_size_place_and_remedy(buttoned: Path) -> None:
    message = refusal(buttoned)
    assert "2 separate parts" in message
    assert "3 nodes 1.0 cm wide at (0.10, 0.00, -0.20) m" in message
    assert "from the first (Button)" in message
    assert "garment.mesh.leave_out: ['<0.02 m']" in message
    assert "weld" not in message


@pytest.mark.parametrize("leave_out", [["Button"], ["<0.02 m"], ["<2cm"], ["<0.02"], ["< 20 mm"]])
def test_what_is_left_out_leaves_the_garment_as_it_was(
    tmp_path: Path, buttoned: Path, leave_out: list[str]
) -> None:
    alone = write(tmp_path / "j.obj", [("Jacket", JACKET.rest_position, JACKET.faces)])
    mesh, plain = (
        load_garment(buttoned, unit="m", leave_out=leave_out),
        load_garment(alone, unit="m"),
    )
    assert np.array_equal(mesh.rest_position, plain.rest_position)
    assert np.array_equal(mesh.faces, plain.faces)


def test_wrong_names_and_sizes_are_told(buttoned: Path) -> None:
    assert "leave_out[0]: names 'Buton'" in refusal(buttoned, leave_out=["Buton"])
    assert "'Button' perhaps" in refusal(buttoned, leave_out=["Buton"])
    assert "one of Jacket, Button" in refusal(buttoned, leave_out=["xyz"])
    assert "leave_out[0]: is '<big'" in refusal(buttoned, leave_out=["<big"])
    assert "leaves nothing" in refusal(buttoned, leave_out=["<9 m"])
    assert "leaves nothing" in refusal(buttoned, leave_out=["Jacket", "Button"])


@pytest.mark.parametrize("gap", [2e-6, 4e-4])
def test_open_seams_are_told_with_the_distance_that_sews_them(tmp_path: Path, gap: float) -> None:
    x, faces = JACKET.rest_position, JACKET.faces
    left = x[faces].mean(axis=1)[:, 1] > 0
    parts = []
    for name, side, move in (("Left", left, gap), ("Right", ~left, 0.0)):
        own, local = np.unique(faces[side], return_inverse=True)
        parts.append((name, x[own] + [0.0, move, 0.0], local.reshape(-1, 3).astype(np.int32)))
    path = write(tmp_path / "halves.obj", parts)
    message = refusal(path)
    assert f"garment.mesh.weld: {1e-5 if gap < 1e-5 else 1e-3:g} joins them" in message
    assert len(load_garment(path, unit="m", weld=1e-3).rest_position) == len(x)
    assert "weld: is 0.5 m" in refusal(path, weld=0.5)
