"""`python -m benchmarks.local`: compares constrained DDP with the exact optimum.

Each problem is solved by constrained DDP with a cold start, then with a warm start and another
initial state (like the next problem of a sequence), and as a cone programme by Clarabel. The cone
programme gives the optimum; its own time, without Drake's set-up, is the time to beat.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from rich.progress import track

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_most, write_figures
from benchmarks.local.problems import random_problem
from benchmarks.local.recorded import read_problems
from benchmarks.parser import OneLineParser, at_least_one, output_file, seed_number
from drake_dress.models.control.constrained_ddp import feedback_gains, solve_constrained_ddp
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.solution import Solution
from drake_dress.solvers.cone_programme import solve_cone_programme

# Margin by which widened bounds contain the predicted trajectory, m.
_ROOM = 1e-4
# Standard deviation of the next problem's initial state from the prediction, m.
_SURPRISE = 2e-3
# Thresholds of a failure: relative cost above the optimum, and violation of a bound, m or m/s.
MOST_COST, MOST_VIOLATION = 1e-3, 1e-6


@dataclass(frozen=True)
class Trial:
    """One problem: times, s; relative cost above the optimum; worst violation; statistics.

    `kept` is whether the bounds are feasible; if not, costs include the price of the violation.
    """

    kind: str
    cold: float
    warm: float
    gains: float
    cone: float
    cone_call: float
    cost: float
    violation: float
    warm_cost: float
    warm_violation: float
    active: int
    sweeps: int
    interior_steps: int
    kept: bool
    failed: bool


def main(arguments: Sequence[str] | None = None) -> int:
    """Solves the problems and prints a table; returns 0, or 2 for bad arguments."""
    parser = OneLineParser(prog="drake-dress bench local", description=__doc__)
    parser.add_argument(
        "--problems", type=at_least_one, default=1000, metavar="N", help="that are drawn"
    )
    parser.add_argument("--seed", type=seed_number, default=0)
    parser.add_argument(
        "--recorded", type=Path, metavar="FILE.npz", help="problems that came up in runs"
    )
    parser.add_argument("--json", type=output_file, metavar="FILE", help="every trial")
    options = parser.parse_args(arguments)
    if options.problems < 0:
        parser.error(f"--problems is {options.problems}, expected 0 or more")
    rng = np.random.default_rng(options.seed)
    problems = [("drawn", random_problem(rng)[0]) for _ in range(options.problems)]
    if options.recorded is not None:
        problems += [("recorded", p) for p in read_problems(options.recorded)]
    trials = list(_trials(problems, rng))
    print(f"seed {options.seed}\n\n{table(trials).text()}")
    if options.json is not None:
        write_figures(
            options.json, figures(trials), [options.seed], trials=[asdict(t) for t in trials]
        )
    return 0


def _trials(
    problems: Sequence[tuple[str, LocalProblem]], rng: np.random.Generator
) -> Iterator[Trial]:
    if problems:
        # compile before measuring
        solve_constrained_ddp(problems[0][1])
        feedback_gains(problems[0][1], solve_constrained_ddp(problems[0][1]))
    shown = sys.stderr.isatty()
    for kind, p in track(problems, "local problems", disable=not shown):
        begin = time.perf_counter()
        found = solve_constrained_ddp(p)
        cold = time.perf_counter()
        feedback_gains(p, found)
        gains = time.perf_counter()
        exact, own = solve_cone_programme(p)
        cone = time.perf_counter()
        kept = exact.converged and exact.violation < MOST_VIOLATION
        if not kept:
            # bounds are infeasible: use the optimum with priced violations
            exact, _ = solve_cone_programme(p, spills=True)
        surprised = replace(p, start=p.start + _SURPRISE * rng.normal(size=len(p.start)))
        # widen the bounds, since the new start may make them infeasible
        bounds = surprised.state_bounds
        needed = bounds.norms(surprised.states(found.v)) + _ROOM
        wider = replace(bounds, radius=np.maximum(bounds.radius, needed))
        surprised = replace(surprised, state_bounds=wider)
        before = time.perf_counter()
        next_one = solve_constrained_ddp(
            surprised, found.v, found.state_multiplier, found.input_multiplier
        )
        after = time.perf_counter()
        best, _ = solve_cone_programme(surprised, spills=not kept)
        cost = _above(p, found, exact)
        warm_cost = _above(surprised, next_one, best)
        worst = max(found.violation, next_one.violation) if kept else 0.0
        yield Trial(
            kind=kind,
            cold=cold - begin,
            warm=after - before,
            gains=gains - cold,
            cone=own,
            cone_call=cone - gains,
            cost=cost,
            violation=found.violation if kept else np.nan,
            warm_cost=warm_cost,
            warm_violation=next_one.violation if kept else np.nan,
            kept=kept,
            active=int(np.sum(found.state_multiplier > 0.0) + np.sum(found.input_multiplier > 0.0)),
            sweeps=found.sweeps,
            interior_steps=found.interior_steps,
            failed=not (found.converged and next_one.converged)
            or max(cost, warm_cost) > MOST_COST
            or worst > MOST_VIOLATION,
        )


def _above(problem: LocalProblem, found: Solution, exact: Solution) -> float:
    """Returns the relative excess of a solution's cost over the exact one."""
    costs = [s.cost + problem.price * problem.spilled(s.v) for s in (found, exact)]
    return (costs[0] - costs[1]) / max(abs(costs[1]), 1e-12)


def figures(trials: Sequence[Trial]) -> list[Figure]:
    """Returns failures and times of each kind of problem."""
    found = []
    for kind in dict.fromkeys(t.kind for t in trials):
        mine = [t for t in trials if t.kind == kind]
        failed = sum(t.failed for t in mine)
        found.append(at_most(f"{kind}: failed problems", failed, f"of {len(mine)}", 0))
        for what, name in (("cold", "cold"), ("warm", "warm"), ("cone", "Clarabel's own")):
            median = 1e3 * float(np.median([getattr(t, what) for t in mine]))
            found.append(Figure(f"{kind}: {name} solve, median", median, "ms"))
    return found


def table(trials: Sequence[Trial]) -> Table:
    """Returns times, costs and violations by kind of problem and method."""
    rows = []
    for kind in dict.fromkeys(t.kind for t in trials):
        mine = [t for t in trials if t.kind == kind]
        failed = sum(t.failed for t in mine)
        for way, times, cost, violation, bad in (
            ("constrained DDP", "cold", "cost", "violation", failed),
            ("… from the one before", "warm", "warm_cost", "warm_violation", None),
            ("… its gains", "gains", None, None, None),
            ("Clarabel, its own time", "cone", None, None, None),
            ("Clarabel through Drake", "cone_call", None, None, None),
        ):
            ms = [1e3 * getattr(t, times) for t in mine]
            rows.append(
                [
                    f"{kind}: {way}",
                    len(mine),
                    sum(t.kept for t in mine),
                    float(np.median(ms)),
                    float(np.percentile(ms, 99)),
                    None if cost is None else 100.0 * max(getattr(t, cost) for t in mine),
                    None
                    if violation is None
                    else f"{np.nanmax([getattr(t, violation) for t in mine]):.1e}",
                    bad,
                ]
            )
    header = [
        "",
        "problems",
        "bounds kept",
        "median, ms",
        "99 %, ms",
        "cost above, %",
        "violation",
        "failed",
    ]
    return Table("The local problem", header, rows)


if __name__ == "__main__":
    sys.exit(main())
