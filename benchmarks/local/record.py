"""Records local problems of a dressing, for `drake-dress bench local --recorded`.

    python -m benchmarks.local.record scenarios/active_standing.yaml --out out/local.npz

The scenario runs with both controllers. The requested number of problems is kept, evenly spread
over the run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from rich.progress import Progress

from benchmarks.local.recorded import write_problems
from drake_dress.diagrams.assemble import parts, wired
from drake_dress.diagrams.scenario import apply_variation, load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.errors import UserError
from drake_dress.models.control.local_problem import LocalProblem


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the scenario and writes the problems; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--duration", type=float, default=40.0, help="at most, s")
    parser.add_argument("--out", type=Path, default=Path("out/local.npz"))
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args(arguments)
    try:
        settings = ["controller.method=full", *options.set]
        scenario = apply_variation(load_scenario(options.scenario, settings, options.seed))
        setup = read_setup(scenario, options.scenario)
    except UserError as error:
        print(f"record: {error}", file=sys.stderr)
        return 2
    problems: list[LocalProblem] = []
    dressing = wired(parts(setup), record=problems)
    simulator = Simulator(dressing.diagram)
    context = dressing.mpc.GetMyContextFromRoot(simulator.get_context())
    with Progress(disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task("dressing", total=options.duration)
        for now in np.arange(0.5, options.duration + 0.25, 0.5):
            simulator.AdvanceTo(now)
            progress.update(task, completed=now)
            if dressing.mpc.is_finished(context):
                break
    chosen = np.unique(np.linspace(0, len(problems) - 1, options.count).astype(int))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_problems(options.out, [problems[i] for i in chosen])
    print(f"{len(chosen)} of {len(problems)} problems: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
