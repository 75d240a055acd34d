"""Scenarios: what a YAML file may say, and how it is read."""

from drake_dress.diagrams.scenario.loading import apply_variation, load_scenario, resolved_yaml
from drake_dress.diagrams.scenario.schema import Scenario

__all__ = ["Scenario", "apply_variation", "load_scenario", "resolved_yaml"]
