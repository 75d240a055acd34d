from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.human.body import ArmPose, Posture, arm_points
from drake_dress.models.human.skin.at_joints import vertices_at_joints
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.posing import posed_vertices
from drake_dress.models.rotation import rotation_about
from drake_dress.models.sides import SIDES, Side
from tests.models.human.skin.bodies import MAN, OLD_WOMAN, skin_of

POSES: dict[Side, ArmPose] = {
    "left": ArmPose(0.3, 0.8, -0.4, 0.3),
    "right": ArmPose(0.5, -0.6, 0.2, 1.3),
}


@pytest.mark.parametrize("posture", ["standing", "sitting"])
def test_skin_of_the_capsules_joints_is_the_posed_skin(posture: Posture) -> None:
    """Capsules and skin with the same measures have the same joints, wherever the person is."""
    skin = skin_of(MAN)
    # a wrist that is beside the line from elbow to hand makes the way along the arm longer
    straight = skin.joints["left_knuckle_middle"] - skin.joints["left_elbow"]
    length = float(np.linalg.norm(straight))
    body = replace(body_measures(skin_measures(skin)), forearm_length=length)
    X_WTorso = rotation_about("z", 0.7), np.array([0.4, -0.2, 0.1])
    joints = np.vstack([arm_points(body, posture, side, POSES[side], X_WTorso) for side in SIDES])
    expected = posed_vertices(skin, POSES, posture) @ X_WTorso[0].T + X_WTorso[1]
    assert vertices_at_joints(skin, joints, posture) == pytest.approx(expected, abs=1e-6)


def test_straight_arms_do_not_turn_about_their_axes() -> None:
    skin = skin_of(OLD_WOMAN)
    shoulder = np.array([0.0, 0.16, 1.25])
    joints = np.array([shoulder, shoulder - [0, 0, 0.25], shoulder - [0, 0, 0.55]])
    both = np.vstack([joints, joints * [1.0, -1.0, 1.0]])
    # rounding of a log's single precision must not turn a hand around
    rng = np.random.default_rng(0)
    still = vertices_at_joints(skin, both)
    for _ in range(20):
        moved = vertices_at_joints(skin, both + 1e-6 * rng.normal(size=both.shape))
        assert np.abs(moved - still).max() < 1e-3
    fingers = skin.parts == PARTS.index("fingers")
    assert still[fingers, 2].max() < 0.8
