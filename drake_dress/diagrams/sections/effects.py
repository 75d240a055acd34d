"""The section `effects`: deviations of the plant from the ideal model."""

from __future__ import annotations

from collections.abc import Mapping

from drake_dress.errors import UserError
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS, HOW_TO_LOAD


def effects(section: Mapping[str, Mapping[str, float]]) -> tuple[Effect, ...]:
    """Returns the effects that are switched on, in the order of the registry.

    Args:
        section: parameters of each effect, by its name.

    Raises:
        UserError: an effect or a parameter is unknown.
        ValueError: a parameter is out of its range.
    """
    unknown = next((name for name in section if name not in EFFECTS), None)
    if unknown is not None:
        raise UserError("scenario", f"effects.{unknown}", f"unknown effect ({HOW_TO_LOAD})")
    on = [_effect(n, section[n]) for n in EFFECTS if n in section]
    return tuple(e for e in on if not e.is_off)


def _effect(name: str, values: Mapping[str, float]) -> Effect:
    """Returns an effect; checks its keys, because scenarios made in Python may be unchecked."""
    kind = EFFECTS[name]
    names = [p.name for p in kind.parameters()]
    for key in values:
        if key.removesuffix("_std") not in names:
            raise UserError(
                "scenario", f"effects.{name}.{key}", f"unknown key, expected {', '.join(names)}"
            )
    return kind(**{n: values[n] for n in names if n in values})
