import numpy as np
import pytest

from drake_dress.models.dressing.progress import SleeveGauge, SleeveProgress
from drake_dress.models.garment.coat import COATS, make_coat

MESH = make_coat(COATS["jacket"], 0.05)
LEFT = MESH.rest_position[MESH.loops["left_armhole"]].mean(axis=0)
RIGHT = MESH.rest_position[MESH.loops["right_armhole"]].mean(axis=0)


def arms(through: float) -> np.ndarray:
    """Returns joints (6,3) of straight arms along the sleeves' axes, m.

    `through` is the share of each arm, from the hand on, at which the armhole's centre is.
    """
    joints = []
    for center, side in ((LEFT, 1.0), (RIGHT, -1.0)):
        along = np.array([0.0, -side * 0.5, 0.5])
        along /= np.linalg.norm(along)  # from hand to shoulder
        hand, shoulder = center - 0.6 * through * along, center + 0.6 * (1.0 - through) * along
        joints += [shoulder, 0.5 * (hand + shoulder), hand]
    return np.array(joints)


@pytest.mark.parametrize("through", [0.25, 0.9])
def test_arms_through_both_armholes_are_inside_as_far_as_they_are(through: float) -> None:
    progress = SleeveGauge(MESH).measure(MESH.rest_position, arms(through))
    assert (np.abs(progress.linking) == 1).all()
    np.testing.assert_allclose(progress.s, 2.0 * through, atol=0.1)
    np.testing.assert_allclose(progress.hand_distance, 0.6 * through, atol=0.03)
    assert progress.are_on(2.0 * through - 0.15)
    assert not progress.are_on(2.0 * through + 0.15)


def test_arms_that_are_elsewhere_are_not_inside() -> None:
    beside = arms(0.9) + [0.5, 0.0, 0.0]
    progress = SleeveGauge(MESH).measure(MESH.rest_position, beside)
    assert not progress.linking.any()
    assert not progress.s.any()
    # the centre itself is beside the arm, and far up
    assert progress.coordinates[:, 0].min() > 1.5
    assert not progress.are_on(0.0)


def test_measures_do_not_depend_on_where_the_world_is() -> None:
    gauge, shift = SleeveGauge(MESH), np.array([3.0, -2.0, 1.0])
    here = gauge.measure(MESH.rest_position, arms(0.5))
    there = gauge.measure(MESH.rest_position + shift, arms(0.5) + shift)
    np.testing.assert_allclose(here.coordinates, there.coordinates, atol=1e-9)
    np.testing.assert_array_equal(here.linking, there.linking)


def test_one_arm_alone_is_not_on() -> None:
    coordinates = np.array([[1.95, 0.0, 0.0], [1.95, 0.1, 0.0]])
    assert not SleeveProgress(coordinates, np.array([1, 0]), np.zeros(2)).are_on(1.9)
    assert not SleeveProgress(coordinates, np.array([1, 2]), np.zeros(2)).are_on(1.9)
    assert SleeveProgress(coordinates, np.array([1, -1]), np.zeros(2)).are_on(1.9)
