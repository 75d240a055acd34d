"""Effects of a user's own: known once they are registered, by a name of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.contract import check_effect
from drake_dress.models.effects.effect import ClockEffect, MountEffect, parameter
from drake_dress.models.effects.mass import SurfaceDensity
from drake_dress.models.effects.registry import (
    BUILT_IN,
    EFFECTS,
    own_effects,
    register_effect,
    unregister_effect,
)
from tests.models.effects.own import HemChain, registered


def test_a_registered_effect_is_the_last_of_the_list_until_it_is_forgotten() -> None:
    check_effect(HemChain)
    with registered():
        assert list(EFFECTS)[-1] == "hem_chain"
        assert EFFECTS["hem_chain"] is HemChain
        assert own_effects() == ("hem_chain",)
    assert set(EFFECTS) == BUILT_IN


def test_registering_returns_the_class_so_that_it_decorates() -> None:
    with registered():
        assert register_effect(HemChain) is HemChain


def test_a_class_that_is_defined_again_takes_its_own_place() -> None:
    again: Any = dataclass(frozen=True)(
        type("HemChain", (HemChain,), {"__module__": HemChain.__module__})
    )
    with registered():
        register_effect(again)
        assert EFFECTS["hem_chain"] is again


@pytest.mark.parametrize("name", ["surface_density", "nothing", "random", "discretisation"])
def test_names_of_the_package_are_taken(name: str) -> None:
    kind: Any = dataclass(frozen=True)(type("Heavy", (SurfaceDensity,), {"NAME": name}))
    with pytest.raises(UserError, match=f"effect Heavy: NAME: is '{name}'"):
        register_effect(kind)


def test_two_effects_cannot_have_one_name() -> None:
    other: Any = dataclass(frozen=True)(type("Other", (HemChain,), {}))
    with registered(), pytest.raises(UserError, match=r"'hem_chain', which .*own\.HemChain has"):
        register_effect(other)


@dataclass(frozen=True)
class Late(ClockEffect):
    NAME = "late"
    delay: float = parameter("s", 0.0, 1.0, 0.1)

    def apply(self, time: FloatArray) -> FloatArray:
        return time - self.delay

    def derivative(self, name: str, time: FloatArray) -> FloatArray:
        return 0.0 * time - 1.0


@dataclass(frozen=True)
class Soft(MountEffect):
    NAME = "soft"
    compliance: float = parameter("m/N", 0.0, 1.0, 0.1)

    def apply(self, force: FloatArray) -> FloatArray:
        return self.compliance * force

    def derivative(self, name: str, force: FloatArray) -> FloatArray:
        return force


@pytest.mark.parametrize("kind", [Late, Soft])
def test_what_would_have_no_effect_is_refused(kind: type[Late]) -> None:
    with pytest.raises(UserError, match="clock or a mount"):
        register_effect(kind)


def test_only_what_was_registered_can_be_forgotten() -> None:
    for name in ("air_drag", "hem_chain"):
        with pytest.raises(UserError, match=name):
            unregister_effect(name)
