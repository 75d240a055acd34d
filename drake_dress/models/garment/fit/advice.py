"""The size of the same garment that would suit a person."""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.garment.fit.judge import Fit

# Distance that is kept from a limit, as a share of it: limits are known to some per cent.
_MARGIN = 0.03


@dataclass(frozen=True)
class SizeAdvice:
    """The size that would suit, as factors on the garment's present size.

    Attributes:
        scale: factor on all lengths, 1 if the garment suits as it is; None if no size suits.
        least: smallest factor with which all measures are within their limits.
        measures: those that are too small, and the value, m, with which each would suit.
    """

    scale: float | None
    least: float
    measures: dict[str, float]


def size_advice(fit: Fit) -> SizeAdvice:
    """Returns the size that would suit.

    All lengths of a garment grow with its scale, so each limit of a ratio is one of the scale.
    """
    least = 0.0
    measures: dict[str, float] = {}
    for row in fit.comparisons:
        if not row.ratio:
            continue
        factor = row.limits.wanted / row.ratio
        least = max(least, factor)
        if factor > 1.0:
            measures[row.measure] = row.limits.wanted * row.person * (1.0 + _MARGIN)
    kinds = ("", "sleeve_length")
    hopeless = any(f.level == "cannot" and f.measure in kinds for f in fit.findings)
    suits = 1.0 if least <= 1.0 else least * (1.0 + _MARGIN)
    return SizeAdvice(None if hopeless else suits, least, measures)
