from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.human.body import ArmPose, Posture, arm_points
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.person_skin import PersonSkin, person_skin
from drake_dress.models.sides import SIDES, Side
from tests.models.human.skin.bodies import MAN, OLD_WOMAN, skin_of

POSES: dict[Side, ArmPose] = {
    "left": ArmPose(0.3, 0.8, -0.4, 0.3),
    "right": ArmPose(0.5, -0.6, 0.2, 1.3),
}
NAMES = ("shoulder", "elbow", "knuckle_middle")


@pytest.mark.parametrize("posture", ["standing", "sitting"])
def test_arms_of_another_person_s_length_reach_their_joints(posture: Posture) -> None:
    joints = np.vstack(
        [
            arm_points(body_measures(skin_measures(skin_of(MAN))), posture, side, POSES[side])
            for side in SIDES
        ]
    )
    skin = skin_of(OLD_WOMAN)
    motions = PersonSkin(skin, posture).motions(joints)
    for i, side in enumerate(SIDES):
        places = [skin.joints[f"{side}_{name}"] for name in NAMES]
        upper, fore = motions[1 + 4 * i], motions[2 + 4 * i]
        for motion, place, joint in (
            (upper, places[0], 0),
            (upper, places[1], 1),
            (fore, places[1], 1),
            (fore, places[2], 2),
        ):
            found = motion[:, :3] @ place + motion[:, 3]
            assert found == pytest.approx(joints[3 * i + joint], abs=1e-9)


def test_skin_is_scaled_to_the_shoulders() -> None:
    own = body_measures(skin_measures(skin_of(MAN)))
    taller = replace(own, shoulder_height=1.1 * own.shoulder_height)
    plain, same, large = (person_skin(MAN, "standing", body) for body in (None, own, taller))
    assert same.rest.vertices == pytest.approx(plain.rest.vertices, abs=1e-9)
    assert large.rest.stature == pytest.approx(1.1 * 1.756, abs=1e-3)
    for name, place in plain.rest.joints.items():
        assert large.rest.joints[name] == pytest.approx(1.1 * place, abs=1e-9)
