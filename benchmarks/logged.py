"""Logs of runs, with their scenarios and controllers."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import h5py
import numpy as np

from drake_dress.diagrams.assemble import described_person
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.report.log import RunLog

# Datasets of measured times, which differ from run to run.
_MEASURED = ("solve_time",)


def numbers_that_differ(one: h5py.File, other: h5py.File) -> tuple[int, list[str]]:
    """Returns the number of datasets in a log, and the names of those that differ in another.

    The comparison is bit for bit. Measured times are excluded.
    """
    names = _datasets(one)
    different = [name for name in names if not _same(one, other, name)]
    return len(names), different + [n for n in _datasets(other) if n not in names]


def _datasets(file: h5py.File) -> list[str]:
    names: list[str] = []
    file.visititems(
        lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None
    )
    return sorted(name for name in names if name.rsplit("/", 1)[-1] not in _MEASURED)


def _same(one: h5py.File, other: h5py.File, name: str) -> bool:
    if name not in other or one[name].shape != other[name].shape:
        return False
    first, second = one[name][()], other[name][()]
    return bool(np.array_equal(first, second, equal_nan=first.dtype.kind == "f"))


def opened(paths: Sequence[Path]) -> Iterator[tuple[Path, RunLog]]:
    """Yields each opened log, and reports progress on stderr."""
    for k, path in enumerate(paths):
        with RunLog.open(path) as log:
            yield path, log
        print(f"{k + 1}/{len(paths)} {path}", file=sys.stderr, flush=True)


def logged_scenario(log: RunLog) -> Scenario:
    """Returns the scenario of a run."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scenario.yaml"
        file.write_text(log.scenario_text, encoding="utf-8")
        return load_scenario(file)


def logged_policy(log: RunLog) -> tuple[Scenario, DressingPolicy]:
    """Returns the scenario of a run and its policy, both as built by the current code."""
    scenario = logged_scenario(log)
    setup = read_setup(scenario, Path(log.file.filename))
    return scenario, setup.policy(described_person(setup.station))
