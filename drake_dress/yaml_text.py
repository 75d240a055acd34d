"""Reads YAML strictly: rejects values that parsers disagree about or drop silently.

YAML 1.1 and 1.2 give different values to the same scalar: `010` is 8 or 10, `1:30` is 90 or text,
`no` is false or text. Loaders keep the last of two equal keys. A file that depends on either is
ambiguous, so the error gives the line and what to write instead. All other scalars follow the core
schema of YAML 1.2.

The text is parsed as a stream of events, without recursion, so that nesting depth cannot crash the
process. Aliases are copied up to a limit, so that a small file cannot grow without bound.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from drake_dress.errors import UserError

# A scenario is about six levels deep and has some thousand values.
MAX_DEPTH, MAX_VALUES = 40, 100_000
_CORE = "tag:yaml.org,2002:"
_MERGE = "<<"
_NULL = frozenset(("", "~", "null", "Null", "NULL"))
_TRUE, _FALSE = frozenset(("true", "True", "TRUE")), frozenset(("false", "False", "FALSE"))
# Booleans in YAML 1.1 that are text in 1.2.
_YES, _NO = frozenset(("yes", "on")), frozenset(("no", "off"))
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_LEADING_ZERO = re.compile(r"[-+]?0+[0-9]+")
_OTHER_BASE = re.compile(r"([-+]?)0([xob])([0-9a-fA-F_]+)")
_UNDERSCORES = re.compile(r"[-+]?(\.[0-9][0-9_]*|[0-9][0-9_]*(\.[0-9_]*)?)([eE][-+]?[0-9]+)?")
_SIXTIES = re.compile(r"[-+]?[0-9][0-9_]*(:[0-9]{1,2})+(\.[0-9_]*)?")
_DATE = re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}([Tt ].*)?")
_BASES = {"x": 16, "o": 8, "b": 2}
_LEAST, _MOST = -(2**63), 2**63 - 1


def read_yaml(source: str, text: str, one_value: bool = False) -> Any:
    """Returns the value of a YAML document: None, bool, int, float, str, lists, dicts of these.

    Args:
        source: Name of the file or option, for messages.
        text: Text of the document.
        one_value: Whether `text` is a single value of an option; messages then omit the line.

    Raises:
        UserError: The text is not YAML or is rejected; the message gives the line.
    """
    reader = _Reader(source, one_value)
    try:
        # The scanner rejects characters that YAML does not allow before it yields any event.
        return reader.document(yaml.parse(text, Loader=yaml.SafeLoader))
    except yaml.MarkedYAMLError as error:
        problem = error.problem or "not YAML"
        if "'\\t'" in problem:
            problem = "a tab, expected spaces"
        else:
            problem += ", expected YAML"
        raise reader.error(error.problem_mark, problem) from error
    except yaml.YAMLError as error:
        raise UserError(source, "", f"{error}, expected YAML") from error


@dataclass
class _Level:
    """A list or mapping that is being read.

    Attributes:
        value: Content so far.
        anchor: Anchor name for aliases, if any.
        line: Line at which it starts, from 1.
        lines: Line of each key of a mapping.
        key: Key of the next value; None if a key comes next.
    """

    value: list[Any] | dict[str, Any]
    anchor: str | None
    line: int
    lines: dict[str, int] = field(default_factory=dict)
    key: str | None = None


class _Reader:
    """Builds the value of a document from its events."""

    def __init__(self, source: str, one_value: bool) -> None:
        self._source, self._one_value = source, one_value
        self._levels: list[_Level] = []
        self._anchors: dict[str, Any] = {}
        self._root: Any = None
        self._count = 0

    def error(self, mark: yaml.Mark | None, message: str, key: str = "") -> UserError:
        """Returns the error for a position in the text."""
        line = "" if mark is None or self._one_value else f"line {mark.line + 1}"
        where = ".".join(part for part in (self._path(), key) if part)
        if where and line:
            return UserError(self._source, where, f"{line}: {message}")
        return UserError(self._source, where or line, message)

    def document(self, events: Iterator[yaml.Event]) -> Any:
        """Returns the value of the only document; None if there is none."""
        documents = 0
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    message = "a second document begins (---), expected one"
                    raise self.error(event.start_mark, message)
            elif isinstance(event, yaml.NodeEvent):
                self._node(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                level = self._levels.pop()
                if level.anchor is not None:
                    self._anchors[level.anchor] = level.value
                self._put(level.value, event.start_mark, level.line)
        return self._root

    def _node(self, event: yaml.NodeEvent) -> None:
        mark = event.start_mark
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._anchors:
                raise self.error(mark, f"*{event.anchor} stands for nothing that ended before it")
            self._put(self._copy(self._anchors[event.anchor], mark), mark, mark.line + 1)
            return
        tag = getattr(event, "tag", None)
        if tag is not None and tag not in ("!", f"{_CORE}str", f"{_CORE}map", f"{_CORE}seq"):
            short = tag.replace(_CORE, "!!")
            raise self.error(mark, f"has the tag {short}, expected a value without a tag")
        if isinstance(event, yaml.ScalarEvent):
            text = tag is not None or event.style is not None
            value = event.value if text else self._plain(event)
            self._counted(mark)
            if event.anchor is not None:
                self._anchors[event.anchor] = value
            self._put(value, mark, mark.line + 1)
            return
        if len(self._levels) >= MAX_DEPTH:
            raise self.error(mark, f"is nested deeper than {MAX_DEPTH} levels")
        if self._key_comes():
            raise self.error(mark, "a list or group is no key, expected a name")
        value = {} if isinstance(event, yaml.MappingStartEvent) else []
        self._counted(mark)
        self._levels.append(_Level(value, event.anchor, mark.line + 1))

    def _key_comes(self) -> bool:
        level = self._levels[-1] if self._levels else None
        return level is not None and isinstance(level.value, dict) and level.key is None

    def _put(self, value: Any, mark: yaml.Mark, line: int) -> None:
        """Adds a value or key to the current list or mapping, or sets the root."""
        if not self._levels:
            self._root = value
            return
        level = self._levels[-1]
        if isinstance(level.value, list):
            level.value.append(value)
        elif level.key is None:
            if not isinstance(value, str):
                shown = "empty" if value is None else repr(value)
                raise self.error(mark, f"the key is {shown}, expected a name")
            self._told_once(level, value, line, mark)
            level.key = value
        else:
            key, level.key = level.key, None
            if key == _MERGE:
                self._merge(level, value, mark, line)
            else:
                level.value[key] = value

    def _merge(self, level: _Level, value: Any, mark: yaml.Mark, line: int) -> None:
        """Adds the keys of other mappings; none may be a duplicate."""
        assert isinstance(level.value, dict)
        for group in value if isinstance(value, list) else [value]:
            if not isinstance(group, dict):
                raise self.error(mark, "<< takes a group of keys, expected an alias of one")
            for key, item in group.items():
                self._told_once(level, key, line, mark)
                level.value[key] = item

    def _told_once(self, level: _Level, key: str, line: int, mark: yaml.Mark) -> None:
        if key in level.lines:
            first = level.lines[key]
            lines = f", lines {first} and {line}" if first != line else f" in line {line}"
            lines = "" if self._one_value else lines
            before = self._path()
            dotted = f"{before}.{key}" if before else key
            raise UserError(self._source, dotted, f"stands twice{lines}, expected it once")
        level.lines[key] = line

    def _path(self) -> str:
        """Returns the dotted key of the current position."""
        path = ""
        for level in self._levels:
            if isinstance(level.value, list):
                path += f"[{len(level.value)}]"
            elif level.key is not None:
                path += f".{level.key}" if path else level.key
        return path if len(path) <= 100 else f"{path[:100]}…"

    def _copy(self, value: Any, mark: yaml.Mark) -> Any:
        self._counted(mark)
        if isinstance(value, dict):
            return {key: self._copy(item, mark) for key, item in value.items()}
        if isinstance(value, list):
            return [self._copy(item, mark) for item in value]
        return value

    def _counted(self, mark: yaml.Mark) -> None:
        self._count += 1
        if self._count > MAX_VALUES:
            raise self.error(mark, f"more than {MAX_VALUES} values, aliases included")

    def _plain(self, event: yaml.ScalarEvent) -> Any:
        """Returns the value of an unquoted scalar."""
        word = event.value
        try:
            return plain_value(word)
        except ValueError as error:
            message = str(error)
            if self._key_comes():
                message = f"the key {message}"
            raise self.error(event.start_mark, message) from None


def write_yaml(content: Any) -> str:
    """Returns YAML from which `read_yaml` restores the content; keeps the order of keys."""
    text: str = yaml.dump(content, Dumper=_Dumper, sort_keys=False)
    return text


class _Dumper(yaml.SafeDumper):
    """Quotes text that would not be read back as the same text without quotes."""


def _represent_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    try:
        style = None if plain_value(text) == text else "'"
    except ValueError:
        style = "'"
    return dumper.represent_scalar(f"{_CORE}str", text, style=style)


_Dumper.add_representer(str, _represent_text)


def plain_value(word: str) -> bool | int | float | str | None:
    """Returns the value of an unquoted scalar.

    Raises:
        ValueError: YAML parsers disagree about it, or it is out of range; the message says what to
            write instead.
    """
    if word in _NULL:
        return None
    if word in _TRUE or word in _FALSE:
        return word in _TRUE
    if word.lower() in _YES | _NO:
        meant = "true" if word.lower() in _YES else "false"
        raise ValueError(f"{word} is {meant} or text, expected {meant} or '{word}'")
    if _INTEGER.fullmatch(word):
        return _whole(word)
    if _LEADING_ZERO.fullmatch(word):
        raise ValueError(_zeros(word))
    if _FLOAT.fullmatch(word):
        return _decimal(word)
    if _SPECIAL.fullmatch(word):
        return float(word.replace(".", ""))
    told = _other_number(word)
    if told:
        raise ValueError(told)
    return word


def _whole(word: str) -> int:
    # Conversion takes quadratic time, and Python rejects thousands of digits.
    value = int(word) if len(word) < 30 else _MOST + 1
    if not _LEAST <= value <= _MOST:
        raise ValueError(f"{_short(word)} is out of range, expected at most 64 bits")
    return value


def _decimal(word: str) -> float:
    number = float(word)
    if not math.isfinite(number):
        raise ValueError(f"{_short(word)} is out of range, expected at most 1.7e308")
    return number


def _other_number(word: str) -> str:
    """Returns why a scalar that some parsers read as a number or date is rejected, or ""."""
    base = _OTHER_BASE.fullmatch(word)
    if base:
        sign, letter, digits = base.groups()
        digits = digits.replace("_", "")
        if not digits:
            return f"{word} is a number without digits or text, expected '{word}'"
        try:
            number = int(sign + digits, _BASES[letter])
        except ValueError:
            return ""
        if _LEAST <= number <= _MOST:
            return f"{word} is a number or text, expected {number} or '{word}'"
        return f"{_short(word)} is out of range, expected at most 64 bits"
    if "_" in word and _UNDERSCORES.fullmatch(word):
        return f"{word} is a number or text, expected {word.replace('_', '')} or '{word}'"
    if _SIXTIES.fullmatch(word):
        seconds = 0.0
        for part in word.lstrip("+-").replace("_", "").split(":"):
            seconds = 60.0 * seconds + float(part)
        sign = "-" if word.startswith("-") else ""
        return f"{word} is {sign}{seconds:.15g} or text, expected {sign}{seconds:.15g} or '{word}'"
    if _DATE.fullmatch(word):
        return f"{word} is a date or text, expected '{word}'"
    return ""


def _zeros(word: str) -> str:
    sign, digits = ("-", word[1:]) if word[0] == "-" else ("", word.lstrip("+"))
    decimal = digits.lstrip("0") or "0"
    if set(digits) <= set("01234567") and len(digits) < 20:
        octal = int(digits, 8)
        if str(octal) != decimal:
            word = _short(word)
            return f"{word} is {sign}{octal} or {sign}{decimal}, expected one of these"
    return f"{_short(word)} begins with a zero, expected {sign}{_short(decimal)}"


def _short(word: str) -> str:
    return word if len(word) <= 24 else f"{word[:20]}…"
