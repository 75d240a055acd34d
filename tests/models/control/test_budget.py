"""What a budget allows: never more than there is, whatever was spent before."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.control.budget import Budget, Cost, Spending

parts = st.lists(st.tuples(st.integers(0, 50), st.integers(0, 50)), max_size=20)


class Clock:
    """A clock that is moved by hand, in whole seconds."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@given(st.integers(0, 300), st.integers(0, 300), parts)
def test_what_is_allowed_keeps_the_budget(
    iterations: int, seconds: int, took: list[tuple[int, int]]
) -> None:
    clock = Clock()
    spending = Spending(Budget(iterations, float(seconds)), clock)
    for work, time in took:
        allowed = spending.allows(Cost(work, float(time)))
        left = iterations - spending.iterations, seconds - (clock.now - 100.0)
        assert allowed == (work <= left[0] and time <= left[1])
        if not allowed:
            continue
        clock.now += time
        assert spending.charge(work) == Cost(work, float(time))
        assert spending.iterations <= iterations
        assert clock.now - 100.0 <= seconds


@given(parts)
def test_no_budget_allows_everything(took: list[tuple[int, int]]) -> None:
    spending = Spending(Budget(), Clock())
    for work, time in took:
        assert spending.allows(Cost(work, float(time)))
        spending.charge(work)
    assert spending.iterations == sum(work for work, _ in took)
