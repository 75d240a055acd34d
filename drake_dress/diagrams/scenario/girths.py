"""Girths in a scenario, which are replaced by radii and widths when it is loaded."""

from __future__ import annotations

from typing import Any

from drake_dress.diagrams.scenario.ranges import range_of
from drake_dress.errors import UserError
from drake_dress.models.human.girths import (
    GIRTHS,
    LIMB_GIRTHS,
    TRUNK_GIRTHS,
    radius_of,
    section_of,
)

# Groups of a person that may have girths.
_GROUPS = ("measures", "left_measures", "right_measures")


def replace_girths(source: str, content: dict[str, Any], defaults: dict[str, float | None]) -> None:
    """Replaces the girths in the content of a scenario by radii, widths and depths.

    Args:
        source: name of the scenario in messages.
        content: content of a file, of the schema's types.
        defaults: values of `person.measures` that count as not given; none for a file.

    Raises:
        UserError: a girth is out of range, is given together with what it stands for, or is less
            than the depth allows.
    """
    person = content.get("person") or {}
    for group in _GROUPS:
        values = person.get(group) or {}
        given = {
            name: value
            for name, value in values.items()
            if value is not None and (group != "measures" or value != defaults.get(name))
        }
        for name in GIRTHS:
            girth = values.pop(name, None)
            if girth is None:
                continue
            key = f"person.{group}.{name}"
            _check_range(source, key, girth)
            stands_for = LIMB_GIRTHS.get(name, name.replace("_girth", "_width"))
            if stands_for in given:
                raise UserError(
                    source,
                    key,
                    f"is given beside {stands_for}, {given[stands_for]} m, expected one of both",
                )
            if name in LIMB_GIRTHS:
                values[stands_for] = radius_of(girth)
                continue
            depth = name.replace("_girth", "_depth")
            try:
                sizes = section_of(girth, given.get(depth), TRUNK_GIRTHS[name])
            except ValueError:
                raise UserError(
                    source,
                    key,
                    f"is {girth} m, expected more than twice {depth}, {given[depth]} m",
                ) from None
            values[stands_for], values[depth] = sizes


def _check_range(source: str, key: str, girth: float) -> None:
    bounds = range_of(key)
    if bounds is not None and not bounds[0] <= girth <= bounds[1]:
        raise UserError(source, key, f"is {girth}, expected {bounds[0]:.3g} to {bounds[1]:.3g}")
