"""Groups of a scenario that equal the settings of a model, without a second definition.

A model's settings are a frozen dataclass with tuples. Drake's YAML loader needs a plain dataclass
with lists. A mirror is such a plain dataclass with the fields and defaults of the model's settings,
so each default is defined only in the model.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any, TypeVar

Model = TypeVar("Model")


class Mirror:
    """Base of the classes that `mirror_of` fills with fields."""

    MODEL: typing.ClassVar[type]

    if TYPE_CHECKING:
        __dataclass_fields__: typing.ClassVar[dict[str, dataclasses.Field[Any]]]

        def __init__(self, **values: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...


def mirror_of(
    model: type, without: Collection[str] = (), lengths: Collection[str] = ()
) -> Callable[[type[Mirror]], type[Any]]:
    """Returns a decorator that gives a class the fields of a model's settings.

    If a field of the model is itself a settings class, or a tuple of them, the mirror of that class
    must be defined first.

    Args:
        model: frozen dataclass or named tuple, all of whose fields have defaults.
        without: its fields that the scenario has elsewhere.
        lengths: further optional numbers, which are replaced by the model's when it is loaded.
    """

    def decorate(cls: type[Mirror]) -> type[Any]:
        hints = typing.get_type_hints(model)
        entries = []
        for name in _field_names(model):
            if name in without:
                continue
            default = getattr(model(), name)
            entries.append((name, _plain_type(hints[name]), _field(default)))
        entries += [(name, float | None, _field(None)) for name in lengths]
        namespace = {"__doc__": cls.__doc__, "__module__": cls.__module__, "MODEL": model}
        made = dataclasses.make_dataclass(
            cls.__name__, entries, bases=(Mirror,), namespace=namespace
        )
        _MIRRORS[model] = made
        return made

    return decorate


def model_of(values: Mirror, **elsewhere: Any) -> Any:
    """Returns the model's settings with the values of a scenario's group.

    Args:
        values: the group.
        elsewhere: fields of the model that the group omits.
    """
    names = set(_field_names(values.MODEL))
    given = {
        e.name: _frozen(getattr(values, e.name))
        for e in dataclasses.fields(values)
        if e.name in names
    }
    return values.MODEL(**given, **elsewhere)


def _field_names(model: type) -> list[str]:
    """Returns the fields of a dataclass or a named tuple."""
    if dataclasses.is_dataclass(model):
        return [entry.name for entry in dataclasses.fields(model)]
    names: tuple[str, ...] = model._fields  # type: ignore[attr-defined]
    return list(names)


# Mirrors by the model's class.
_MIRRORS: dict[type, type[Any]] = {}


def _plain_type(hint: Any) -> Any:
    if hint in _MIRRORS:
        return _MIRRORS[hint]
    if typing.get_origin(hint) is tuple:
        return list[_plain_type(typing.get_args(hint)[0])]  # type: ignore[misc]
    return hint


def _field(default: Any) -> Any:
    """Returns a dataclass field whose default is a plain copy of a model's value."""
    if isinstance(default, tuple) or type(default) in _MIRRORS:
        return dataclasses.field(default_factory=lambda: _plain(default))
    return dataclasses.field(default=default)


def _plain(value: Any) -> Any:
    mirror = _MIRRORS.get(type(value))
    if mirror is None:
        return [_plain(item) for item in value] if isinstance(value, tuple) else value
    return mirror(**{e.name: _plain(getattr(value, e.name)) for e in dataclasses.fields(mirror)})


def _frozen(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_frozen(item) for item in value)
    return model_of(value) if isinstance(value, Mirror) else value
