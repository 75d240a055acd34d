import re
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import AXES, facings, orientation, turned
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.load import load_garment

JACKET = make_coat(COATS["jacket"], 0.06)


def write(path: Path, up: str, facing: str | None = None) -> Path:
    x = JACKET.rest_position @ orientation(up, facing)
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in x.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in JACKET.faces + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


ALL = [(up, facing) for up in AXES for facing in facings(up)]


def axis_of(name: str) -> np.ndarray:
    return np.array([[float(c == name[-1]) for c in "xyz"]]) * (-1.0 if name[0] == "-" else 1.0)


@pytest.mark.parametrize(("up", "facing"), ALL)
def test_axes_are_turned_and_never_mirrored(up: str, facing: str) -> None:
    assert np.isclose(np.linalg.det(orientation(up, facing)), 1.0)
    assert np.array_equal(turned(axis_of(up), up, facing), [[0.0, 0.0, 1.0]])
    assert np.array_equal(turned(axis_of(facing), up, facing), [[1.0, 0.0, 0.0]])
    assert np.array_equal(orientation(up), orientation(up, facings(up)[0]))


def test_all_ways_to_lie_are_different() -> None:
    assert len(ALL) == 24
    assert len({orientation(*axes).tobytes() for axes in ALL}) == 24


@pytest.mark.parametrize(("up", "facing"), ALL)
def test_a_garment_is_the_same_with_any_axes(tmp_path: Path, up: str, facing: str) -> None:
    mesh = load_garment(write(tmp_path / "coat.obj", up, facing), unit="m", up=up, facing=facing)
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


@pytest.mark.parametrize(("up", "facing"), [("z", "y"), ("y", "-x"), ("-x", "z")])
def test_a_wrong_direction_is_told_with_one_that_fits(tmp_path: Path, up: str, facing: str) -> None:
    path = write(tmp_path / "coat.obj", up, facing)
    with pytest.raises(UserError, match=r"with .*garment.mesh.facing: .* it would fit") as caught:
        load_garment(path, unit="m")
    told = dict(re.findall(r"garment\.mesh\.(up|facing): (-?[xyz])", str(caught.value)))
    load_garment(path, unit="m", up=told.get("up", "z"), facing=told["facing"])


def test_a_garment_cannot_face_up(tmp_path: Path) -> None:
    path = write(tmp_path / "coat.obj", "z")
    with pytest.raises(UserError, match="facing: is '-z', expected one of x, y, -y, -x with z up"):
        load_garment(path, unit="m", facing="-z")
