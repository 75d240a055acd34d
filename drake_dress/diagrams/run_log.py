"""The log that a run or a lab writes."""

from __future__ import annotations

from pathlib import Path

from drake_dress import __version__
from drake_dress.diagrams.arms import arm_bases
from drake_dress.diagrams.assemble import Garments
from drake_dress.diagrams.scenario import Scenario, resolved_yaml
from drake_dress.diagrams.station import Station
from drake_dress.file_output import RUN_FILES
from drake_dress.report.log_layout import LogContent
from drake_dress.report.log_writer import RunLogWriter


def open_run_log(
    out: Path, scenario: Scenario, garments: Garments, station: Station
) -> RunLogWriter:
    """Returns the log in a folder, begun with what does not change.

    Args:
        out: folder; the results of a run before are removed from it.
        scenario: with its variation drawn.
        garments: of plant and controller.
        station: of which the log is.
    """
    person = station.person
    return RunLogWriter(
        out / RUN_FILES[0],
        LogContent(
            garment=garments.plant,
            scenario_text=resolved_yaml(scenario),
            version=__version__,
            seed=scenario.seed,
            radius=person.radius,
            capsule_radius=[c.radius for c in person.capsules],
            estimate_garment=garments.belief,
            bases=arm_bases(station.robots),
            estimated=station.in_real_time,
        ),
        results=RUN_FILES[1:],
    )
