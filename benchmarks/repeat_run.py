"""Runs one scenario twice and tells whether both logs hold the same numbers.

    python benchmarks/repeat_run.py scenarios/dummy_standing.yaml

Every dataset is compared bit for bit, but for the measured solve times. The exit status is 0 if
both runs are the same, 1 if they differ, 2 if the scenario could not be run.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
from scenario_run import run_scenario

_MEASURED = ("solve_time",)


def main() -> int:
    """Runs and compares; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--jobs", type=int, default=2, help="runs at once (default 2)")
    parser.add_argument("--out", type=Path, default=Path("out/repeat"))
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    folders = [options.out / name for name in ("first", "second")]
    with ThreadPoolExecutor(options.jobs) as pool:
        runs = pool.map(lambda out: run_scenario(options.scenario, out, options.set), folders)
        statuses, problems = zip(*runs, strict=True)
    if any(problems):
        print(next(problem for problem in problems if problem), file=sys.stderr)
        return 2
    with h5py.File(folders[0] / "run.h5") as a, h5py.File(folders[1] / "run.h5") as b:
        names = _datasets(a)
        different = [name for name in names if not _same(a, b, name)]
        if _datasets(b) != names:
            different.append("names of the datasets")
        samples = len(a["time"])
    print(f"exit statuses {statuses[0]} and {statuses[1]}")
    print(f"{len(names)} datasets, {samples} samples: {len(different)} differ")
    for name in different:
        print(f"  {name}")
    return int(bool(different) or statuses[0] != statuses[1])


def _datasets(file: h5py.File) -> list[str]:
    names: list[str] = []
    file.visititems(
        lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None
    )
    return sorted(name for name in names if name.rsplit("/", 1)[-1] not in _MEASURED)


def _same(a: h5py.File, b: h5py.File, name: str) -> bool:
    if name not in b or a[name].shape != b[name].shape:
        return False
    first, second = a[name][()], b[name][()]
    return bool(np.array_equal(first, second, equal_nan=first.dtype.kind == "f"))


if __name__ == "__main__":
    sys.exit(main())
