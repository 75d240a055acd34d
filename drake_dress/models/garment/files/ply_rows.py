"""Reads the rows of a PLY file's elements, as text or as bytes of either order.

    ply
    format ascii | binary_little_endian | binary_big_endian 1.0
    element NAME COUNT
    property TYPE NAME
    property list TYPE TYPE NAME
    end_header

Every number is checked against its type and every row against the header. No memory is reserved for
rows that the file does not hold.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError

_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class Property:
    """A property of an element: a number, or a list of numbers.

    Attributes:
        name: name of the property.
        dtype: type of a number, without its byte order.
        counted: type of the list's length; empty for a single number.
    """

    name: str
    dtype: str
    counted: str = ""


@dataclass
class Element:
    """An element as the header declares it.

    Attributes:
        name: name of the element.
        count: number of its rows.
        properties: properties of each row, in order.
    """

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """Names of the properties."""
        return [p.name for p in self.properties]


# Maps a property's name to (count,) numbers, or to a list of lists of numbers.
Rows = dict[str, Any]


def read_header(header: str, source: str) -> tuple[str, list[Element]]:
    """Returns the byte order (empty for text) and the elements.

    Raises:
        UserError: the header is not valid PLY.
    """
    order: str | None = None
    elements: list[Element] = []
    for number, line in enumerate(header.split("\n"), 1):
        words = line.split()
        if not words or words[0] in ("ply", "comment", "obj_info", "end_header"):
            continue
        if words[0] == "format" and len(words) == 3 and words[1] in _FORMATS and order is None:
            order = _FORMATS[words[1]]
        elif words[0] == "element" and len(words) == 3 and re.fullmatch(r"\d{1,18}", words[2]):
            if words[1] in [element.name for element in elements]:
                raise _bad(source, number, f"element {words[1]} is told twice")
            elements.append(Element(words[1], int(words[2])))
        elif words[0] == "property" and elements:
            elements[-1].properties.append(_property(words, source, number))
        else:
            raise _bad(source, number, f"{line.strip()[:60]!r}, expected format, element, property")
    if order is None:
        raise UserError(source, "format", "is missing, expected ascii or binary_…_endian")
    _check_elements(elements, source)
    return order, elements


def _check_elements(elements: list[Element], source: str) -> None:
    for element in elements:
        if element.count and not element.properties:
            raise UserError(source, f"element {element.name}", "has rows without properties")
        if len(set(element.names)) < len(element.names):
            raise UserError(source, f"element {element.name}", "has two properties of one name")


def _property(words: list[str], source: str, number: int) -> Property:
    if len(words) == 3 and words[1] in _TYPES:
        return Property(words[2], _TYPES[words[1]])
    known = len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES
    if known and _TYPES[words[2]][0] != "f":
        return Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
    raise _bad(source, number, f"{' '.join(words)[:60]!r}, expected property [list TYPE] TYPE NAME")


def _bad(source: str, number: int, what: str) -> UserError:
    return UserError(source, f"line {number}", f"of the header: {what}")


def read_text(body: bytes, elements: list[Element], source: str) -> dict[str, Rows]:
    """Returns the rows of each element, one line each; blank lines are skipped.

    Raises:
        UserError: lines are missing, too many, or do not match the header.
    """
    lines = [line for line in re.split(rb"\r\n|\n|\r", body) if line.strip()]
    found, at = {}, 0
    for element in elements:
        if at + element.count > len(lines):
            raise too_short(source, element, len(lines) - at)
        rows: Rows = {name: [] for name in element.names}
        for k, line in enumerate(lines[at : at + element.count]):
            _take_words(line.split(), element, rows, f"{element.name} {k}", source)
        found[element.name] = _as_arrays(rows, element, source)
        at += element.count
    if at < len(lines):
        raise too_long(source)
    return found


def _take_words(words: list[bytes], element: Element, rows: Rows, key: str, source: str) -> None:
    at = 0
    for p in element.properties:
        if not p.counted:
            if at >= len(words):
                raise UserError(source, key, f"has {len(words)} values, {p.name} is missing")
            rows[p.name].append(_number(words[at], p.dtype, key, source))
            at += 1
            continue
        if at >= len(words):
            raise UserError(source, key, f"the length of {p.name} is missing")
        length = int(_number(words[at], p.counted, key, source))
        if length < 0 or at + 1 + length > len(words):
            raise UserError(source, key, f"counts {length} values of {p.name}, holds fewer")
        items = words[at + 1 : at + 1 + length]
        rows[p.name].append([_number(word, p.dtype, key, source) for word in items])
        at += 1 + length
    if at < len(words):
        raise UserError(source, key, f"has {len(words)} values, expected {at}")


def _number(word: bytes, dtype: str, key: str, source: str) -> float:
    try:
        # an integer written with a point is refused
        value = float(word) if dtype[0] == "f" else int(word)
    except ValueError:
        told = word[:40].decode(errors="replace")
        raise UserError(source, key, f"holds {told!r}, expected a number") from None
    if dtype[0] != "f" and not np.iinfo(dtype).min <= value <= np.iinfo(dtype).max:
        raise UserError(source, key, f"holds {value}, which its type cannot")
    return value


def _as_arrays(rows: Rows, element: Element, source: str) -> Rows:
    return {
        p.name: rows[p.name] if p.counted else np.array(rows[p.name], dtype=p.dtype)
        for p in element.properties
    }


def read_binary(body: bytes, order: str, elements: list[Element], source: str) -> dict[str, Rows]:
    """Returns the rows of each element; `order` is the byte order.

    Raises:
        UserError: bytes are missing, or follow the last row.
    """
    found, at = {}, 0
    for element in elements:
        if any(p.counted for p in element.properties):
            rows, at = _listed(body, at, order, element, source)
        else:
            dtype = np.dtype([(p.name, order + p.dtype) for p in element.properties])
            end = at + dtype.itemsize * element.count
            if end > len(body):
                raise too_short(source, element, (len(body) - at) // max(1, dtype.itemsize))
            table = np.frombuffer(body, dtype, element.count, at)
            rows, at = {name: table[name] for name in element.names}, end
        found[element.name] = rows
    if at < len(body):
        raise too_long(source)
    return found


def _listed(body: bytes, at: int, order: str, element: Element, source: str) -> tuple[Rows, int]:
    """Returns the rows of an element with lists, and where the next element begins."""
    alike = _of_one_length(body, at, order, element)
    if alike is not None:
        return alike
    rows: Rows = {name: [] for name in element.names}
    for k in range(element.count):
        for p in element.properties:
            length = 1
            if p.counted:
                head, at = _taken(body, at, order + p.counted, 1, element, k, source)
                length = int(head[0])
                if length < 0:
                    raise UserError(source, f"{element.name} {k}", f"counts {length} values")
            values, at = _taken(body, at, order + p.dtype, length, element, k, source)
            rows[p.name].append(values.tolist() if p.counted else values[0])
    return _as_arrays(rows, element, source), at


def _of_one_length(body: bytes, at: int, order: str, element: Element) -> tuple[Rows, int] | None:
    """Returns what `_listed` does if all lists are as long as in the first row, else None."""
    if element.count == 0:
        return {name: [] for name in element.names}, at
    layout: list[Any] = []
    end = at
    for p in element.properties:
        length = 1
        if p.counted:
            size = np.dtype(p.counted).itemsize
            if end + size > len(body):
                return None
            length = int(np.frombuffer(body, order + p.counted, 1, end)[0])
            if not 0 < length < 64:
                return None
            layout.append((f"length of {p.name}", order + p.counted))
            end += size
        layout.append((p.name, order + p.dtype, (length,) if p.counted else ()))
        end += length * np.dtype(p.dtype).itemsize
    dtype = np.dtype(layout)
    if at + dtype.itemsize * element.count > len(body):
        return None
    table = np.frombuffer(body, dtype, element.count, at)
    for name in [p.name for p in element.properties if p.counted]:
        lengths = table[f"length of {name}"]
        if (lengths != lengths[0]).any():
            return None
    rows = {
        p.name: table[p.name].tolist() if p.counted else table[p.name] for p in element.properties
    }
    return rows, at + dtype.itemsize * element.count


def _taken(
    body: bytes, at: int, dtype: str, count: int, element: Element, row: int, source: str
) -> tuple[npt.NDArray[Any], int]:
    end = at + np.dtype(dtype).itemsize * count
    if end > len(body):
        raise too_short(source, element, row)
    return np.frombuffer(body, dtype, count, at), end


def too_short(source: str, element: Element, rows: int) -> UserError:
    """Returns the error for a file that holds fewer rows than its header counts."""
    return UserError(
        source,
        f"element {element.name}",
        f"the header counts {element.count} rows, the file holds {rows} (is it cut off?)",
    )


def too_long(source: str) -> UserError:
    """Returns the error for a file that goes on after its last row."""
    return UserError(source, "", "holds more than its header counts, expected a PLY file")
