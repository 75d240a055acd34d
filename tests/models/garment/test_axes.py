from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import AXES, turned
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.load import load_garment

JACKET = make_coat(COATS["jacket"], 0.06)


def write(path: Path, up: str) -> Path:
    x = JACKET.rest_position @ AXES[up]
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in x.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in JACKET.faces + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("up", AXES)
def test_axes_are_turned_and_never_mirrored(up: str) -> None:
    assert np.isclose(np.linalg.det(AXES[up]), 1.0)
    axis = np.array([[float(c == up[-1]) for c in "xyz"]]) * (-1.0 if up[0] == "-" else 1.0)
    assert np.array_equal(turned(axis, up), [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize("up", AXES)
def test_a_garment_is_the_same_with_any_axis_up(tmp_path: Path, up: str) -> None:
    mesh = load_garment(write(tmp_path / "coat.obj", up), unit="m", up=up)
    plain = load_garment(write(tmp_path / "plain.obj", "z"), unit="m")
    assert np.allclose(mesh.rest_position, plain.rest_position)
    assert np.array_equal(mesh.faces, plain.faces)
    assert all(np.array_equal(mesh.loops[name], plain.loops[name]) for name in plain.loops)


@pytest.mark.parametrize("up", [up for up in AXES if up != "z"])
@pytest.mark.parametrize("named", [False, True])
def test_a_wrong_axis_is_told_with_the_right_one(tmp_path: Path, up: str, named: bool) -> None:
    path = write(tmp_path / "coat.obj", up)
    loops = {name: loop.tolist() for name, loop in JACKET.loops.items()} if named else None
    with pytest.raises(UserError, match=f"with garment.mesh.up: {up} it would fit"):
        load_garment(path, unit="m", loops=loops)
