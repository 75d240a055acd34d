"""What every effect of the list obeys, and what an effect that does not is told."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.contract import check_class, check_effect
from drake_dress.models.effects.effect import (
    CameraEffect,
    Effect,
    ForceEffect,
    GravityEffect,
    Sheet,
    parameter,
)
from drake_dress.models.effects.registry import BUILT_IN, EFFECTS

# the names that users rely on
NAMES = """air_drag wind surface_density local_mass stretch_stiffness anisotropic_stiffness
strain_stiffening bending_stiffness internal_damping rest_size friction velocity_dependent_friction
anisotropic_friction adhesion limb_radius limb_compliance gripper_latency gripper_slip
gripper_compliance time_offset camera_rotation camera_translation gravity_tilt""".split()
# those that show only where the garment touches the person
OF_CONTACT = {
    "friction",
    "velocity_dependent_friction",
    "anisotropic_friction",
    "adhesion",
    "limb_radius",
    "limb_compliance",
}


def test_the_list_is_the_one_that_users_rely_on() -> None:
    assert [name for name in EFFECTS if name in BUILT_IN] == NAMES
    assert {name for name in NAMES if EFFECTS[name].NEEDS_CONTACT} == OF_CONTACT


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_keeps_the_contract(name: str) -> None:
    check_effect(EFFECTS[name])


@pytest.mark.parametrize("name", NAMES)
def test_docstrings_name_every_parameter(name: str) -> None:
    kind = EFFECTS[name]
    for p in kind.parameters():
        assert f"{p.name}:" in str(kind.__doc__)


@dataclass(frozen=True)
class Lift(ForceEffect):
    """An upward force on each node, k g A, that keeps the contract."""

    NAME = "lift"
    strength: float = parameter("N/m²", 0.0, 10.0, 0.5)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        return self.strength * self.derivative("strength", sheet, x, v)

    def derivative(self, name: str, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        return sheet.elements.node_area[:, None] * np.array([0.0, 0.0, 1.0])


def test_an_effect_of_a_user_may_keep_it() -> None:
    check_effect(Lift)


@dataclass(frozen=True)
class WrongSlope(Lift):
    def derivative(self, *given: Any) -> FloatArray:
        return 1.01 * super().derivative(*given)

    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        return self.strength * super().derivative("strength", sheet, x, v)


@dataclass(frozen=True)
class WrongShape(Lift):
    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        return super().apply(sheet, x, v).ravel()


@dataclass(frozen=True)
class NotOff(Lift):
    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        return super().apply(sheet, x, v) + 1e-6


@dataclass(frozen=True)
class WritesIntoItsArguments(Lift):
    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        x += self.strength
        return super().apply(sheet, x, v)


@dataclass(frozen=True)
class NotFinite(Lift):
    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        return super().apply(sheet, x, v) * (np.inf if self.strength else 1.0)


class Memory(dict[str, float]):
    pass


_CALLS = Memory(count=0.0)


@dataclass(frozen=True)
class Remembers(Lift):
    def apply(self, sheet: Sheet, x: FloatArray, v: FloatArray) -> FloatArray:
        _CALLS["count"] += 1.0
        return super().apply(sheet, x, v) * _CALLS["count"]


@dataclass(frozen=True)
class Unbounded(Lift):
    def __post_init__(self) -> None:
        pass


@dataclass(frozen=True)
class StartsOff(Lift):
    @classmethod
    def starts(cls, rest_position: FloatArray) -> tuple[StartsOff, ...]:
        return (cls(),)


@dataclass(frozen=True)
class DrawsTooMuch(Lift):
    @classmethod
    def draw(cls, rng: np.random.Generator, size: float) -> dict[str, float]:
        return {"strength": 100.0 * size}


@dataclass(frozen=True)
class NoWayBack(CameraEffect):
    NAME = "no_way_back"
    x: float = parameter("m", -0.3, 0.3, 0.01)

    def apply(self, position: FloatArray) -> FloatArray:
        return position + np.array([self.x, 0.0, 0.0])

    def inverse(self, position: FloatArray) -> FloatArray:
        return position

    def derivative(self, name: str, position: FloatArray) -> FloatArray:
        return np.broadcast_to(np.array([1.0, 0.0, 0.0]), position.shape)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (WrongSlope, ["derivative by strength", "central differences"]),
        (WrongShape, ["apply", "expected finite numbers of shape (48, 3)"]),
        (NotOff, ["apply", "with all sizes 0"]),
        (WritesIntoItsArguments, ["apply", "changes its arguments"]),
        (NotFinite, ["apply", "not finite"]),
        (Remembers, ["apply", "another result"]),
        (Unbounded, ["strength", "0 to 10 only"]),
        (StartsOff, ["starts", "not off"]),
        (DrawsTooMuch, ["draw", "lift.strength is 100.0"]),
        (NoWayBack, ["inverse", "does not undo apply"]),
    ],
    ids=lambda value: value.__name__ if isinstance(value, type) else "",
)
def test_what_an_effect_does_wrong_is_told(kind: type[Effect], words: list[str]) -> None:
    with np.errstate(invalid="ignore"), pytest.raises(UserError) as error:
        check_effect(kind)
    for word in [f"effect {kind.__name__}", *words]:
        assert word in str(error.value)


def made(name: Any = "made", bases: tuple[type, ...] = (Lift,), **fields: Any) -> type[Any]:
    """Returns a frozen dataclass of a kind of effect with these fields."""
    types = [(key, float, value) for key, value in fields.items()]
    space = {"NAME": name}
    return dataclasses.make_dataclass("Made", types, bases=bases, namespace=space, frozen=True)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (made("Lift-2"), ["NAME", "'Lift-2'", "lower-case"]),
        (made(None), ["NAME", "None"]),
        (made(more=parameter("", 0.0, 1.0, 0.1)), ["more", "no unit"]),
        (made(more=parameter("m", 1.0, 1.0, 0.1)), ["more", "low below high"]),
        (made(more=parameter("m", 0.1, 1.0, 0.2)), ["more", "is 0 by default"]),
        (made(more=parameter("m", 0.0, 1.0, 2.0)), ["more", "typical size 2"]),
        (made(more=parameter("m", 0.0, np.inf, 2.0)), ["more", "finite"]),
        (made(more_std=parameter("m", 0.0, 1.0, 0.1)), ["more_std", "_std"]),
        (made(more=0.0), ["more", "= parameter("]),
        (made(bases=(GravityEffect,), a=parameter("m", 0.0, 1.0, 0.1)), ["apply", "is missing"]),
        (made(bases=(GravityEffect,), a=parameter("m", 0.0, 1.0, 0.1, shape=0.5)), ["no size"]),
        (Effect, ["no effect", "ForceEffect"]),
        (dict, ["effect dict", "no effect"]),
        (type("Plain", (Lift,), {}), ["effect Plain", "@dataclass(frozen=True)"]),
    ],
)
def test_a_class_that_is_no_effect_is_told(kind: type[Effect], words: list[str]) -> None:
    with pytest.raises(UserError) as error:
        check_class(kind)
    for word in words:
        assert word in str(error.value)
