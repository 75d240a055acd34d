import numpy as np
import pytest

from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points
from drake_dress.models.human.heading import heading, headings
from drake_dress.models.sides import SIDES


def joints(yaw: float, place: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    c, s = np.cos(yaw), np.sin(yaw)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    pose = ArmPose(0.3, 0.8, 0.0, 0.2)
    frame = (turned, np.array([*place, 0.0]))
    return np.vstack([arm_points(BodyMeasures(), "standing", s, pose, frame) for s in SIDES])


@pytest.mark.parametrize("yaw", [-3.0, -0.4, 0.1, 1.6, 3.1])
def test_shoulders_tell_the_yaw(yaw: float) -> None:
    found = heading(joints(yaw, (0.4, -2.0)))
    np.testing.assert_allclose(found.front, [np.cos(yaw), np.sin(yaw), 0.0], atol=1e-12)
    np.testing.assert_allclose(found.leftward, [-np.sin(yaw), np.cos(yaw), 0.0], atol=1e-12)
    np.testing.assert_allclose(found.rotation @ found.rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_array_equal(found.inward(0), -found.leftward)
    np.testing.assert_array_equal(found.inward(1), found.leftward)


def test_reversed_exchanges_front_and_back_alone() -> None:
    found = heading(joints(0.7))
    np.testing.assert_array_equal(found.reversed.front, -found.front)
    np.testing.assert_array_equal(found.reversed.leftward, found.leftward)
    np.testing.assert_array_equal(found.reversed.inward(0), found.inward(0))
    np.testing.assert_array_equal(found.reversed.reversed.rotation, found.rotation)
    both = headings(np.stack([joints(0.7), joints(-1.0)]))
    np.testing.assert_array_equal(both.reversed.front, -both.front)


def test_rounding_is_no_turn() -> None:
    seen = joints(0.0)
    seen[0, 0] += 1e-17
    np.testing.assert_array_equal(heading(seen).rotation, np.eye(3))


def test_tilt_of_the_shoulders_is_no_turn() -> None:
    seen = joints(0.5)
    seen[0, 2] += 0.1
    expected = heading(joints(0.5)).front
    np.testing.assert_allclose(heading(seen).front, expected, atol=1e-12)


def test_who_faces_backward_is_not_taken_to_face_forward() -> None:
    seen = joints(0.0)[[3, 4, 5, 0, 1, 2]]
    np.testing.assert_allclose(heading(seen).front, [-1.0, 0.0, 0.0], atol=1e-12)
