"""Checks the content of a YAML file against the schema; errors name the dotted key."""

import dataclasses
import difflib
import math
import types
import typing
from typing import Any

from drake_dress.diagrams.scenario.ranges import NUMBERS_AS_TEXT, choices_of, range_of
from drake_dress.diagrams.scenario.schema import SCHEMAS
from drake_dress.errors import UserError
from drake_dress.models.effects.registry import HOW_TO_LOAD


def field_type(source: str, key: str, name: Any, schema: Any) -> Any:
    """Returns the type of a dataclass's field; an error lists the valid names."""
    schema = _without_none(schema)
    dotted = f"{key}.{name}" if key else str(name)
    if not dataclasses.is_dataclass(schema):
        raise UserError(source, dotted, "unknown key, expected none below a value")
    hints = typing.get_type_hints(schema)
    if name not in hints:
        near = difflib.get_close_matches(str(name), hints, n=1)
        expected = f"did you mean {near[0]}?" if near else f"expected one of {', '.join(hints)}"
        if not hints:
            expected = "there is none"
        kinds = {"effects": "effect", "controller.costs": "cost"}
        what = f"unknown {kinds[key]} ({HOW_TO_LOAD})" if key in kinds else "unknown key"
        raise UserError(source, dotted, f"{what}, {expected}")
    return SCHEMAS[dotted]() if dotted in SCHEMAS else hints[name]


def typed(source: str, key: str, value: Any, schema: Any) -> Any:
    """Checks a value read from YAML against a type, and returns it."""
    if value is None and _takes_none(schema):
        return None
    schema = _of_value(_without_none(schema), value)
    if key in NUMBERS_AS_TEXT and type(value) is int:
        value = str(value)
    origin = typing.get_origin(schema)
    if dataclasses.is_dataclass(schema):
        if not isinstance(value, dict):
            raise UserError(source, key, f"is {kind_of(value)}, expected keys with values")
        inner = {name: field_type(source, key, name, schema) for name in value}
        return {
            name: typed(source, f"{key}.{name}" if key else str(name), item, inner[name])
            for name, item in value.items()
        }
    if origin is dict:
        if not isinstance(value, dict):
            raise UserError(source, key, f"is {kind_of(value)}, expected names with lists")
        below = typing.get_args(schema)[1]
        return {name: typed(source, f"{key}.{name}", v, below) for name, v in value.items()}
    if origin is list:
        if not isinstance(value, list):
            raise UserError(source, key, f"is {kind_of(value)}, expected a list")
        below = typing.get_args(schema)[0]
        return [typed(source, f"{key}[{i}]", item, below) for i, item in enumerate(value)]
    _check_plain(source, key, value, schema)
    return value


def _check_plain(source: str, key: str, value: Any, schema: Any) -> None:
    """Checks a number or a text against its type."""
    if schema is float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UserError(source, key, f"is {kind_of(value)}, expected a number")
    elif schema is int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise UserError(source, key, f"is {kind_of(value)}, expected a whole number")
    elif schema is str:
        choices = choices_of(key)
        if choices is not None and value not in choices:
            raise UserError(source, key, f"is {kind_of(value)}, expected {' or '.join(choices)}")
        if not isinstance(value, str):
            raise UserError(source, key, f"is {kind_of(value)}, expected text")


def check_ranges(source: str, key: str, value: Any) -> None:
    """Checks all numbers below a dotted key: they must be finite and within their ranges."""
    if dataclasses.is_dataclass(value):
        for entry in dataclasses.fields(value):
            inner = f"{key}.{entry.name}" if key else entry.name
            check_ranges(source, inner, getattr(value, entry.name))
    elif isinstance(value, list):
        for i, item in enumerate(value):
            check_ranges(source, f"{key}[{i}]", item)
    elif isinstance(value, dict):
        for name, item in value.items():
            check_ranges(source, f"{key}.{name}", item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise UserError(source, key, f"is {value}, expected a finite number")
        bounds = range_of(key)
        if bounds is not None and not bounds[0] <= value <= bounds[1]:
            raise UserError(source, key, f"is {value}, expected {bounds[0]:g} to {bounds[1]:g}")


def is_union(schema: Any) -> bool:
    """Returns whether a type is a union, such as an optional one."""
    return typing.get_origin(schema) in (typing.Union, types.UnionType)


def _takes_none(schema: Any) -> bool:
    return is_union(schema) and type(None) in typing.get_args(schema)


def _without_none(schema: Any) -> Any:
    if _takes_none(schema):
        return next(t for t in typing.get_args(schema) if t is not type(None))
    return schema


def _of_value(schema: Any, value: Any) -> Any:
    """Returns the type of a union that a value is checked against: text, or the first other one."""
    if not is_union(schema):
        return schema
    kinds = typing.get_args(schema)
    if isinstance(value, str) and str in kinds:
        return str
    return next(kind for kind in kinds if kind is not str)


def kind_of(value: Any) -> str:
    """Returns a description of a given value."""
    if value is None:
        return "empty"
    if isinstance(value, dict):
        return "a group of keys"
    if isinstance(value, list):
        return "a list"
    return repr(value)
