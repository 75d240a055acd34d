"""Costs that users register."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from drake_dress.diagrams.scenario import checked_scenario, load_scenario, resolved_yaml
from drake_dress.errors import UserError
from drake_dress.models.control.costs import PlannedStep, Slope
from drake_dress.models.control.own_costs import (
    COSTS,
    register_cost,
    registered_costs,
    unregister_cost,
)
from drake_dress.shipped import shipped_scenario


@dataclass(frozen=True)
class Height:
    """A cost of nothing."""

    NAME = "height"
    low: float = 0.5
    high: float = 1.5

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"low is {self.low:g}, expected below high, {self.high:g}")

    def value(self, step: PlannedStep) -> float:
        return 0.0

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        pass


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    register_cost(Height)
    yield
    unregister_cost("height")
    assert "height" not in COSTS


def loaded(*overrides: str) -> Any:
    return load_scenario(shipped_scenario("dummy_standing"), overrides)


def test_its_fields_are_keys_of_scenarios() -> None:
    scenario = loaded("controller.costs.height.high=2")
    assert scenario.controller.costs == {"height": {"low": 0.5, "high": 2.0}}
    (cost,) = registered_costs(scenario.controller.costs)
    assert cost == Height(0.5, 2.0)
    assert checked_scenario(scenario) == scenario
    assert "height" in resolved_yaml(scenario)
    assert loaded().controller.costs == {}


@pytest.mark.parametrize(
    ("override", "key", "words"),
    [
        ("controller.costs.heigth.low=1", "controller.costs.heigth", "did you mean height?"),
        ("controller.costs.height.middle=1", "controller.costs.height.middle", "low, high"),
        ("controller.costs.height.low=high", "controller.costs.height.low", "expected a number"),
        ("controller.costs.height.low=9", "controller.costs.height", "expected below high, 1.5"),
    ],
)
def test_a_mistake_is_told_with_its_key(override: str, key: str, words: str) -> None:
    with pytest.raises(UserError) as error:
        loaded(override)
    assert error.value.key == key
    assert words in error.value.message


def test_without_any_cost_the_name_is_told() -> None:
    unregister_cost("height")
    try:
        with pytest.raises(UserError, match=r"unknown cost .*--plugin.*there is none"):
            loaded("controller.costs.height.low=1")
    finally:
        register_cost(Height)


def test_a_class_that_is_defined_again_takes_the_place_of_the_first() -> None:
    again: type = dataclass(frozen=True)(
        type("Height", (), {**_members(Height), "__module__": __name__, "__qualname__": "Height"})
    )
    assert register_cost(again) is again
    assert COSTS["height"] is again


def _members(kind: type) -> dict[str, Any]:
    return {n: v for n, v in vars(kind).items() if n in ("NAME", "value", "add_slope")}


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"NAME": "Two words"}, "NAME: is 'Two words'"),
        ({"NAME": "height"}, "NAME: is 'height', which .*Height has"),
        ({"value": None}, "value: is missing"),
        ({"add_slope": None}, "add_slope: is missing"),
        ({"weight": "1", "__annotations__": {"weight": "str"}}, "weight: expected a float"),
    ],
)
def test_what_is_no_cost_is_refused(changed: dict[str, Any], words: str) -> None:
    members = {**_members(Height), "NAME": "other", "__module__": __name__} | changed
    with pytest.raises(UserError, match=words):
        register_cost(dataclass(frozen=True)(type("Other", (), members)))
    assert set(COSTS) == {"height"}


def test_a_class_that_is_not_frozen_is_refused() -> None:
    with pytest.raises(UserError, match="frozen=True"):
        register_cost(type("Loose", (), dict(_members(Height))))
    with pytest.raises(UserError, match="frozen=True"):
        register_cost(dataclass(type("Loose", (), dict(_members(Height)))))
