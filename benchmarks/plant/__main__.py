"""Measures the error of the plant's garment against a finer reference, and its step times.

    drake-dress bench plant --work out/plant --into docs/cloth.md

Grippers and limbs move as in one dressing, which is run first. Parts of it, one second each, are
simulated on a mesh of 1 cm with a time step of 1 ms, and with each setting from the same states.
Results stay in the folder of `--work`; the reference alone takes a quarter of an hour.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, write_figures
from benchmarks.parser import at_least_one, bench_parser, exit_with, output_file, output_folder
from benchmarks.plant.accuracy import (
    REFERENCE,
    Part,
    Setting,
    compared,
    part_begins,
    reference_part,
)
from benchmarks.plant.motion import DressingMotion
from benchmarks.scenario_run import run_scenario
from benchmarks.section import add_into_option, around, write_between
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.report.log import RunLog

_NAME = "plant"
_SCENARIOS = Path(__file__).parents[2] / "scenarios"
# The settings before `plant.fidelity` existed; its three values; the effect of each part of
# `standard`; the plain law with other meshes and time steps.
_STANDARD = Setting.of_fidelity("standard")
SETTINGS = (
    Setting("before", 0.02, 0.004),
    Setting("before, layers collide", 0.02, 0.004, self_collision=True),
    *(Setting.of_fidelity(name) for name in FIDELITIES),
    *(Setting.of_fidelity(name, self_collision=True) for name in FIDELITIES),
    replace(_STANDARD, name="standard, plain law", buckling_wavelength=0.0),
    replace(_STANDARD, name="standard, implicit Euler", implicitness=1.0),
    replace(_STANDARD, name="standard, solved to 1 %", tolerance=1e-2),
    Setting("before, the reference's step", 0.02, 0.001),
    Setting("before, the reference's mesh", 0.01, 0.004),
    Setting("before, 3 cm", 0.03, 0.004),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Computes the missing results and prints the table; returns the exit status."""
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    scenario = load_scenario(options.scenario)
    folder = options.scenario.parent
    motion = _motion(options.scenario, options.work / "run")
    fine = REFERENCE.of(scenario, folder)
    coarse = build_garment(scenario.garment, scenario.plant.spacing, folder)
    with caught_interrupt() as stop:
        parts = []
        for number, at in enumerate(part_begins(motion, options.parts), 1):
            parts.append(_kept_part(options.work, fine, coarse, motion, float(at)))
            print(f"reference: {number}/{options.parts}", flush=True)
            if stop.is_set():
                return stop.status
        results: list[dict[str, Any]] = []
        for setting in SETTINGS:
            if options.only and setting.name not in options.only:
                continue
            for result in compared(setting, scenario, folder, fine[0], motion, parts):
                results.append(result)
                if stop.is_set():
                    return stop.status
            print(_line(_row(results, setting.name)), flush=True)
    shown = _table(results).text()
    print(f"\n{shown}")
    if options.json is not None:
        write_figures(options.json, _figures(results), [], runs=results)
    if options.into is not None:
        write_between(options.into, _NAME, shown)
    return 0


def _motion(scenario: Path, run: Path) -> DressingMotion:
    """Returns the motion of a dressing, which is run first if necessary."""
    if not (run / "summary.json").exists():
        print("a dressing is run, from which the motion is taken", flush=True)
        _, problem = run_scenario(scenario, run, (), report=False)
        if problem:
            raise UserError("bench", "plant", problem)
    return DressingMotion.read(run / "run.h5")


def _kept_part(
    work: Path,
    fine: tuple[GarmentMesh, Integrator],
    coarse: GarmentMesh,
    motion: DressingMotion,
    at: float,
) -> Part:
    path = work / f"reference_{at:.3f}.npz"
    if path.exists():
        with np.load(path) as kept:
            return Part(at, *(kept[k] for k in ("x", "v", "end", "grippers", "person")))
    with RunLog.open(work / "run" / "run.h5") as log:
        part = reference_part(fine, coarse, log, motion, at)
    arrays = {k: v for k, v in vars(part).items() if k != "begin"}
    unfinished = path.with_name("unfinished.npz")
    np.savez_compressed(unfinished, **arrays)
    unfinished.replace(path)
    return part


def _row(results: Sequence[dict[str, Any]], name: str) -> list[Any]:
    mine = [r for r in results if r["case"]["name"] == name]
    case = mine[0]["case"]

    def median(key: str) -> float:
        return float(np.median([r[key] for r in mine]))

    def mean(key: str) -> float:
        return float(np.mean([r[key] for r in mine]))

    return [
        name,
        100.0 * case["spacing"],
        1e3 * case["time_step"],
        median("mean_mm"),
        mean("mean_mm"),
        median("p95_mm"),
        median("grippers_N"),
        mean("grippers_N"),
        median("person_N"),
        mean("person_N"),
        median("iterations"),
        median("mean_step_ms"),
        median("mean_step_ms") / case["time_step"],
    ]


def _figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns how far each setting is off and what it costs."""
    found = []
    for name in dict.fromkeys(r["case"]["name"] for r in results):
        row = _row(results, name)
        found += [
            Figure(f"{name}: position error, median", row[3], "mm"),
            Figure(f"{name}: error of the force on grippers, median", row[6], "N"),
            Figure(f"{name}: error of the force on the person, median", row[8], "N"),
            Figure(f"{name}: step time", row[11], "ms"),
        ]
    return found


def _line(row: Sequence[Any]) -> str:
    return f"{row[0]}: {row[3]:.1f} mm, {row[6]:.2f} N, {row[11]:.1f} ms a step"


def _table(results: Sequence[dict[str, Any]]) -> Table:
    names = list(dict.fromkeys(r["case"]["name"] for r in results))
    header = [
        "",
        "spacing, cm",
        "step, ms",
        "position error, mm",
        "mean",
        "95 % of nodes",
        "force error, grippers, N",
        "mean",
        "force error, person, N",
        "mean",
        "iterations a step",
        "ms a step",
        "ms a second",
    ]
    return Table("Compared with a reference", header, [_row(results, name) for name in names])


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument("--scenario", type=Path, default=_SCENARIOS / "dummy_standing.yaml")
    parser.add_argument("--parts", type=at_least_one, default=10, help="of the motion")
    parser.add_argument("--only", action="append", metavar="NAME", help="a setting; all by default")
    parser.add_argument("--work", type=output_folder, default=Path("out/plant"))
    parser.add_argument("--json", type=output_file, metavar="FILE")
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
