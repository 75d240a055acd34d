"""Parts of a file are taken or left out by name, size and place, alone or together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.garment.chosen import by_measure, by_name, chosen
from drake_dress.models.garment.files import RawMesh
from drake_dress.models.garment.load import load_garment
from tests.models.garment.test_parts import JACKET, write

CUBE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
# tetrahedra by name: where they are, m, and their size, m
PARTS = {
    "shirt": ((0.0, 0.0, 0.0), 0.6),
    "skirt": ((0.0, 0.0, -2.0), 0.5),
    "pin": ((1, 1, 1), 0.01),
}


def of_parts() -> RawMesh:
    position = np.concatenate([np.array(at) + size * CUBE for at, size in PARTS.values()])
    faces = np.concatenate([FACES + 4 * k for k in range(len(PARTS))])
    names = tuple((name,) for name in PARTS)
    part = np.repeat(np.arange(len(PARTS)), len(FACES))
    return RawMesh.of("file", position, faces, face_part=part, part_names=names)


def left(take: list[str], leave_out: list[str]) -> set[str]:
    entries = chosen(take, "take", "file"), chosen(leave_out, "leave_out", "file")
    mesh = by_measure(by_name(of_parts(), *entries), *entries)
    return {mesh.part_names[k][0] for k in mesh.face_part}


@pytest.mark.parametrize(
    ("take", "leave_out", "expected"),
    [
        ([], [], {"shirt", "skirt", "pin"}),
        (["shirt"], [], {"shirt"}),
        (["shirt", "pin"], [], {"shirt", "pin"}),
        ([">0.1 m"], [], {"shirt", "skirt"}),
        ([">55 cm"], [], {"shirt"}),
        (["near (0, 0, -1.5) m"], [], {"skirt"}),
        (["near(90,90,90)cm"], [], {"pin"}),
        (["pin", "near (0, 0, -1.5)"], [], {"pin", "skirt"}),
        ([">0.1 m"], ["skirt"], {"shirt"}),
        ([], ["<2cm", "near (0, 0, -2) m"], {"shirt"}),
        (["shirt", "skirt"], ["<0.55 m"], {"shirt"}),
    ],
)
def test_parts_are_taken_without_those_left_out(
    take: list[str], leave_out: list[str], expected: set[str]
) -> None:
    assert left(take, leave_out) == expected


@given(st.sets(st.sampled_from(list(PARTS))))
def test_taking_some_is_leaving_the_others_out(names: set[str]) -> None:
    others = [name for name in PARTS if name not in names]
    if names:
        assert left(sorted(names), []) == left([], others) == names
    else:
        with pytest.raises(UserError, match="leave_out: leaves nothing"):
            left([], others)


@pytest.mark.parametrize("text", ["<", "> big", "near (1, 2)", "near (a, b, c) m", "<-1 m", "<0 m"])
def test_what_is_neither_size_nor_place_is_told(text: str) -> None:
    with pytest.raises(UserError, match=r"take\[1\]: is .*, expected a name, a size such as"):
        chosen(["shirt", text], "take", "file")


def test_nothing_taken_is_told() -> None:
    with pytest.raises(UserError, match="take: leaves nothing"):
        left([">9 m"], [])
    with pytest.raises(UserError, match=r"take\[0\]: names 'short', .* 'shirt' perhaps"):
        left(["short"], [])


@pytest.mark.parametrize("named", [True, False])
def test_of_two_garments_the_message_says_how_to_take_one(tmp_path: Path, named: bool) -> None:
    skirt = JACKET.rest_position * [0.8, 0.5, 0.8] - [0.0, 0.0, 0.9]
    parts = [("Jacket", JACKET.rest_position, JACKET.faces), ("Skirt", skirt, JACKET.faces)]
    path = write(tmp_path / "suit.obj", parts)
    if not named:
        lines = path.read_text().splitlines()
        path.write_text("\n".join(line for line in lines if line[0] != "o") + "\n")
    with pytest.raises(UserError, match=r"garment.mesh.take: \['.*'\] takes the first") as caught:
        load_garment(path, unit="m")
    entry = str(caught.value).split("garment.mesh.take: ['")[1].split("']")[0]
    assert (entry == "Jacket") == named
    mesh = load_garment(path, unit="m", take=[entry])
    assert len(mesh.faces) == len(JACKET.faces)
    np.testing.assert_allclose(np.ptp(mesh.rest_position, 0), np.ptp(JACKET.rest_position, 0))
