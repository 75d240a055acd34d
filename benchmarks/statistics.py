"""Confidence intervals of counted results."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import binom

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


def median_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Returns the lower end of the median's 90 % interval, the median, and the upper end.

    The ends are values of the sample, by the binomial distribution of how many are below the median
    (David and Nagaraja, "Order Statistics", 2003). A small sample ends at its extremes.
    """
    if not values:
        return math.nan, math.nan, math.nan
    ascending = sorted(values)
    count = len(ascending)
    below = binom.ppf(0.05, count, 0.5)
    first = max(0, int(below) - 1)
    return ascending[first], float(np.median(ascending)), ascending[count - 1 - first]
