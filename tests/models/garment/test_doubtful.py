"""Openings that cannot be right are refused with their kind, their place and the key."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import orientation
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.load import MeshOptions, WholeGarment, read_garment
from drake_dress.models.garment.mesh import loop_length
from tests.models.garment.changed import (
    JACKET,
    Surface,
    capped,
    center,
    flat_gown,
    in_sleeve,
    of,
    sleeves_turned,
    without,
    written,
)


def vest() -> Surface:
    return without(of(JACKET), in_sleeve(JACKET, "left") | in_sleeve(JACKET, "right"))


def cape() -> Surface:
    whole = vest()
    for side in ("left", "right"):
        whole = capped(whole, center(JACKET, f"{side}_armhole"))
    return whole


def one_sleeve(close: bool) -> Surface:
    half = without(of(JACKET), in_sleeve(JACKET, "right"))
    return capped(half, center(JACKET, "right_armhole")) if close else half


def one_mitten() -> Surface:
    return capped(of(JACKET), center(JACKET, "right_cuff"))


def one_short_sleeve() -> Surface:
    start, end = center(JACKET, "right_armhole"), center(JACKET, "right_cuff")
    along = (JACKET.rest_position - start) @ (end - start) / np.sum((end - start) ** 2)
    lost = in_sleeve(JACKET, "right") & (along[JACKET.faces].mean(axis=1) > 0.5)
    return without(of(JACKET), lost)


def refusal(path: Path, surface: Surface, up: str, **options: object) -> str:
    written(path, surface, orientation(up))
    with pytest.raises(UserError) as caught:
        read_garment(path, MeshOptions(up=up, **options))  # type: ignore[arg-type]
    message = str(caught.value)
    assert "\n" not in message
    assert " … " not in message  # nothing was cut out of the line
    return message


FAULTS: list[tuple[Callable[[], Surface], str]] = [
    (vest, r"no sleeve.* \(is it a vest\?\).*garment.mesh.loops.left_armhole"),
    (cape, r"no cuffs found at left and right.*vests and capes have none"),
    (lambda: one_sleeve(close=True), r"unlike|one side only|no cuffs"),
    (lambda: one_sleeve(close=False), r"unlike|no sleeve"),
    (one_mitten, r"a cuff at one side only.*is the right sleeve missing or closed"),
    (one_short_sleeve, r"left and right are unlike.*found is 0\.\d\d m around at"),
    (lambda: sleeves_turned(JACKET, 40.0), r"runs toward the hip|no sleeve stands out"),
]


@pytest.mark.parametrize("up", ["z", "-y"])
@pytest.mark.parametrize(("make", "expected"), FAULTS)
def test_the_fault_is_named(
    tmp_path: Path, make: Callable[[], Surface], expected: str, up: str
) -> None:
    message = refusal(tmp_path / "coat.obj", make(), up)
    assert re.search(expected, message), message
    assert "it would fit" not in message


@pytest.mark.parametrize("make", [vest, one_short_sleeve, one_mitten])
def test_the_place_is_on_the_opening_in_the_files_axes(
    tmp_path: Path, make: Callable[[], Surface]
) -> None:
    surface, up = make(), "-y"
    message = refusal(tmp_path / "coat.obj", surface, up)
    found = re.findall(r"at \((-?\d+\.\d+), (-?\d+\.\d+), (-?\d+\.\d+)\) m", message)
    assert found
    for words in found:
        point = orientation(up) @ np.array([float(word) for word in words])
        # inside an opening: within an armhole's radius of the cloth
        assert np.linalg.norm(surface[0] - point, axis=1).min() < 0.15


def test_named_loops_are_not_judged(tmp_path: Path) -> None:
    path = written(tmp_path / "coat.obj", one_short_sleeve())
    with pytest.raises(UserError, match="unlike"):
        read_garment(path, MeshOptions())
    start, end = center(JACKET, "right_armhole"), center(JACKET, "right_cuff")
    places = {
        "left_cuff": center(JACKET, "left_cuff"),
        "right_cuff": 0.5 * (start + end),
        "right_armhole": 0.85 * start + 0.15 * end + [0.09, 0.0, 0.0],
    }
    loops = {name: f"near {tuple(point.round(3).tolist())}" for name, point in places.items()}
    whole = read_garment(path, MeshOptions(loops=loops))
    whole.mesh().validate()


@pytest.mark.parametrize("spacing", [0.02, 0.06])
@pytest.mark.parametrize(
    "measures",
    [
        CoatParameters(),
        COATS["overcoat"],
        CoatParameters(body_length=0.45, chest=0.9, shoulder_width=0.36, armhole_girth=0.44),
        CoatParameters(sleeve_length=0.4, armhole_girth=0.62, cuff_girth=0.5),
        CoatParameters(armhole_girth=0.7, cuff_girth=0.29, chest=1.5, shoulder_width=0.55),
    ],
)
def test_coats_of_all_measures_are_accepted(
    tmp_path: Path, measures: CoatParameters, spacing: float
) -> None:
    coat = make_coat(measures, spacing)
    whole = read_garment(written(tmp_path / "coat.obj", of(coat)), MeshOptions())
    for side in ("left", "right"):
        girth = loop_length(whole.position, whole.loops[f"{side}_armhole"])
        assert girth < 1.35 * measures.armhole_girth
        off = whole.position[whole.loops[f"{side}_armhole"]].mean(axis=0) - center(
            coat, f"{side}_armhole"
        )
        assert np.linalg.norm(off) < 0.06


def gown(tmp_path: Path, up: str, facing: str | None) -> WholeGarment:
    axes = orientation(up, facing)
    path = written(tmp_path / "gown.obj", flat_gown(), axes)
    return read_garment(path, MeshOptions(up=up, facing=facing))


@pytest.mark.parametrize(("up", "facing"), [("z", None), ("-y", None), ("x", "-z")])
def test_sleeves_that_stand_out_of_a_flat_body_are_found(
    tmp_path: Path, up: str, facing: str | None
) -> None:
    whole = gown(tmp_path, up, facing)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        cuff, armhole = (whole.position[whole.loops[f"{side}_{e}"]] for e in ("cuff", "armhole"))
        assert np.allclose(cuff.mean(axis=0), [0.22, 0.2 * sign, 0.0], atol=0.02)
        assert np.allclose(armhole.mean(axis=0)[1:], [0.2 * sign, 0.0], atol=0.03)
        assert 0.02 < armhole[:, 0].mean() < 0.12
        girth = loop_length(whole.position, whole.loops[f"{side}_armhole"])
        assert 0.38 < girth < 0.8
    whole.at_spacing(0.04).validate()
