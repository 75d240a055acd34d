"""MakeHuman's macro parameters and the weights that they give to the corners of the body model.

Each parameter interpolates linearly between neighbouring corners; a body is the sum over all
corners of the product of these weights. Muscle and weight may lie outside of their corners, which
extrapolates the nearest interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray

SEXES = ("male", "female")
AGES = ("baby", "child", "young", "old")
MUSCLES = ("minmuscle", "averagemuscle", "maxmuscle")
WEIGHTS = ("minweight", "averageweight", "maxweight")
# Age in years by the age parameter. Source: the calibration of `anny` 0.6.2, the same for boys and
# girls (`data/shape_calibration`); there, a woman of 64 is half way between young and old.
_AGE_PARAMETER = np.array([0.0, 0.05, 0.215, 0.415, 0.67, 0.77, 0.83, 1.0])
_YEARS = np.array([0.0, 1.0, 4.0, 11.0, 16.0, 18.0, 64.0, 110.0])


@dataclass(frozen=True)
class Macro:
    """Macro parameters; 0.5 is MakeHuman's mean.

    Attributes:
        sex: 0 male, 1 female.
        age: 0 a baby, 1/3 a child of some 8 years, 2/3 young, 1 old; see `age_parameter`.
        muscle: 0 to 1.
        weight: corpulence at the same height; 0 to 1, extrapolated outside.
        height: 0 to 1.
        proportions: 0 ideal, 1 uncommon.
    """

    sex: float
    age: float
    muscle: float = 0.5
    weight: float = 0.5
    height: float = 0.5
    proportions: float = 0.5


def age_parameter(years: float) -> float:
    """Returns the age parameter of an age in years."""
    return float(np.interp(years, _YEARS, _AGE_PARAMETER))


def corner_weights(macro: Macro) -> FloatArray:
    """Returns the weights (2,4,3,3) of the corners by sex, age, muscle and weight; sum 1."""
    sex = np.array([1.0 - macro.sex, macro.sex])
    age, muscle, weight = (
        _linear(value, count)
        for value, count in (
            (macro.age, len(AGES)),
            (macro.muscle, len(MUSCLES)),
            (macro.weight, len(WEIGHTS)),
        )
    )
    return np.einsum("a,b,c,d->abcd", sex, age, muscle, weight)


def _linear(value: float, count: int) -> FloatArray:
    """Returns the weights (count,) of equally spaced corners on [0,1]; sum 1."""
    place = value * (count - 1)
    first = int(np.clip(np.floor(place), 0, count - 2))
    weights = np.zeros(count)
    weights[first], weights[first + 1] = first + 1 - place, place - first
    return weights
