"""The skin of a person of given sex, age, height and weight.

Height and weight are reached by two of MakeHuman's macro parameters, which bracketed root searches
find. A body's mass is its volume times `DENSITY`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from drake_dress.errors import UserError
from drake_dress.models.human.skin.body_file import BodyFile, read_body
from drake_dress.models.human.skin.macro import Macro, age_parameter
from drake_dress.models.human.skin.skin import Skin, enclosed_volume, skin_of_points

# Mass over the volume inside the skin, kg/m³, lungs included. Without air, adults have 1015 to 1062
# (equations of Durnin and Womersley 1974, Br J Nutr 32:77, for skinfolds of 40 to 70 mm together).
# A relaxed breath leaves 3.3 l of air in a man of 1.76 m and 2.8 l in a woman of 1.63 m (Crapo and
# others 1982). Together that is 970 to 1020, so this is within 3 % for most adults.
DENSITY = 1000.0
AGE_RANGE = (4.0, 100.0)  # years
HEIGHT_RANGE = (0.8, 2.3)  # m
WEIGHT_RANGE = (1.0, 400.0)  # kg; `macro_of` tells the range of a body
# Corpulence. MakeHuman draws 0 to 1, which is a body mass index of about 20 to 26 kg/m² for adults;
# beyond it is extrapolated. Below and above these limits limbs become misshapen: men's trunks
# sooner than women's.
_LEAST_CORPULENCE, _MOST_CORPULENCE = -0.75, (2.5, 3.5)
# Range in which the height parameter is looked for: a little outside of MakeHuman's 0 to 1, as
# stature depends on corpulence, too. Where an extrapolated corpulence would need another one, a
# corpulence nearer to the mean is the limit.
_HEIGHT_PARAMETERS, _SHARES = (-0.3, 1.3), 14
_SEXES = {"male": 0.0, "female": 1.0}


@dataclass(frozen=True)
class Phenotype:
    """A person of whom one knows sex, age, height and weight.

    Attributes:
        sex: `female`, `male`, or a number from 0 male to 1 female.
        age: years.
        height: stature without shoes, m.
        weight: body mass, kg.
        muscle: 0 to 1. At the default, girths come nearest to the means of ANSUR II.
        proportions: 0 ideal, 1 uncommon, in MakeHuman's sense.

    Raises:
        UserError: a value is no such number, or out of range.
    """

    sex: str | float
    age: float
    height: float
    weight: float
    muscle: float = 0.4
    proportions: float = 0.5

    def __post_init__(self) -> None:
        if isinstance(self.sex, str):
            if self.sex not in _SEXES:
                raise UserError(
                    "person.body", "sex", f"is {self.sex!r}, expected female, male or 0 to 1"
                )
        else:
            _check("sex", self.sex, 0.0, 1.0, "")
        _check("age", self.age, *AGE_RANGE, " years")
        _check("height", self.height, *HEIGHT_RANGE, " m")
        _check("weight", self.weight, *WEIGHT_RANGE, " kg")
        _check("muscle", self.muscle, 0.0, 1.0, "")
        _check("proportions", self.proportions, 0.0, 1.0, "")

    @property
    def femaleness(self) -> float:
        """The sex as a number: 0 male, 1 female."""
        return _SEXES[self.sex] if isinstance(self.sex, str) else float(self.sex)


def phenotype_skin(person: Phenotype) -> Skin:
    """Returns the skin at rest, standing, with the arms held away from the body.

    Raises:
        UserError: no body of this sex and age has this height, or this weight at this height. The
            message says which are reached.
    """
    body = read_body()
    return skin_of_points(body, body.points(macro_of(person)))


@lru_cache(maxsize=256)
def macro_of(person: Phenotype) -> Macro:
    """Returns the macro parameters whose body has a person's height and weight.

    Raises:
        UserError: as `phenotype_skin`.
    """
    body = read_body()
    first = Macro(
        sex=person.femaleness,
        age=age_parameter(person.age),
        muscle=person.muscle,
        proportions=person.proportions,
    )
    low, high = (_stature(body, replace(first, height=h)) for h in (0.0, 1.0))
    if not low <= person.height <= high:
        raise UserError(
            "person.body",
            "height",
            f"is {person.height:g} m, expected {low:.2f} to {high:.2f} m at this sex and age",
        )

    def of_height(corpulence: float) -> Macro:
        macro = replace(first, weight=corpulence)
        return replace(macro, height=_height_parameter(body, macro, person.height))

    def excess(corpulence: float) -> float:
        return _mass(body, of_height(corpulence)) - person.weight

    farthest = _LEAST_CORPULENCE, float(np.interp(person.femaleness, (0.0, 1.0), _MOST_CORPULENCE))
    limits = [_with_height(body, first, limit, person.height) for limit in farthest]
    least, most = map(excess, limits)
    if least > 0.0 or most < 0.0:
        raise UserError(
            "person.body",
            "weight",
            f"is {person.weight:g} kg, expected {person.weight + least:.1f} to "
            f"{person.weight + most:.1f} kg at this sex, age, height and muscle",
        )
    return of_height(brentq(excess, *limits, xtol=1e-6))


def _with_height(body: BodyFile, macro: Macro, limit: float, height: float) -> float:
    """Returns the corpulence nearest to a limit, from the mean, at which a stature is reached."""
    for share in np.linspace(1.0, 0.0, _SHARES):
        corpulence = macro.weight + share * (limit - macro.weight)
        ends = [
            _stature(body, replace(macro, weight=corpulence, height=h)) for h in _HEIGHT_PARAMETERS
        ]
        if ends[0] < height < ends[1]:
            return float(corpulence)
    return macro.weight


def _height_parameter(body: BodyFile, macro: Macro, height: float) -> float:
    """Returns the height parameter of a stature, m."""

    def excess(parameter: float) -> float:
        return _stature(body, replace(macro, height=parameter)) - height

    return float(brentq(excess, *_HEIGHT_PARAMETERS, xtol=1e-7))


def _stature(body: BodyFile, macro: Macro) -> float:
    return float(np.ptp(body.points(macro)[: body.vertex_count, 2]))


def _mass(body: BodyFile, macro: Macro) -> float:
    """Returns the mass of a body, kg: twice that of its left half, closed by the symmetry plane."""
    return 2.0 * DENSITY * enclosed_volume(body.points(macro), body.faces)


def _check(key: str, value: object, low: float, high: float, unit: str) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (number and low <= float(str(value)) <= high):
        raise UserError(
            "person.body", key, f"is {value!r}, expected a number from {low:g} to {high:g}{unit}"
        )
