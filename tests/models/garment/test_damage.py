"""A damaged file is refused in one line, or still gives a garment: nothing in between."""

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.files import RawMesh
from drake_dress.models.garment.load import load_garment
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.plausible import check_plausible

COATS_AT = {(name, s): make_coat(COATS[name], s) for name in COATS for s in (0.03, 0.06)}
JACKET = COATS_AT["jacket", 0.06]
LINES = [f"v {a:.6f} {b:.6f} {c:.6f}" for a, b, c in JACKET.rest_position]
LINES += [f"f {a} {b} {c}" for a, b, c in JACKET.faces + 1]


def mesh_or_refusal(path: Path) -> GarmentMesh | None:
    begin = time.perf_counter()
    try:
        mesh = load_garment(path, unit="m")
    except UserError as error:
        assert str(error).startswith(str(path))
        assert "\n" not in str(error)
        return None
    finally:
        assert time.perf_counter() - begin < 10.0
    mesh.validate()
    check_plausible(RawMesh.of("coat", mesh.rest_position, mesh.faces.astype(np.int64)))
    assert len(mesh.faces) > 0.98 * len(JACKET.faces)
    return mesh


@settings(max_examples=60)
@given(st.data())
def test_damaged_lines_are_refused_or_do_no_harm(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    lines = list(LINES)
    for _ in range(data.draw(st.integers(1, 3))):
        if not lines:
            break
        at = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["drop", "twice", "cut", "swap", "sign", "digit", "end"]))
        if kind == "drop":
            del lines[at]
        elif kind == "twice":
            lines.insert(at, lines[at])
        elif kind == "cut":
            lines[at] = lines[at][: data.draw(st.integers(0, len(lines[at])))]
        elif kind == "swap":
            other = data.draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
        elif kind == "sign":
            lines[at] = lines[at].replace("-", "", 1)
        elif kind == "digit":
            place = data.draw(st.integers(0, max(len(lines[at]) - 1, 0)))
            digit = data.draw(st.sampled_from("0123456789.-e/# x"))
            lines[at] = lines[at][:place] + digit + lines[at][place + 1 :]
        else:
            del lines[max(at, 1) :]
    path = tmp_path_factory.mktemp("damage") / "coat.obj"
    path.write_text("\n".join(lines) + "\n")
    mesh_or_refusal(path)


@pytest.mark.parametrize("by", [1, -1, 2])
@pytest.mark.parametrize("coat", COATS_AT)
def test_shifted_node_numbers_are_told(coat: tuple[str, float], by: int) -> None:
    mesh = COATS_AT[coat]
    shifted = RawMesh.of("coat", np.roll(mesh.rest_position, by, axis=0), mesh.faces.astype(int))
    with pytest.raises(UserError, match="node numbers shifted by a missing line"):
        check_plausible(shifted)
    check_plausible(RawMesh.of("coat", mesh.rest_position, mesh.faces.astype(int)))


@settings(max_examples=40)
@given(st.integers(0, len(JACKET.rest_position) - 1), st.floats(0.4, 50.0), st.integers(0, 2))
def test_a_node_that_is_thrown_off_is_named(node: int, far: float, axis: int) -> None:
    position = JACKET.rest_position.copy()
    position[node, axis] += far
    with pytest.raises(UserError, match=rf"node {node} "):
        check_plausible(RawMesh.of("coat", position, JACKET.faces.astype(np.int64)))
