"""Matches points by their labels; a label is an identity, never a position in a list."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from drake_dress.errors import UserError


def label_of(text: str) -> str:
    """Returns the canonical form of a label: whole numbers as integers, other text unchanged.

    `07`, `7` and `7.0` are one label; `7.5` and `LSHO` are different ones.
    """
    text = text.strip()
    try:
        number = float(text)
    except ValueError:
        return text
    return str(int(number)) if number.is_integer() else text


def order_of(
    source: str, wanted: Sequence[str], given: Sequence[str], kind: str = "marker"
) -> list[int]:
    """Returns the index of each wanted label among the given ones.

    Args:
        source: file of the given labels, for messages.
        wanted: labels, each once.
        given: the same labels in any order.
        kind: what the labels stand for, for messages.

    Raises:
        UserError: a label is missing, repeated, empty, or not wanted.
    """
    expected = f"expected {_listed(wanted)} once each"
    count = Counter(given)
    for label in given:
        if not label:
            raise UserError(source, kind, f"one is empty, {expected}")
        if count[label] > 1:
            raise UserError(source, f"{kind} {label}", f"stands {count[label]} times, {expected}")
    for label in wanted:
        if label not in count:
            raise UserError(source, f"{kind} {label}", f"is missing, {expected}")
    for label in given:
        if label not in set(wanted):
            raise UserError(source, f"{kind} {label}", f"is one too many, {expected}")
    place = {label: i for i, label in enumerate(given)}
    return [place[label] for label in wanted]


def check_unique(source: str, key: str, labels: Sequence[str], count: int) -> None:
    """Raises UserError unless there is one unique label for each of `count` points."""
    if len(labels) != count:
        raise UserError(source, key, f"has {len(labels)} names of points, expected {count}")
    label, times = Counter(labels).most_common(1)[0] if labels else ("", 1)
    if times > 1:
        raise UserError(source, key, f"names {label!r} {times} times, expected each name once")


def _listed(labels: Sequence[str]) -> str:
    if all(label.isdigit() for label in labels) and labels:
        numbers = sorted(int(label) for label in labels)
        if numbers == list(range(numbers[0], numbers[0] + len(numbers))):
            return f"{numbers[0]} to {numbers[-1]}"
    shown = ", ".join(labels[:8])
    return shown + (f" and {len(labels) - 8} more" if len(labels) > 8 else "")
