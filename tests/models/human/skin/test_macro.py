import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.skin.macro import Macro, age_parameter, corner_weights

shares = st.floats(0.0, 1.0)


@given(shares, shares, shares, st.floats(-1.0, 4.0))
def test_weights_of_the_corners_sum_to_one(
    sex: float, age: float, muscle: float, weight: float
) -> None:
    weights = corner_weights(Macro(sex, age, muscle, weight))
    assert weights.sum() == pytest.approx(1.0)
    # linear in each parameter: the corners' own values give the parameter
    assert np.einsum("abcd,b->", weights, np.arange(4) / 3) == pytest.approx(age, abs=1e-12)
    assert np.einsum("abcd,d->", weights, np.arange(3) / 2) == pytest.approx(weight, abs=1e-12)


def test_a_corner_has_all_of_its_own_weight() -> None:
    weights = corner_weights(Macro(1.0, 2.0 / 3.0, 0.5, 1.0))
    assert weights[1, 2, 1, 2] == pytest.approx(1.0)
    assert np.count_nonzero(np.abs(weights) > 1e-12) == 1


def test_older_people_have_a_greater_age_parameter() -> None:
    years = np.arange(0.0, 111.0)
    assert np.all(np.diff([age_parameter(y) for y in years]) > 0.0)
    assert (age_parameter(0.0), age_parameter(110.0)) == (0.0, 1.0)
