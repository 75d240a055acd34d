import numpy as np
import pytest

from drake_dress.learning.body.parts import bone_weights, joint_rows, part_numbers, part_of
from drake_dress.models.human.skin.body_file import BONES, JOINTS, MIDDLE_JOINTS, PARTS
from tests.learning.body.model import BONES as SOURCE_BONES
from tests.learning.body.model import small_model


def test_each_bone_moves_its_part() -> None:
    expected = {
        "oculi02.L": "head",
        "finger1-3.L": "thumb",
        "finger4-2.R": "fingers",
        "metacarpal2.L": "palm",
        "clavicle.R": "trunk",
        "shoulder01.L": "trunk",
        "upperarm02.L": "upper_arm",
        "toe5-1.R": "foot",
    }
    assert {bone: part_of(bone) for bone in expected} == expected


def test_vertices_belong_to_the_bone_with_the_greatest_weight() -> None:
    numbers = part_numbers(small_model())
    assert [PARTS[n] for n in numbers] == ["head", "head", "trunk", "foot", "palm", "upper_arm"]


def test_weights_are_those_of_the_left_half() -> None:
    weights = bone_weights(small_model())
    assert weights[:5].sum(axis=1) == pytest.approx(1.0)
    assert [BONES[k] for k in np.argmax(weights[:5], axis=1)] == [
        "torso", "torso", "torso", "shin", "forearm",
    ]  # fmt: skip


def test_joints_are_heads_of_bones() -> None:
    source = small_model()
    rows = joint_rows(source)
    names = [*MIDDLE_JOINTS, *JOINTS]
    assert len(rows) == len(set(rows)) == len(names)
    found = {name: SOURCE_BONES[row - 6] for name, row in zip(names, rows, strict=True)}
    assert found["shoulder"] == "upperarm01.L"
    assert found["knuckle_middle"] == "finger3-1.L"
    assert found["ankle"] == "foot.L"
