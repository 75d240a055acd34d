"""Logs of runs, and the scenario and the controller that they were made with."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from drake_dress.diagrams.assemble import garments
from drake_dress.diagrams.build import controller_policy, described_person, station_parameters
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.report.log import RunLog


def opened(paths: Sequence[Path]) -> Iterator[tuple[Path, RunLog]]:
    """Yields each log, open, and tells on stderr of each that has been read."""
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
    """Returns the scenario of a run and what planned in it, as the present code has both."""
    scenario = logged_scenario(log)
    meshes, _ = garments(scenario, Path(log.file.filename))
    person = described_person(station_parameters(scenario, meshes.belief))
    return scenario, controller_policy(scenario, meshes.belief, person)
