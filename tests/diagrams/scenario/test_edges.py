from __future__ import annotations

import pytest

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.edges import AT_EDGES, at_edges
from drake_dress.shipped import scenario_file

STANDING = scenario_file("dummy_standing")


def test_the_settings_say_the_same() -> None:
    assert at_edges(load_scenario(STANDING)) == load_scenario(STANDING, AT_EDGES)
    assert at_edges(load_scenario(STANDING)) != load_scenario(STANDING)


@pytest.mark.parametrize(
    "setting",
    ["safety.force_limit=12", "safety.soft_force_limit=5", "controller.stages.swing_after=4"],
)
def test_what_the_user_chose_stays(setting: str) -> None:
    scenario = at_edges(load_scenario(STANDING, [setting]))
    assert scenario.garment.hold == "edges"
    key, _, value = setting.partition("=")
    found: object = scenario
    for name in key.split("."):
        found = getattr(found, name)
    assert found == float(value)
