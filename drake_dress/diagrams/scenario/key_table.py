"""Every key of a scenario, as a table: type, default, unit, allowed values and meaning.

The schema is the only source. The meaning of a key is its entry in the `Attributes` of its group's
docstring (`Args` for effects). The unit is at the end of that entry's first sentence. `ranges.py`
has the allowed values.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from drake_dress.diagrams.scenario.mirror import Mirror
from drake_dress.diagrams.scenario.ranges import choices_of, plain, range_of
from drake_dress.diagrams.scenario.schema import Scenario
from drake_dress.diagrams.scenario.typed import is_union
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.garment.mesh import LOOP_NAMES
from drake_dress.models.human.skin.scan import JOINT_NAMES
from drake_dress.models.sides import SIDES

_UNITS = (
    "m m/s m/s² m/s/N m/N m/(N·s) 1/m² s s/m s²/m² 1/s Hz N 1/N² N/m N·m N·m/rad N·m·s/rad Pa "
    "kg kg/m² rad rad/s degrees pixels years"
).split()
_UNIT = re.compile(
    ", ("
    + "|".join(re.escape(u) for u in sorted(_UNITS, key=len, reverse=True))
    + r")(?=[.;:]|$| \()"
)
_TYPES = {float: "number", int: "whole number", str: "text", bool: "true or false"}
# Allowed keys of a group of lists, by the group's name.
_NAMES = {"loops": LOOP_NAMES, "grasp": SIDES, "joints": JOINT_NAMES}


@dataclass(frozen=True)
class Key:
    """A key that holds a value.

    Attributes:
        name: dotted name, with `[]` after a list of groups.
        type: type in words.
        default: default as written in YAML; empty if there is none.
        unit: SI unit, or empty.
        allowed: choices, or a range that includes both ends; empty if any value is allowed.
        meaning: one or more sentences.
    """

    name: str
    type: str
    default: str
    unit: str
    allowed: str
    meaning: str


@dataclass(frozen=True)
class Group:
    """Keys that belong together.

    Attributes:
        name: dotted name; empty for the scenario itself.
        meaning: subject of the group.
        note: whether it is optional or a list; empty if it is always present once.
        keys: keys that hold values, in the schema's order.
    """

    name: str
    meaning: str
    note: str
    keys: tuple[Key, ...]


def scenario_groups() -> tuple[Group, ...]:
    """Returns all groups that hold values, in the schema's order, followed by the effects."""
    plain_groups = (group for group in _groups("", Scenario, Scenario(), "") if group.keys)
    return (*plain_groups, *map(_effect_group, EFFECTS.values()))


def scenario_keys() -> tuple[Key, ...]:
    """Returns all keys of a scenario that hold values."""
    return tuple(key for group in scenario_groups() for key in group.keys)


def markdown_table() -> str:
    """Returns all keys as Markdown, with a section and a table for each group."""
    lines: list[str] = []
    for group in scenario_groups():
        lines += [f"## {f'`{group.name}`' if group.name else 'The scenario itself'}", ""]
        lines += [f"{group.meaning} {group.note}".rstrip(), ""]
        lines += [
            "| key | type | default | unit | allowed | meaning |",
            "|---|---|---|---|---|---|",
        ]
        for key in group.keys:
            cells = (
                f"`{key.name.removeprefix(group.name).lstrip('.')}`",
                key.type,
                f"`{key.default}`" if key.default else "",
                key.unit,
                key.allowed,
                key.meaning,
            )
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        lines.append("")
    return "\n".join(lines)


def _groups(name: str, schema: type, values: Any, note: str) -> Iterator[Group]:
    """Yields a group and all groups below it, except the effects, which are no schema fields."""
    hints = typing.get_type_hints(schema)
    texts = _entries(inspect.getdoc(schema) or "")
    if issubclass(schema, Mirror):
        texts |= _entries(inspect.getdoc(schema.MODEL) or "")
    keys, below = [], []
    for entry in dataclasses.fields(schema):
        hint, optional, many = _unwrapped(hints[entry.name])
        inner = f"{name}.{entry.name}" if name else entry.name
        default = getattr(values, entry.name)
        if inner == "effects":
            continue
        if isinstance(hint, type) and dataclasses.is_dataclass(hint):
            below.append((inner, hint, default, optional, many))
        else:
            keys.append(_key(inner, hints[entry.name], default, texts.get(entry.name, "")))
    yield Group(name, _sentence(_summary(schema)), note, tuple(keys))
    for inner, hint, default, optional, many in below:
        given = hint() if many or default is None else default
        yield from _groups(inner + "[]" * many, hint, given, _note(default, optional, many))


def _effect_group(effect: type[Effect]) -> Group:
    """Returns the parameters of a physical effect and their standard deviations."""
    texts = _entries(inspect.getdoc(effect) or "")
    keys = []
    for p in effect.parameters():
        name = f"effects.{effect.NAME}.{p.name}"
        unit = "" if p.unit == "1" else f", {p.unit}"
        text = texts.get(p.name, _summary(effect)).replace(f"{unit}.", ".", 1)
        deviation = (
            f"standard deviation of `{p.name}` as `drake-dress explain` found it. "
            "Not used by the simulation."
        )
        values = {name: (p.off, text), f"{name}_std": (0.0, deviation)}
        keys += [
            replace(_key(key, float, *value), unit=unit.removeprefix(", "))
            for key, value in values.items()
        ]
    note = _note(None, optional=True, many=False)
    return Group(f"effects.{effect.NAME}", _sentence(_summary(effect)), note, tuple(keys))


def _note(default: Any, optional: bool, many: bool) -> str:
    if many:
        count = len(default)
        return f"A list of groups; by default it has {count or 'no'} entries."
    return "Optional; the defaults are those of a group that is given." if optional else ""


def _key(name: str, hint: Any, default: Any, text: str) -> Key:
    unit = _UNIT.search(text)
    words = text if unit is None else text[: unit.start()] + text[unit.end() :]
    return Key(
        name=name,
        type=_type(hint),
        default=_default(default),
        unit="" if unit is None else unit[1],
        allowed=_allowed(name),
        meaning=_sentence(words),
    )


def _unwrapped(hint: Any) -> tuple[Any, bool, bool]:
    """Returns the type inside an optional or a list, and whether it was optional and a list."""
    optional = is_union(hint)
    if optional:
        hint = next(t for t in typing.get_args(hint) if t is not type(None))
    many = typing.get_origin(hint) is list
    return (typing.get_args(hint)[0] if many else hint), optional, many


def _type(hint: Any) -> str:
    if is_union(hint):
        kinds = [kind for kind in typing.get_args(hint) if kind is not type(None)]
        if len(kinds) > 1:
            return " or ".join(_type(kind) for kind in kinds)
    inner, optional, many = _unwrapped(hint)
    if typing.get_origin(inner) is dict:
        return f"{_type(typing.get_args(inner)[1])} by name"
    words = _TYPES[inner]
    if many:
        words = f"list of {words}" if inner is str else f"list of {words}s"
    return f"{words}, or empty" if optional else words


def _default(value: Any) -> str:
    if value is None or value == "":
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _allowed(name: str) -> str:
    key = plain(name.replace("[]", ""))
    choices = choices_of(key)
    if choices is not None:
        return ", ".join(f"`{choice}`" for choice in choices)
    last = key.rsplit(".", 1)[-1]
    below = f".{_NAMES[last][0]}" if last in _NAMES else ""
    bounds = range_of(key + below)
    return "" if bounds is None else f"{bounds[0]:.6g} to {bounds[1]:.6g}"


def _summary(described: type) -> str:
    doc = inspect.getdoc(described) or ""
    return " ".join(doc.split("\n\n")[0].split())


def _entries(doc: str) -> dict[str, str]:
    """Returns the entries of a docstring's `Attributes` or `Args`, each on one line."""
    entries: dict[str, str] = {}
    section = re.search(r"^(?:Attributes|Args):\n((?: .*\n?|\n(?= ))+)", doc, re.MULTILINE)
    for line in section[1].splitlines() if section else ():
        head = re.match(r" {4}(\w+): (.*)", line)
        if head:
            name = head[1]
            entries[name] = head[2]
        else:
            entries[name] += f" {line.strip()}"
    return entries


def _sentence(text: str) -> str:
    """Returns the text with a capital first letter, unless it begins with a symbol or a name."""
    head = re.match(r"[a-z]+(?=[ ,])", text)
    return text if head is None else text[0].upper() + text[1:]
