import numpy as np

from drake_dress.systems.hand_tremor import HandTremor
from tests.systems.over_time import output_at

TORQUE = np.array([0.0, 0.0, 1.5, 1.5, 0.0, 0.0, 0.5, 0.5])
INDEX = np.array([1, 2, 3, 4, 6, 7, 8, 9])


def torque(seed: int, times: np.ndarray) -> np.ndarray:
    return output_at(HandTremor(TORQUE, 5.0, seed, 11, INDEX), times)


TIMES = np.arange(0.0, 20.0, 0.004)


def test_only_the_joints_that_drive_are_driven() -> None:
    rows = torque(0, TIMES)
    driven = INDEX[TORQUE > 0.0]
    np.testing.assert_array_equal(np.delete(rows, driven, axis=1), 0.0)
    assert (np.abs(rows[:, driven]).max(axis=0) > 0.5 * TORQUE[TORQUE > 0.0]).all()
    assert (np.abs(rows[:, driven]).max(axis=0) < 2.0 * TORQUE[TORQUE > 0.0]).all()


def test_arms_tremble_each_in_its_own_time() -> None:
    rows = torque(0, TIMES)
    assert abs(np.corrcoef(rows[:, 3], rows[:, 8])[0, 1]) < 0.9
    np.testing.assert_array_equal(rows[:, 3], rows[:, 4])


def test_what_was_asked_before_changes_nothing() -> None:
    np.testing.assert_array_equal(torque(7, TIMES[[300, 5, 90]]), torque(7, TIMES)[[300, 5, 90]])
