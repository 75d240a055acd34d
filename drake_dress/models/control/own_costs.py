"""User-defined costs of a plan: each is a group of scenario keys below `controller.costs`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar, get_type_hints

from drake_dress.errors import UserError
from drake_dress.models.control.costs import GarmentCost
from drake_dress.models.register import check_name, enter

Kind = TypeVar("Kind", bound=type)

_costs: dict[str, type] = {}
COSTS: Mapping[str, type] = MappingProxyType(_costs)
"""A live view: it grows with `register_cost`."""


def register_cost(kind: Kind) -> Kind:
    """Registers a cost under its `NAME`; returns it, so that it can be used as a decorator.

    Its fields become scenario keys, `controller.costs.NAME.FIELD`. A class that is defined again,
    as in a notebook cell, replaces the earlier one.

    Args:
        kind: a frozen dataclass whose fields are numbers with defaults, with the methods of
            `GarmentCost`. It raises ValueError for values that it rejects.

    Raises:
        UserError: `kind` is not such a class, or its name is taken.
    """
    source = f"cost {getattr(kind, '__name__', repr(kind))}"
    made: Any = vars(kind).get("__dataclass_params__") if isinstance(kind, type) else None
    if made is None or not made.frozen:
        raise UserError(source, "", "expected a class with @dataclass(frozen=True)")
    check_name(source, kind, "ceiling")
    hints = get_type_hints(kind)
    for entry in dataclasses.fields(kind):
        if hints[entry.name] is not float or not isinstance(entry.default, int | float):
            raise UserError(source, entry.name, "expected a float with a default")
    for method in ("value", "add_slope"):
        if not callable(getattr(kind, method, None)):
            raise UserError(source, method, "is missing, expected the methods of GarmentCost")
    enter(_costs, source, kind)
    return kind


def unregister_cost(name: str) -> None:
    """Removes a registered cost.

    Raises:
        UserError: no cost of that name is registered.
    """
    if name not in _costs:
        raise UserError("cost", name, "is not registered, expected the name of one that is")
    del _costs[name]


def registered_costs(values: Mapping[str, Mapping[str, float]]) -> tuple[GarmentCost, ...]:
    """Returns the costs with the values of `controller.costs`, by name.

    Raises:
        UserError: a cost is unknown, or rejects its values.
    """
    found: list[GarmentCost] = []
    for name, given in values.items():
        if name not in COSTS:
            raise UserError("controller.costs", name, "is not registered")
        try:
            found.append(COSTS[name](**given))
        except ValueError as error:
            raise UserError("controller.costs", name, str(error)) from error
    return tuple(found)
