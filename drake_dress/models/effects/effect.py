"""Interface of physical effects: a few parameters in SI units that change one part of the model.

An effect whose sizes are all 0 changes nothing. Each kind below enters the model at one place;
`composition.py` combines them. `apply` returns the effect itself. `derivative` returns the
derivative of that result by one parameter, for the same arguments. `contract.py` checks all this.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Self

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.material import Material
from drake_dress.models.human.body import BodyMeasures


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect.

    Attributes:
        name: name of the effect's field.
        unit: SI unit.
        low, high: bounds, inclusive.
        typical: a size that matters in a lab, for steps and plots.
        off: default value. With all parameters at their defaults the effect does nothing.
        shapes: whether it only sets where or how the other parameters act, such as a place or a
            threshold. Such a parameter does not switch the effect on and is not screened alone.
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    off: float = 0.0
    shapes: bool = False


def parameter(
    unit: str, low: float, high: float, typical: float, shape: float | None = None
) -> Any:
    """Returns a dataclass field for a parameter; see `Parameter`.

    Args:
        unit: SI unit; "1" for a pure number.
        low: smallest value.
        high: largest value.
        typical: a size that matters in a lab.
        shape: default of a parameter that only shapes the effect. Without it the parameter is a
            size: its default is 0, which switches the effect off.
    """
    shapes = shape is not None
    off = 0.0 if shape is None else float(shape)
    bounds = {"low": low, "high": high, "typical": typical}
    return field(default=off, metadata={"unit": unit, **bounds, "off": off, "shapes": shapes})


@dataclass(frozen=True)
class Effect:
    """A physical effect; its fields are its parameters.

    Class attributes:
        NAME: name in scenarios and explanations.
        IN_WORDS: description of the effect in a report; by default its name.
        NEEDS_CONTACT: whether it acts only where the garment touches the person.

    Raises:
        ValueError: a parameter is not finite or is outside its bounds.
    """

    NAME: ClassVar[str]
    IN_WORDS: ClassVar[str] = ""
    NEEDS_CONTACT: ClassVar[bool] = False

    def __post_init__(self) -> None:
        for p in self.parameters():
            value = getattr(self, p.name)
            if not (math.isfinite(value) and p.low <= value <= p.high):
                raise ValueError(
                    f"{self.NAME}.{p.name} is {value} {p.unit}, expected {p.low:g} to {p.high:g}"
                )

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """Returns the descriptions of its fields, in order."""
        return tuple(Parameter(f.name, **f.metadata) for f in fields(cls) if f.metadata)

    @classmethod
    def sizes(cls) -> tuple[Parameter, ...]:
        """Returns the parameters that set its strength."""
        return tuple(p for p in cls.parameters() if not p.shapes)

    @classmethod
    def starts(cls, rest_position: FloatArray) -> tuple[Self, ...]:
        """Returns the effects that a search starts from, which differ in their shape parameters.

        By default there is one, of typical size.

        Args:
            rest_position: (n,3) of the garment, m.
        """
        return (cls(**{p.name: p.typical for p in cls.sizes()}),)

    @classmethod
    def draw(cls, rng: np.random.Generator, size: float) -> dict[str, float]:
        """Returns random parameters, scaled by `size`, for generated data with a hidden effect.

        By default each size is 1 to 2 times its typical value, of either sign, as the bounds allow.
        Shape parameters keep their defaults.
        """
        drawn = {}
        for p in cls.sizes():
            value = size * rng.uniform(p.typical, min(2.0 * p.typical, p.high))
            if p.low <= -value:
                value *= rng.choice([-1.0, 1.0])
            drawn[p.name] = float(value)
        return drawn

    def values(self) -> dict[str, float]:
        """Returns the parameters by name."""
        return {p.name: float(getattr(self, p.name)) for p in self.parameters()}

    @property
    def is_off(self) -> bool:
        """Whether the effect changes nothing."""
        return all(getattr(self, p.name) == p.off for p in self.sizes())


@dataclass(frozen=True)
class Sheet:
    """The garment's data for effects.

    Attributes:
        elements: elements of the rest shape.
        rest_position: (n,3) in the garment's frame, m.
        grain: (F,3) direction of the warp in the garment's frame, of any length.
    """

    elements: Elements
    rest_position: FloatArray
    grain: FloatArray


@dataclass(frozen=True)
class Sliding:
    """The nodes that touch a body at the start of a step.

    Attributes:
        nodes: (c,) indices.
        velocity: (c,3) tangential velocity relative to the surface, m/s.
        force: (c,3) tangential force of the surface on the node in the last step, N.
        grain: (c,3) unit vector along the warp in the current configuration.
    """

    nodes: IntArray
    velocity: FloatArray
    force: FloatArray
    grain: FloatArray


class MaterialEffect(Effect):
    """Changes a material value of the fabric."""

    def apply(self, material: Material) -> Material:
        """Returns the fabric with the effect."""
        raise NotImplementedError

    def derivative(self, name: str, material: Material) -> dict[str, float]:
        """Returns the derivative of the fabric's changed fields by the parameter `name`."""
        raise NotImplementedError


class ShapeEffect(Effect):
    """Changes the rest shape."""

    def apply(self, rest_position: FloatArray) -> FloatArray:
        """Returns (n,3) rest positions, m."""
        raise NotImplementedError

    def derivative(self, name: str, rest_position: FloatArray) -> FloatArray:
        """Returns (n,3)."""
        raise NotImplementedError


class MassEffect(Effect):
    """Adds mass to nodes."""

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns (n,) kg."""
        raise NotImplementedError

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (n,)."""
        raise NotImplementedError


class GravityEffect(Effect):
    """Changes gravity."""

    def apply(self, gravity: FloatArray) -> FloatArray:
        """Returns (3,) m/s²."""
        raise NotImplementedError

    def derivative(self, name: str, gravity: FloatArray) -> FloatArray:
        """Returns (3,)."""
        raise NotImplementedError


class FibreEffect(Effect):
    """Adds stiffness along the warp."""

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns (F,) N/m."""
        raise NotImplementedError

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (F,)."""
        raise NotImplementedError


class StretchEffect(Effect):
    """Makes the stretch stiffness depend on strain."""

    def apply(self, strain: FloatArray) -> FloatArray:
        """Returns the factor (F,) on the stiffness of triangles with largest strain `strain`."""
        raise NotImplementedError

    def derivative(self, name: str, strain: FloatArray) -> FloatArray:
        """Returns (F,)."""
        raise NotImplementedError


class ForceEffect(Effect):
    """Adds a force on the nodes."""

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns the force (n,3), N, at positions and velocities (n,3), m, m/s."""
        raise NotImplementedError

    def derivative(self, name: str, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        """Returns (n,3)."""
        raise NotImplementedError


class FrictionEffect(Effect):
    """Changes the Coulomb coefficient of the nodes in contact."""

    NEEDS_CONTACT = True

    def apply(self, friction: float, sliding: Sliding) -> FloatArray:
        """Returns the change of the fabric's coefficient `friction`, (c,)."""
        raise NotImplementedError

    def derivative(self, name: str, friction: float, sliding: Sliding) -> FloatArray:
        """Returns (c,)."""
        raise NotImplementedError


class AdhesionEffect(Effect):
    """Makes nodes in contact adhere."""

    NEEDS_CONTACT = True

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns the pull (n,) that the contact of each node bears, N."""
        raise NotImplementedError

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (n,)."""
        raise NotImplementedError


class BodyEffect(Effect):
    """Changes the person's sizes."""

    NEEDS_CONTACT = True

    def apply(self, measures: BodyMeasures) -> BodyMeasures:
        """Returns the sizes with the effect."""
        raise NotImplementedError

    def derivative(self, name: str, measures: BodyMeasures) -> dict[str, float]:
        """Returns the derivative of the changed fields."""
        raise NotImplementedError


class ClockEffect(Effect):
    """Shifts recorded time stamps."""

    def apply(self, time: FloatArray) -> FloatArray:
        """Returns the true times, s, of recorded time stamps."""
        raise NotImplementedError

    def derivative(self, name: str, time: FloatArray) -> FloatArray:
        """Returns an array of the shape of `time`."""
        raise NotImplementedError


class CameraEffect(Effect):
    """Displaces the points that cameras report."""

    def apply(self, position: FloatArray) -> FloatArray:
        """Returns the positions that cameras report for world points (…,3), m."""
        raise NotImplementedError

    def inverse(self, position: FloatArray) -> FloatArray:
        """Returns the world points of positions (…,3), m, that cameras report."""
        raise NotImplementedError

    def derivative(self, name: str, position: FloatArray) -> FloatArray:
        """Returns (…,3)."""
        raise NotImplementedError


class MountEffect(Effect):
    """Makes grippers or limbs yield to the garment's pull."""

    def apply(self, force: FloatArray) -> FloatArray:
        """Returns the speed or the rest deflection (…,3) under forces (…,3) of the garment, N."""
        raise NotImplementedError

    def derivative(self, name: str, force: FloatArray) -> FloatArray:
        """Returns (…,3)."""
        raise NotImplementedError


def norms(vectors: FloatArray) -> FloatArray:
    """Returns the lengths (…,) of vectors (…,3)."""
    lengths: FloatArray = np.linalg.norm(vectors, axis=-1)
    return lengths
