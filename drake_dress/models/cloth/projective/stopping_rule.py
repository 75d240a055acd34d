"""Stopping rule of a fixed-point iteration: an estimate of the distance to the fixed point.

If updates d shrink by ρ per iteration, the distance that remains is ‖d‖ ρ / (1 − ρ). A small update
alone says little: if ρ is 0.99, a hundred times as much is to come.
"""

from __future__ import annotations

from collections import deque

import numpy as np

# An update below this share of the tolerance counts as rounding: what remains is within the
# tolerance for any contraction below 1 minus this share.
_NEGLIGIBLE = 1e-7
# Spans of updates over which contraction is measured: their least number, and the longest one.
_LEAST_SPANS = 4
_LONGEST_SPAN = 20


class StoppingRule:
    """Estimates the distance to the fixed point from the last updates.

    The rate is the largest over several spans that end at the last update, and the estimate has to
    hold twice in a row. Fast modes decay first, so that early rates are too good, and L-BFGS makes
    updates of very unequal size. The rule cannot detect a motion that has yet to begin: near a
    saddle, where cloth is about to buckle, updates shrink before they grow.

    Args:
        tolerance: accepted distance to the fixed point, m.
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self._size: deque[float] = deque(maxlen=_LONGEST_SPAN + 1)
        self._within = 0
        self.contraction = 1.0
        self.remaining = np.inf

    def restart(self) -> None:
        """Forgets all updates, because other contacts have another contraction."""
        self._size.clear()
        self._within = 0
        self.remaining, self.contraction = np.inf, 1.0

    def add(self, size: float) -> None:
        """Adds the largest motion of a node in the last iteration, m."""
        self._size.append(size)
        spans = np.arange(1, len(self._size))
        self.remaining, self.contraction = np.inf, 1.0
        if size <= _NEGLIGIBLE * self._tolerance:
            self.remaining = self.contraction = 0.0
        elif len(spans) >= _LEAST_SPANS:
            earlier = np.array(self._size)[-1 - spans]
            self.contraction = float(((size / earlier) ** (1.0 / spans)).max())
            if self.contraction < 1.0:
                self.remaining = size * self.contraction / (1.0 - self.contraction)
        self._within = self._within + 1 if self.remaining <= self._tolerance else 0

    def reached(self) -> bool:
        """Returns whether the estimate was within the tolerance twice in a row, or is 0."""
        return self.remaining == 0.0 or self._within >= 2
