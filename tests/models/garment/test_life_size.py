"""The unit is found by the shoulders, and a garment that is not life size is told."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.life_size import ADULT, UNITS, shoulder_width, units_that_fit
from drake_dress.models.garment.load import MeshOptions, WholeGarment, read_garment
from tests.models.garment.test_load import write_obj

COAT = make_coat(COATS["jacket"], 0.06)
WIDTH = shoulder_width(COAT.rest_position, COAT.loops)


def written(folder: Path, factor: float) -> Path:
    return write_obj(folder / "coat.obj", factor * COAT.rest_position, COAT.faces)


def read(path: Path, **options: object) -> WholeGarment:
    return read_garment(path, MeshOptions(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("size", [0.85, 1.0, 1.2])
def test_unit_is_found_by_the_shoulders_and_told(tmp_path: Path, unit: str, size: float) -> None:
    path = written(tmp_path, size / UNITS[unit])
    whole = read(path, unit="auto")
    assert np.ptp(whole.position[:, 2]) == pytest.approx(
        size * np.ptp(COAT.rest_position[:, 2]), rel=1e-9
    )
    assert whole.notes[0].startswith(f"the unit is {unit}, in which the shoulders are")
    assert read(path, unit=unit).notes == ()


@pytest.mark.parametrize("factor", [1.7, 0.4, 17.0, 0.17])
@pytest.mark.parametrize("unit", ["auto", "m"])
def test_what_is_not_life_size_is_told_with_a_scale_that_fits(
    tmp_path: Path, factor: float, unit: str
) -> None:
    path = written(tmp_path, factor)
    if unit == "auto" and any(
        0.2 <= factor * WIDTH * UNITS[u] <= 0.7 for u in units_that_fit(factor * 1.3)
    ):
        assert read(path, unit="auto").notes
        return
    with pytest.raises(UserError, match=r"scale: |; [0-9.]+ would fit|it would fit") as caught:
        read(path, unit=unit)
    message = str(caught.value)
    if "it would fit" in message:  # by the bounding box alone
        return
    told = re.search(r"mesh.scale: ([0-9.]+)|; ([0-9.]+) would fit", message)
    assert told is not None
    whole = read(path, scale=float(told[1] or told[2]))
    assert shoulder_width(whole.position, whole.loops) == pytest.approx(ADULT, rel=0.1)


def test_what_is_wrong_besides_the_unit_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, 1.0)
    with pytest.raises(UserError, match=r"with garment\.mesh\.up: z it would fit"):
        read(path, unit="auto", up="y")
