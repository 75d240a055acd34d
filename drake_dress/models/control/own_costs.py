"""Costs of a plan that users register: each is a group of keys below `controller.costs`."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar, get_type_hints

from drake_dress.errors import UserError
from drake_dress.models.control.costs import GarmentCost

Kind = TypeVar("Kind", bound=type)

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_costs: dict[str, type] = {}
COSTS: Mapping[str, type] = MappingProxyType(_costs)
"""A live view: it grows with `register_cost`."""


def register_cost(kind: Kind) -> Kind:
    """Makes a cost known by its `NAME`; returns it, so it can be a decorator.

    Its fields are keys of scenarios, `controller.costs.NAME.FIELD`. A class that is defined again,
    as in a notebook's cell, takes the place of its earlier self.

    Args:
        kind: a frozen dataclass whose fields are numbers with defaults, with the methods of
            `GarmentCost`. It raises ValueError for values that it does not take.

    Raises:
        UserError: it is something else, or its name is taken.
    """
    source = f"cost {getattr(kind, '__name__', repr(kind))}"
    made: Any = vars(kind).get("__dataclass_params__") if isinstance(kind, type) else None
    if made is None or not made.frozen:
        raise UserError(source, "", "expected a class with @dataclass(frozen=True)")
    name: Any = getattr(kind, "NAME", None)
    if not (isinstance(name, str) and _NAME.fullmatch(name)):
        raise UserError(
            source, "NAME", f"is {name!r}, expected lower-case letters, digits and _, as ceiling"
        )
    hints = get_type_hints(kind)
    for entry in dataclasses.fields(kind):
        if hints[entry.name] is not float or not isinstance(entry.default, int | float):
            raise UserError(source, entry.name, "expected a float with a default")
    for method in ("value", "add_slope"):
        if not callable(getattr(kind, method, None)):
            raise UserError(source, method, "is missing, expected the methods of GarmentCost")
    there = _costs.get(name)
    if there is not None and _place(there) != _place(kind):
        raise UserError(source, "NAME", f"is {name!r}, which {_place(there)} has, expected another")
    _costs[name] = kind
    return kind


def unregister_cost(name: str) -> None:
    """Forgets a cost that was registered.

    Raises:
        UserError: there is none of that name.
    """
    if name not in _costs:
        raise UserError("cost", name, "is not registered, expected the name of one that is")
    del _costs[name]


def registered_costs(values: Mapping[str, Mapping[str, float]]) -> tuple[GarmentCost, ...]:
    """Returns the costs with the values of `controller.costs`, by name.

    Raises:
        UserError: a cost is not known, or does not take its values.
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


def _place(kind: type) -> str:
    """Returns where a class is defined."""
    return f"{kind.__module__}.{kind.__qualname__}"
