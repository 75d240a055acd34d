"""Computation budget of a solve: a plan can be used at any stage of the descent, but not late.

In simulation the budget counts iterations of the linear solver, so that a run is reproducible on
any machine under any load. On hardware it counts seconds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Cost:
    """Cost of a part of a solve: iterations of the linear solver, and time in s."""

    iterations: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Budget:
    """Limits of a solve; None means unlimited.

    Attributes:
        iterations: iterations of the linear solver.
        seconds: wall-clock time on this machine.
    """

    iterations: int | None = None
    seconds: float | None = None


@dataclass
class Spending:
    """Tracks what a solve has spent since this object was created.

    Attributes:
        budget: limits of the solve.
        clock: returns a monotonic time, s.
    """

    budget: Budget
    clock: Callable[[], float] = time.perf_counter
    iterations: int = field(init=False, default=0)
    _begin: float = field(init=False)
    _last: float = field(init=False)

    def __post_init__(self) -> None:
        self._begin = self._last = self.clock()

    def charge(self, iterations: int) -> Cost:
        """Returns the cost of the part that ends now, and adds it to the total."""
        now = self.clock()
        cost = Cost(iterations, now - self._last)
        self._last = now
        self.iterations += iterations
        return cost

    def allows(self, *parts: Cost) -> bool:
        """Returns whether further parts of these costs fit into the budget."""
        b = self.budget
        iterations = self.iterations + sum(part.iterations for part in parts)
        if b.iterations is not None and iterations > b.iterations:
            return False
        if b.seconds is not None:
            passed = self.clock() - self._begin
            return passed + sum(part.seconds for part in parts) <= b.seconds
        return True
