"""Draws persons and coats."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.geodesics import Reach, reach
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures, Posture
from drake_dress.models.human.skin.drawing import draw_phenotype
from drake_dress.models.human.skin.measures import body_values, skin_measures
from drake_dress.models.human.skin.phenotype import phenotype_skin
from drake_dress.models.sides import SIDES

_SITTING = 0.35  # share of persons who sit
# Adults of one sex, age, height and weight differ in each measure besides: relative standard
# deviation, and the number of these at which it is cut off.
_MEASURE, _OUTLIERS = 0.035, 2.5
# Comfortable poses, rad: abduction, extension, rotation, elbow; arms that hang, that are held
# forward, or that lie in the lap. A share of persons offer their arms to a coat behind them: nearly
# straight, and held back.
_LOW = np.array([-0.15, -0.7, -0.6, 0.0])
_HIGH = np.array([0.5, 0.9, 0.6, 1.7])
_OFFERING = 0.4
_OFFERED_LOW = np.array([-0.15, 0.3, -0.6, 0.0])
_OFFERED_HIGH = np.array([0.4, 1.2, 0.6, 0.8])
_UNLIKE = 0.15  # standard deviation of differences between left and right, rad
# Ranges of an adult's joints, rad, and the largest share of each that a stiffer person lacks.
_LIMITS = np.array([[-0.6, -2.6, -1.4, 0.0], [2.6, 1.4, 1.4, 2.5]])
_STIFFER = 0.15
_ELBOW = 3
# Relative effort of moving each joint, and the standard deviation of its logarithm: a shoulder
# carries the whole arm.
_EFFORT, _EFFORT_SPREAD = np.array([1.0, 1.0, 0.6, 0.4]), 0.4
# Size of a coat over that of the preset, and each measure's own largest variation.
_COAT_SCALE, _COAT_MEASURE = (0.85, 1.35), 0.06
# The cuts of the data that the shipped weights learned from; their lengths are varied.
_CUTS = ("jacket", "overcoat")
_SPACING = 0.06  # m, of the mesh on which a coat's reach is measured
_ATTEMPTS = 20  # to draw measures that fit each other


@dataclass(frozen=True)
class DrawnPerson:
    """A person of the data.

    Attributes:
        measures: body sizes.
        posture: standing or sitting.
        comfort: (2,4) comfortable pose of both arms, rad.
        limits: (2,2,4) lower and upper limits of each arm, rad.
        effort: (4,) relative effort of moving each joint.
    """

    measures: BodyMeasures
    posture: Posture
    comfort: FloatArray
    limits: FloatArray
    effort: FloatArray

    @cached_property
    def arms(self) -> tuple[Arm, Arm]:
        """Kinematics of left and right arm."""
        left, right = (Arm(self.measures, self.posture, side) for side in SIDES)
        return left, right


def draw_person(rng: np.random.Generator) -> DrawnPerson:
    """Returns a person with drawn measures, posture, pose and joints."""
    posture: Posture = "sitting" if rng.random() < _SITTING else "standing"
    low, high = _LIMITS
    lacking = _STIFFER * rng.random(4) * (high - low)
    limits = np.stack([np.stack([low + 0.5 * lacking, high - 0.5 * lacking])] * 2)
    # all elbows can be straight
    limits[:, 0, _ELBOW] = 0.0
    offers = rng.random() < _OFFERING
    both = rng.uniform(_OFFERED_LOW, _OFFERED_HIGH) if offers else rng.uniform(_LOW, _HIGH)
    comfort = np.clip(both + _UNLIKE * rng.normal(size=(2, 4)), limits[:, 0], limits[:, 1])
    effort = _EFFORT * np.exp(_EFFORT_SPREAD * rng.normal(size=4))
    return DrawnPerson(_draw_measures(rng), posture, comfort, limits, effort)


def draw_reach(rng: np.random.Generator) -> Reach:
    """Returns the reach of a coat with drawn measures."""
    for _ in range(_ATTEMPTS):
        preset = COATS[_CUTS[rng.integers(len(_CUTS))]]
        scale = rng.uniform(*_COAT_SCALE)
        drawn = {
            name: value * scale * (1.0 + rng.uniform(-1, 1) * _COAT_MEASURE)
            for name, value in preset.lengths.items()
        }
        try:
            return reach(make_coat(preset.with_lengths(drawn), _SPACING))
        except UserError:
            # measures that make no coat
            continue
    return reach(make_coat(COATS["jacket"], _SPACING))


def _draw_measures(rng: np.random.Generator) -> BodyMeasures:
    for _ in range(_ATTEMPTS):
        values = body_values(skin_measures(phenotype_skin(draw_phenotype(rng))))
        own = np.clip(rng.normal(size=len(values)), -_OUTLIERS, _OUTLIERS)
        factors = (1.0 + _MEASURE * own).tolist()
        drawn = {name: values[name] * factor for name, factor in zip(values, factors, strict=True)}
        try:
            return BodyMeasures(**drawn)
        except UserError:
            # measures that make no person
            continue
    return BodyMeasures()
