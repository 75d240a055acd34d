"""Measures the Gymnasium environment: its speed, and whether it can be solved.

    drake-dress bench gym

`speed` steps environments in one and in several processes with small random velocities. `dressing`
lets the scenario's own controllers act through the environment's actions, from its observations
only, until each episode ends; the exit status is 1 if an episode does not dress the person.
Processor time per step is summed over all cores; it depends less on other load.
"""

from __future__ import annotations

import argparse
import os
import time as clock
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import psutil

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, every, write_figures
from benchmarks.parser import at_least_one, bench_parser, exit_with, output_file, some_of
from benchmarks.section import add_into_option, around, write_between
from drake_dress.gym import ENV_ID, ControllerPolicy, make_vec

_NAME = "gym"
_PARTS = ("speed", "dressing")
# Variants for measuring speed: settings and observations.
_KINDS: dict[str, tuple[list[str], list[str]]] = {
    "standard, state and force": ([], ["state", "force"]),
    "quick, state and force": (["plant.fidelity=quick"], ["state", "force"]),
    "quick, with color": (["plant.fidelity=quick"], ["state", "force", "color"]),
}
_SPEED = 0.03  # bound of each component of the random actions, m/s
_WARM_UP = 20  # steps before the clock starts


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures and prints; returns the exit status."""
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    tables: list[Table] = []
    figures: list[Figure] = []
    if "speed" in options.only:
        rows = [_speed(kind, n, options.steps) for kind in _KINDS for n in options.processes]
        header = ["plant, observations", "processes", "reset, s", "steps/s", "CPU ms per step"]
        tables.append(Table(f"Steps at 50 Hz, {os.cpu_count()} cores", header, rows))
        for kind, count, _, rate, _ in rows:
            name = f"environment steps per second, {kind}, {count} processes"
            figures.append(Figure(name, rate, "1/s"))
    rows = []
    if "dressing" in options.only:
        for seed in options.seeds:
            rows.append(_dressing(options.scenario, seed, options.set))
            print(f"{options.scenario}, seed {seed}: {rows[-1][1]}", flush=True)
        header = ["seed", "ended by", "simulated, s", "took, s", "CPU, s", "return", *_TERMS]
        title = f"{options.scenario}, dressed by its own controllers through the environment"
        tables.append(Table(title, header, rows))
        dressed = sum(row[1] == "dressed" for row in rows)
        name = "episodes in which the scenario's controllers dress the person"
        figures.append(every(name, dressed, len(rows)))
    shown = "\n\n".join(table.text() for table in tables)
    print(f"\n{shown}")
    if options.into is not None:
        write_between(options.into, _NAME, shown)
    if options.json is not None:
        rows_of = {t.title: [dict(zip(t.header, r, strict=True)) for r in t.rows] for t in tables}
        seeds = options.seeds if "dressing" in options.only else []
        write_figures(options.json, figures, seeds, tables=rows_of)
    return int(any(row[1] != "dressed" for row in rows))


_TERMS = ("progress", "approach", "gripper_force", "person_force", "success", "failure")


def _speed(kind: str, processes: int, steps: int) -> list[Any]:
    """Measures one variant; returns a row of the table of speeds."""
    overrides, observe = _KINDS[kind]
    envs = make_vec(processes, overrides=overrides, observe=observe)
    seeds: Any = list(range(processes))  # Gymnasium types a single seed only
    try:
        rng = np.random.default_rng(0)
        envs.reset(seed=seeds)
        # the same draw again: measures a reset that keeps its diagram
        begin = clock.perf_counter()
        envs.reset(seed=seeds)
        reset = clock.perf_counter() - begin
        for k in range(_WARM_UP + steps):
            if k == _WARM_UP:
                begin, begin_cpu = clock.perf_counter(), _cpu_time()
            envs.step(rng.uniform(-_SPEED, _SPEED, (processes, 2, 3)).astype(np.float32))
        wall, cpu = clock.perf_counter() - begin, _cpu_time() - begin_cpu
    finally:
        envs.close()
    count = processes * steps
    return [kind, processes, reset, count / wall, 1e3 * cpu / count]


def _cpu_time() -> float:
    """Returns the processor time used by this process and its children, s."""
    this = psutil.Process()
    times = [process.cpu_times() for process in (this, *this.children(recursive=True))]
    return float(sum(t.user + t.system for t in times))


def _dressing(scenario: str, seed: int, overrides: Sequence[str]) -> list[Any]:
    """Runs one episode; returns a row of the table of dressings."""
    env = gymnasium.make(ENV_ID, scenario=scenario, overrides=overrides)
    seen, _ = env.reset(seed=seed)
    policy = ControllerPolicy(env)
    total = dict.fromkeys(_TERMS, 0.0)
    begin, begin_cpu, ended = clock.perf_counter(), _cpu_time(), False
    while not ended:
        seen, _, terminated, truncated, info = env.step(policy.act(seen))
        ended = terminated or truncated
        for name in _TERMS:
            total[name] += info["reward"][name]
    spent = [clock.perf_counter() - begin, _cpu_time() - begin_cpu]
    policy.close()
    env.close()
    return [seed, info["ended_by"], info["time"], *spent, sum(total.values()), *total.values()]


def _numbers(text: str) -> list[int]:
    """Parses comma-separated numbers; an argparse type."""
    numbers = text.split(",")
    if not all(n.isdecimal() for n in numbers):
        raise argparse.ArgumentTypeError(f"{text!r}, expected numbers with commas between")
    return [int(n) for n in numbers]


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument(
        "--only", type=some_of(_PARTS), default=list(_PARTS), metavar="PART,…",
        help=", ".join(_PARTS),
    )  # fmt: skip
    parser.add_argument(
        "--steps", type=at_least_one, default=500, metavar="N", help="timed; default 500"
    )
    parser.add_argument(
        "--processes", type=_numbers, default=[1, 2], metavar="N,…", help="default 1,2"
    )
    parser.add_argument("--scenario", default="dummy_standing", help="default dummy_standing")
    parser.add_argument("--seeds", type=_numbers, default=[0], metavar="N,…", help="default 0")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="tables and figures")
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
