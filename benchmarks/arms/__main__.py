"""`python -m benchmarks.arms`: runs every scenario with and without arms, and measures the arms.

Every run is a separate `drake-dress run`. Results are kept in the file of `--json` and not run
again.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least, at_most, every
from benchmarks.parser import OneLineParser, exit_with
from benchmarks.study import (
    Study,
    add_choices,
    add_study_options,
    carry_out,
    exit_status,
    run_case,
)

_NAME = "arms"
_SCENARIOS = Path(__file__).parents[2] / "scenarios"
# Every scenario with a dressing.
SCENARIOS = (
    "dummy_standing",
    "dummy_sitting",
    "dummy_overcoat",
    "dummy_varied",
    "dummy_cameras",
    "passive_standing",
    "passive_sitting",
    "active_standing",
    "gown_front",
    "wheelchair",
    "stiff_elbow",
    "stiff_shoulder",
    "paralysed_arm",
    "spasm",
    "limited_range",
    "lab",
)
METHODS = ("global", "full")
GRIPPERS = ("floating", "panda")


@dataclass(frozen=True)
class Case:
    """One run: `scenario` of SCENARIOS, `method` of METHODS, `grippers` of GRIPPERS."""

    scenario: str
    method: str
    grippers: str

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"{self.scenario}-{self.method}-{self.grippers}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing runs, prints tables; returns 0, 2 on bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    chosen = [
        Case(*which)
        for which in itertools.product(options.scenarios, options.methods, options.grippers)
    ]
    return exit_status(*carry_out(options, Study(_NAME, Case, run, tables, figures), chosen))


def run(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Executes one run and returns its result.

    Args:
        case: Case to run.
        keep: Folder for its log, report and replay; None to keep none.
        overrides: Further KEY=VALUE settings of the scenario.
    """
    settings = [
        f"controller.method={case.method}",
        f"station.arms.model={case.grippers}",
        "duration=90.0",
        *overrides,
    ]
    return run_case(case, _SCENARIOS / f"{case.scenario}.yaml", keep, settings)


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the results with floating grippers and with arms, and the measures of the arms."""
    done = {Case(**r["case"]).name: r["summary"] for r in results if "summary" in r}
    cases = [Case(**r["case"]) for r in results if "summary" in r]
    pairs = dict.fromkeys((c.scenario, c.method) for c in cases)
    ended = []
    for scenario, method in pairs:
        cells: list[Any] = [f"{scenario}, {method}"]
        for grippers in GRIPPERS:
            summary = done.get(Case(scenario, method, grippers).name)
            cells += [None] * 4 if summary is None else _dressing(summary)
        ended.append(cells)
    arms = [
        [f"{c.scenario}, {c.method}", *_arms(done[c.name])] for c in cases if c.grippers == "panda"
    ]
    columns = ("on in, s", "force, N", "strain, %", "penetration, mm")
    return [
        Table("Dressings", ["", *columns, *(f"arms: {c}" for c in columns)], ended),
        Table(
            "Arms",
            [
                "",
                "speed, share of limit",
                "torque, share of limit",
                "margin to a joint limit, rad",
                "tracking error, median, mm",
                "tracking error, 99 %, mm",
                "between arms, cm",
                "arm to person, cm",
                "real-time factor",
            ],
            arms,
        ),
        Table(
            "Reasons of failure",
            ["", "reason"],
            [[c.name, done[c.name]["reason"]] for c in cases if not done[c.name]["success"]],
        ),
    ]


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns the figures of dressings on arms beside what is asked."""
    mine = [r["summary"] for r in results if r["case"]["grippers"] == "panda"]
    if not mine:
        return []
    limits = {"max_joint_speed_share": "speed", "max_joint_torque_share": "torque"}
    return [
        every("dressed on arms", sum(bool(s["success"]) for s in mine), len(mine)),
        *(
            at_most(f"joint {what}, largest share of its limit", max(s[k] for s in mine), "", 1.0)
            for k, what in limits.items()
        ),
        at_least(
            "distance between the arms, smallest",
            min(s["min_arms_apart_m"] for s in mine),
            "m",
            0.0,
        ),
        at_least(
            "distance from an arm to the person, smallest",
            min(s["min_arm_to_person_m"] for s in mine),
            "m",
            0.0,
        ),
    ]


def _dressing(summary: dict[str, Any]) -> list[Any]:
    return [
        summary["dressing_time_s"] if summary["success"] else "no",
        summary["max_gripper_force_N"],
        100.0 * summary["max_edge_strain"],
        1e3 * summary["max_penetration_m"],
    ]


def _arms(summary: dict[str, Any]) -> list[Any]:
    return [
        summary["max_joint_speed_share"],
        summary["max_joint_torque_share"],
        summary["min_joint_margin_rad"],
        summary["arm_tracking_mm"]["median"],
        summary["arm_tracking_mm"]["p99"],
        100.0 * summary["min_arms_apart_m"],
        100.0 * summary["min_arm_to_person_m"],
        summary["realtime_factor"],
    ]


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog="drake-dress bench arms", description=__doc__)
    add_choices(parser, scenarios=SCENARIOS, methods=METHODS, grippers=GRIPPERS)
    add_study_options(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
