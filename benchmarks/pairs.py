"""Dressings with the same seeds in two ways, compared pair by pair."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.statistics import median_interval, wilson
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

# What `group_row` and `pairs_row` return.
GROUP_HEADER = [
    "runs",
    "dressed",
    "90 % interval, %",
    "time to dress, s",
    "force 99 %, N",
    "peak, N",
]
PAIRS_HEADER = [
    "pairs",
    "both dressed",
    "only this",
    "only the other",
    "neither",
    "time less by, s (90 %)",
    "force 99 % less by, N (90 %)",
]
# Results of runs, as `benchmarks/study.py` keeps them, and with `force_p99`.
Result = dict[str, Any]
Pairs = list[tuple[Result, Result]]


def gripper_force(out: Path) -> dict[str, Any]:
    """Returns `force_p99`, the 99 % quantile of the gripper force in a run's folder, N."""
    with RunLog.open(out / "run.h5") as log:
        force = [np.linalg.norm(log.gripper_force[side], axis=1) for side in SIDES]
        return {"force_p99": float(np.quantile(np.stack(force), 0.99))}


def by_group(
    results: Sequence[Result], key: str, names: Sequence[str]
) -> dict[str, dict[int, Result]]:
    """Returns the finished runs by the value of a case's `key`, in order of `names`, and seed."""
    done = [r for r in results if "summary" in r]
    groups = {n: {r["case"]["seed"]: r for r in done if r["case"][key] == n} for n in names}
    return {name: runs for name, runs in groups.items() if runs}


def dressed(results: Iterable[Result]) -> int:
    """Returns how many runs succeeded."""
    return sum(bool(r["summary"]["success"]) for r in results)


def dressing_time(results: Iterable[Result]) -> float | None:
    """Returns the median time to dress of the runs that succeeded, s."""
    times = [r["summary"]["dressing_time_s"] for r in results if r["summary"]["success"]]
    return float(np.median(times)) if times else None


def group_row(results: Sequence[Result]) -> list[Any]:
    """Returns the cells of `GROUP_HEADER`."""
    on = dressed(results)
    low, high = wilson(on, len(results))
    return [
        len(results),
        on,
        f"{100 * low:.0f} to {100 * high:.0f}",
        dressing_time(results),
        float(np.median([r["force_p99"] for r in results])),
        max(r["summary"]["max_gripper_force_N"] for r in results),
    ]


def pairs_of(mine: Mapping[int, Result], other: Mapping[int, Result]) -> Pairs:
    """Returns the runs of the seeds that both have."""
    return [(mine[seed], other[seed]) for seed in mine if seed in other]


def times_less(pairs: Pairs) -> list[float]:
    """Returns by how much less time the first took where both dressed, s."""
    return [
        b["summary"]["dressing_time_s"] - a["summary"]["dressing_time_s"]
        for a, b in pairs
        if a["summary"]["success"] and b["summary"]["success"]
    ]


def forces_less(pairs: Pairs) -> list[float]:
    """Returns by how much less the force of the first is, N."""
    return [b["force_p99"] - a["force_p99"] for a, b in pairs]


def pairs_row(mine: Mapping[int, Result], other: Mapping[int, Result]) -> list[Any]:
    """Returns the cells of `PAIRS_HEADER`."""
    pairs = pairs_of(mine, other)
    ended = [(bool(a["summary"]["success"]), bool(b["summary"]["success"])) for a, b in pairs]
    counts = [
        ended.count(how) for how in ((True, True), (True, False), (False, True), (False, False))
    ]
    return [len(pairs), *counts, _shown(times_less(pairs)), _shown(forces_less(pairs))]


def _shown(values: list[float]) -> str | None:
    if not values:
        return None
    low, middle, high = median_interval(values)
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"
