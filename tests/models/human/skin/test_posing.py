import time

import numpy as np
import pytest

from drake_dress.models.human.body import ArmPose, arm_rotations
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.skin.posing import posed_vertices, rest_pose, sitting_drop
from drake_dress.models.human.skin.skin import ALL_BONES, enclosed_volume
from drake_dress.models.sides import SIDES, Side
from tests.models.human.skin.bodies import MAN, PERSONS, skin_of

HANGING = {side: ArmPose() for side in SIDES}


@pytest.mark.parametrize("person", PERSONS)
def test_pose_of_the_rest_is_the_rest(person: Phenotype) -> None:
    skin = skin_of(person)
    rest = {side: rest_pose(skin, side) for side in SIDES}
    assert posed_vertices(skin, rest) == pytest.approx(skin.vertices, abs=1e-9)
    assert posed_vertices(skin, {}) == pytest.approx(skin.vertices, abs=1e-12)
    left, right = (vars(rest[side]) for side in SIDES)
    assert left == pytest.approx(right, abs=1e-9)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("pose", [ArmPose(), ArmPose(0.4, -0.7, 0.3, 1.2), ArmPose(1.5, 0, 0, 0.1)])
def test_limbs_follow_the_angles_of_the_person_of_capsules(side: Side, pose: ArmPose) -> None:
    skin = skin_of(MAN)
    moved = posed_vertices(skin, {side: pose})
    shoulder, elbow, hand = (
        skin.joints[f"{side}_{n}"] for n in ("shoulder", "elbow", "knuckle_middle")
    )
    upper, fore = arm_rotations(side, pose)
    new_elbow = shoulder - np.linalg.norm(elbow - shoulder) * upper[:, 2]
    new_hand = new_elbow - np.linalg.norm(hand - elbow) * fore[:, 2]
    # vertices that belong to the forearm alone move with its joints, as one body
    rigid = skin.weights[:, ALL_BONES.index(f"{side}_forearm")] > 1.0 - 1e-6
    assert rigid.sum() > 100
    for before, after in ((elbow, new_elbow), (hand, new_hand)):
        assert np.linalg.norm(moved[rigid] - after, axis=1) == pytest.approx(
            np.linalg.norm(skin.vertices[rigid] - before, axis=1), abs=1e-6
        )


def test_both_sides_mirror_each_other() -> None:
    skin = skin_of(MAN)
    pose = ArmPose(0.5, 0.3, -0.2, 0.9)
    both = posed_vertices(skin, {side: pose for side in SIDES})
    mirrored = both * [1.0, -1.0, 1.0]
    for points in (both, mirrored):
        points[:] = points[np.lexsort(np.round(points, 6).T)]
    assert both == pytest.approx(mirrored, abs=1e-6)


def test_bent_elbow_moves_only_the_forearm() -> None:
    skin = skin_of(MAN)
    straight, bent = (posed_vertices(skin, {"left": ArmPose(0.3, 0.0, 0.0, k)}) for k in (0.2, 1.4))
    weight = skin.weights[:, ALL_BONES.index("left_forearm")]
    still = weight == 0.0
    assert np.array_equal(straight[still], bent[still])
    assert np.linalg.norm(bent - straight, axis=1)[weight == 1.0].min() > 0.01
    # the hand of a bent elbow comes forward
    fingers = (skin.parts == PARTS.index("fingers")) & (skin.sides == 1)
    assert np.all(bent[fingers, 0] > straight[fingers, 0] + 0.2)


def test_hanging_arms_are_beside_the_body() -> None:
    skin = skin_of(MAN)
    moved = posed_vertices(skin, HANGING)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        fingers = (skin.parts == PARTS.index("fingers")) & (skin.sides == sign)
        shoulder = skin.joints[f"{side}_shoulder"]
        assert np.abs(moved[fingers, 1] * sign - abs(shoulder[1])).max() < 0.08
        assert moved[fingers, 2].max() < shoulder[2] - 0.5


@pytest.mark.parametrize("person", PERSONS)
def test_bending_keeps_the_volume(person: Phenotype) -> None:
    skin = skin_of(person)
    for pose, loss in ((ArmPose(), 0.01), (ArmPose(0.3, 0.5, 0.0, 1.5), 0.015)):
        moved = posed_vertices(skin, {side: pose for side in SIDES})
        assert enclosed_volume(moved, skin.faces) == pytest.approx(skin.volume, rel=loss)


def test_who_sits_has_feet_on_the_floor_and_horizontal_thighs() -> None:
    skin = skin_of(MAN)
    seated = posed_vertices(skin, HANGING, "sitting")
    assert seated[:, 2].min() == pytest.approx(0.0, abs=0.02)
    assert seated[:, 2].max() == pytest.approx(skin.stature - sitting_drop(skin), abs=1e-9)
    shins = skin.parts == PARTS.index("shin")
    assert seated[shins, 0].min() > skin.vertices[shins, 0].min() + 0.25


def test_posing_is_fast() -> None:
    skin = skin_of(MAN)
    took = []
    for _ in range(20):
        start = time.perf_counter()
        posed_vertices(skin, HANGING)
        took.append(time.perf_counter() - start)
    # the fastest of twenty, as the machine may be busy
    assert min(took) < 5e-3
