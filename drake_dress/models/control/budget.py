"""What a solve may take, and what it has taken: a plan is of use at any time, late ones are not.

In simulation a solve is counted in iterations of linear solves, so that a run is the same on any
machine under any load; on hardware, in seconds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Cost:
    """What a part of a solve took: iterations of linear solves, and s."""

    iterations: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Budget:
    """What a solve may take; None: as much as it likes.

    Attributes:
        iterations: of linear solves.
        seconds: of this machine's clock.
    """

    iterations: int | None = None
    seconds: float | None = None


@dataclass
class Spending:
    """What a solve has taken since this was made.

    Attributes:
        budget: of it.
        clock: seconds that go on.
    """

    budget: Budget
    clock: Callable[[], float] = time.perf_counter
    iterations: int = field(init=False, default=0)
    _begin: float = field(init=False)
    _last: float = field(init=False)

    def __post_init__(self) -> None:
        self._begin = self._last = self.clock()

    def charge(self, iterations: int) -> Cost:
        """Returns what a part that ends now took, and has it count."""
        now = self.clock()
        cost = Cost(iterations, now - self._last)
        self._last = now
        self.iterations += iterations
        return cost

    def allows(self, *parts: Cost) -> bool:
        """Returns whether parts that take as much as these are within the budget."""
        b = self.budget
        iterations = self.iterations + sum(part.iterations for part in parts)
        if b.iterations is not None and iterations > b.iterations:
            return False
        if b.seconds is not None:
            passed = self.clock() - self._begin
            return passed + sum(part.seconds for part in parts) <= b.seconds
        return True
