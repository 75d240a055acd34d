"""Confidence intervals of counted results."""

from __future__ import annotations

import math

# Quantile of the normal distribution for 90 %.
_Z = 1.645


def wilson(right: int, count: int) -> tuple[float, float]:
    """Returns the 90 % interval of a share, of which `right` in `count` occurred (Wilson 1927)."""
    if count == 0:
        return 0.0, 1.0
    share = right / count
    middle = (share + _Z * _Z / (2 * count)) / (1 + _Z * _Z / count)
    spread = _Z / (1 + _Z * _Z / count)
    spread *= math.sqrt(share * (1 - share) / count + _Z * _Z / (4 * count * count))
    # for none or all, the bound is exactly 0 or 1 except for rounding
    return (
        middle - spread if right > 0 else 0.0,
        middle + spread if right < count else 1.0,
    )
