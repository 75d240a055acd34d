"""`garment.json` is strict JSON with the fixed keys, and tells what the verdict says."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.fit import garment_sizes, judge, person_girths
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import BodyMeasures
from drake_dress.report.garment_look import Advice, GarmentLook, garment_json

BODY = BodyMeasures()
COAT = make_coat(replace(COATS["jacket"], shoulder_width=0.5, chest=1.28, cuff_girth=0.36), 0.06)


def look(mesh: GarmentMesh = COAT) -> GarmentLook:
    sizes, girths = garment_sizes(mesh), person_girths(BODY)
    advice = Advice("garment.coat.scale", 1.0, 0.8, {}, "The size suits.")
    return GarmentLook(
        "coat <1>", mesh, sizes, BODY, girths, judge(sizes, girths), advice, (), "seed: 0\n", "run"
    )


def content(mesh: GarmentMesh = COAT) -> dict[str, Any]:
    def refuse(text: str) -> None:
        raise AssertionError(text)

    found: dict[str, Any] = json.loads(garment_json(look(mesh)), parse_constant=refuse)
    return found


def test_the_fixed_keys_are_there() -> None:
    found = content()
    assert found["fits"] is True
    assert found["can_go_on"] is True
    assert found["reasons"] == []
    assert found["size_advice"]["key"] == "garment.coat.scale"
    for loop in found["loops"]:
        assert isinstance(loop["name"], str)
        assert loop["girth_m"] > 0.0
        assert len(loop["center"]) == 3


def test_openings_of_sleeves_stand_beside_the_limbs_that_go_through() -> None:
    loops = {loop["name"]: loop for loop in content()["loops"]}
    assert {loops[f"{side}_cuff"]["person_part"] for side in ("left", "right")} == {"hand"}
    assert loops["left_armhole"]["person_part"] == "upper arm"
    assert loops["rim"]["person_part"] is None
    for loop in loops.values():
        if loop["ratio"] is not None:
            assert loop["ratio"] == pytest.approx(loop["girth_m"] / loop["person_girth_m"], 1e-4)


def test_reasons_are_the_sentences_of_the_verdict() -> None:
    small = COAT.scaled(0.5)
    found = content(small)
    assert found["fits"] is False
    assert found["can_go_on"] is False
    assert found["reasons"] == [finding.text for finding in look(small).fit.reasons]
    assert any(row["state"] == "too narrow" for row in found["comparisons"])


def test_lengths_grow_with_the_garment() -> None:
    one, two = content(), content(COAT.scaled(2.0))
    for key in ("body_length_m", "front_gap_m"):
        assert two[key] == pytest.approx(2.0 * one[key], abs=2e-6)
    assert two["area_m2"] == pytest.approx(4.0 * one["area_m2"], abs=1e-5)
    assert two["extent_m"] == pytest.approx([2.0 * value for value in one["extent_m"]], abs=2e-6)
    assert two["person_m"] == one["person_m"]
    assert two["triangles"] == one["triangles"]
