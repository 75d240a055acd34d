"""A complete scenario as text."""

import yaml
from pydrake.common.yaml import yaml_dump_typed

from drake_dress.diagrams.scenario.schema import Scenario
from drake_dress.yaml_text import write_yaml


def resolved_yaml(scenario: Scenario) -> str:
    """Returns the complete scenario as YAML that loads to an equal scenario."""
    return write_yaml(yaml.safe_load(yaml_dump_typed(scenario)))
