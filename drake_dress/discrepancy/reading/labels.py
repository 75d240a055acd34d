"""Matches points by what they are called: a label is an identity, never a place in an order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from drake_dress.errors import UserError


def label_of(text: str) -> str:
    """Returns a label as it is compared: whole numbers however they are written, other text as is.

    `07`, `7` and `7.0` are one label; `7.5` and `LSHO` are labels of their own.
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
    """Returns for each wanted label where it stands among the given ones.

    Args:
        source: file of the given labels, for messages.
        wanted: labels, each once.
        given: labels, to be the same ones in any order.
        kind: what they are labels of, for messages.

    Raises:
        UserError: a label is missing, stands twice, is empty, or is not wanted.
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
    """Raises UserError where labels are not one for each of `count` points."""
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
