"""Scenarios: the keys of a YAML file, and how it is read."""

from drake_dress.diagrams.scenario.loading import checked_scenario, load_scenario
from drake_dress.diagrams.scenario.schema import Scenario
from drake_dress.diagrams.scenario.text import resolved_yaml
from drake_dress.diagrams.scenario.variation import apply_variation

__all__ = [
    "Scenario",
    "apply_variation",
    "checked_scenario",
    "load_scenario",
    "resolved_yaml",
]
