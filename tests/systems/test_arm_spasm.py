import numpy as np

from drake_dress.models.human.spasm import SpasmParameters
from drake_dress.systems.arm_spasm import ArmSpasm
from tests.systems.over_time import output_at

INDEX = np.array([1, 2, 3, 4, 6, 7, 8, 9])
TIMES = np.arange(0.0, 60.0, 0.02)


def torque(seed: int, sides: tuple[str, ...]) -> np.ndarray:
    p = SpasmParameters(sides=sides, torque=2.0)  # type: ignore[arg-type]
    return output_at(ArmSpasm(p, seed, 11, INDEX), TIMES)


def test_only_the_arm_that_has_spasms_is_driven() -> None:
    rows = torque(0, ("left",))
    np.testing.assert_array_equal(rows[:, [0, 2, 5, 6, 7, 8, 9, 10]], 0.0)
    assert 1.0 < rows[:, 4].max() <= 2.8
    np.testing.assert_allclose(rows[:, 1], -0.5 * rows[:, 4])
    assert (rows[:, 4] == 0.0).mean() > 0.5


def test_the_seed_decides_when() -> None:
    np.testing.assert_array_equal(torque(3, ("right",)), torque(3, ("right",)))
    assert np.abs(torque(3, ("right",)) - torque(4, ("right",))).max() > 0.5


def test_both_arms_have_their_own() -> None:
    rows = torque(1, ("left", "right"))
    assert np.abs(rows[:, 4] - rows[:, 9]).max() > 0.5
