"""The log that a run or a lab writes."""

from __future__ import annotations

from pathlib import Path

from drake_dress import __version__
from drake_dress.diagrams.arms import arm_bases
from drake_dress.diagrams.scenario import resolved_yaml
from drake_dress.diagrams.setup import Setup
from drake_dress.diagrams.station import Station
from drake_dress.file_output import RUN_FILES
from drake_dress.models.human.body import capsule_arrays
from drake_dress.models.human.shape import CHAIR
from drake_dress.report.log_layout import LogContent
from drake_dress.report.log_writer import RunLogWriter


def open_run_log(out: Path, setup: Setup, station: Station, forecast: bool = False) -> RunLogWriter:
    """Returns a log with its constant content written.

    Args:
        out: folder; the results of an earlier run are removed from it.
        setup: of the scenario.
        station: the logged station.
        forecast: whether forecasts of the person are logged.
    """
    person, scenario, garments = station.person, setup.scenario, setup.garments
    return RunLogWriter(
        out / RUN_FILES[0],
        LogContent(
            garment=garments.plant,
            scenario_text=resolved_yaml(scenario),
            version=__version__,
            seed=scenario.seed,
            radius=person.radius,
            capsule_radius=capsule_arrays(person.capsules)[2],
            of_chair=[c.part == CHAIR for c in person.capsules],
            estimate_garment=garments.belief,
            bases=arm_bases(station.robots),
            estimated=station.in_real_time,
            forecast=forecast,
        ),
        results=RUN_FILES[1:],
    )
