"""The scenario and the controller that a log was made with."""

from __future__ import annotations

import tempfile
from pathlib import Path

from drake_dress.diagrams.assemble import garments
from drake_dress.diagrams.build import controller_policy, described_person, station_parameters
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.report.log import RunLog


def logged_policy(log: RunLog) -> tuple[Scenario, DressingPolicy]:
    """Returns the scenario of a run and what planned in it, as the present code has both."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scenario.yaml"
        file.write_text(log.scenario_text, encoding="utf-8")
        scenario = load_scenario(file)
        meshes, _ = garments(scenario, file)
    person = described_person(station_parameters(scenario, meshes.belief))
    return scenario, controller_policy(scenario, meshes.belief, person)
