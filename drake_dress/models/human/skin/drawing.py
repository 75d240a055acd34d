"""Draws adults with heights and weights as in a published survey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.human.skin.phenotype import Phenotype, macro_of

_AGES = (18.0, 90.0)  # years, uniform
_ATTEMPTS = 100  # one draw in some twenty has a weight that the body model does not reach


@dataclass(frozen=True)
class _Population:
    """Adults of a sex.

    Attributes:
        height: mean stature, m.
        height_spread: standard deviation of the stature, m.
        weight: mean weight, kg.
        index_spread: standard deviation of the logarithm of the body mass index.
        loss: stature lost at the ages of 30, 70 and 80 years, m.
    """

    height: float
    height_spread: float
    weight: float
    index_spread: float
    loss: tuple[float, float, float]


# Means: adults of the United States 2011 to 2014 (Fryar and others 2016, Vital and Health
# Statistics 3/39). Spreads of height: percentiles of 2003 to 2006 (McDowell and others 2008,
# National Health Statistics Reports 10); of the index: 95 % of women weigh less than 250 pounds
# (there), and men vary less. Loss of height with age: Sorkin, Muller and Andres 1999 (Am J
# Epidemiol 150:969), from 2084 persons over 9 to 15 years.
_POPULATIONS = {
    "male": _Population(1.757, 0.075, 88.8, 0.20, (0.0, 0.03, 0.05)),
    "female": _Population(1.618, 0.068, 76.4, 0.25, (0.0, 0.05, 0.08)),
}
_LOSS_AGES = (30.0, 70.0, 80.0)
_MEAN_AGE = 47.0  # years, of adults in the survey


def draw_phenotype(rng: np.random.Generator) -> Phenotype:
    """Returns an adult of 18 to 90 years of either sex, whose body the model reaches."""
    for _ in range(_ATTEMPTS):
        person = _draw(rng)
        try:
            macro_of(person)
        except UserError:
            continue
        return person
    raise RuntimeError("no drawn adult is within the reach of the body model")


def _draw(rng: np.random.Generator) -> Phenotype:
    sex = "female" if rng.random() < 0.5 else "male"
    of_sex = _POPULATIONS[sex]
    age = float(rng.uniform(*_AGES))
    lost = np.interp([age, _MEAN_AGE], _LOSS_AGES, of_sex.loss)
    mean = of_sex.height - (lost[0] - lost[1])
    height = float(mean + of_sex.height_spread * rng.normal())
    spread = of_sex.index_spread
    # the logarithm's mean is below that of the index by half the variance
    middle = of_sex.weight / of_sex.height**2 * np.exp(-0.5 * spread**2)
    weight = float(middle * np.exp(spread * rng.normal()) * height**2)
    return Phenotype(sex, round(age, 1), round(height, 3), round(weight, 1))
