"""All effects by name: those of the package, then those that a user registers.

A registered effect is a candidate of `explain`, may be hidden in generated data, and is a key below
`effects:` in scenarios. Worker processes that start later import the class from its module.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeVar

from drake_dress.errors import UserError
from drake_dress.models.effects.air import AirDrag, Wind
from drake_dress.models.effects.contact import (
    Adhesion,
    AnisotropicFriction,
    Friction,
    VelocityDependentFriction,
)
from drake_dress.models.effects.contract import check_class
from drake_dress.models.effects.effect import ClockEffect, Effect, MountEffect
from drake_dress.models.effects.fabric import (
    AnisotropicStiffness,
    BendingStiffness,
    InternalDamping,
    RestSize,
    StrainStiffening,
    StretchStiffness,
)
from drake_dress.models.effects.grip import GripperCompliance, GripperLatency, GripperSlip
from drake_dress.models.effects.mass import GravityTilt, LocalMass, SurfaceDensity
from drake_dress.models.effects.person import LimbCompliance, LimbRadius
from drake_dress.models.effects.sensing import CameraRotation, CameraTranslation, TimeOffset
from drake_dress.models.register import enter

Kind = TypeVar("Kind", bound=type[Effect])

_effects: dict[str, type[Effect]] = {
    effect.NAME: effect
    for effect in (
        AirDrag,
        Wind,
        SurfaceDensity,
        LocalMass,
        StretchStiffness,
        AnisotropicStiffness,
        StrainStiffening,
        BendingStiffness,
        InternalDamping,
        RestSize,
        Friction,
        VelocityDependentFriction,
        AnisotropicFriction,
        Adhesion,
        LimbRadius,
        LimbCompliance,
        GripperLatency,
        GripperSlip,
        GripperCompliance,
        TimeOffset,
        CameraRotation,
        CameraTranslation,
        GravityTilt,
    )
}
BUILT_IN = frozenset(_effects)
EFFECTS: Mapping[str, type[Effect]] = MappingProxyType(_effects)
"""A live view: it grows with `register_effect`."""

# For messages about unknown names.
HOW_TO_LOAD = "load your own with --plugin FILE.py, or register_effect in Python"
# Words that stand in place of an effect's name.
_RESERVED = ("nothing", "random", "discretisation")


def register_effect(kind: Kind) -> Kind:
    """Registers a user's effect by its name; returns the class, so it can be a decorator.

    A class that is defined again, as in a notebook's cell, replaces its earlier version. Unlike
    `check_effect`, this does not check derivatives against finite differences.

    Args:
        kind: a frozen dataclass that is one of the kinds of effect.

    Raises:
        UserError: the class breaks the contract of effects, or its name is taken.
    """
    check_class(kind)
    source = f"effect {kind.__name__}"
    if issubclass(kind, ClockEffect | MountEffect):
        raise UserError(
            source,
            "",
            "changes a clock or a mount, which work with the package's own effects only; "
            "expected another kind of effect, such as ForceEffect",
        )
    name = kind.NAME
    if name in BUILT_IN or name in _RESERVED:
        raise UserError(source, "NAME", f"is {name!r}, a name of the package, expected another")
    enter(_effects, source, kind)
    return kind


def unregister_effect(name: str) -> None:
    """Removes a registered effect.

    Raises:
        UserError: there is none of that name.
    """
    if name not in own_effects():
        raise UserError("effect", name, "is not registered, expected the name of one that is")
    del _effects[name]


def own_effects() -> tuple[str, ...]:
    """Returns the names of registered effects, in order of registration."""
    return tuple(name for name in _effects if name not in BUILT_IN)
