"""Implements `drake-dress explain` and `drake-dress dataset measured`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario, resolved_yaml
from drake_dress.discrepancy.explained import Explained, explained
from drake_dress.discrepancy.generate import Sensors, Session, make_dataset
from drake_dress.discrepancy.hidden_effect import NOTHING, RANDOM
from drake_dress.discrepancy.measured_log import write_recordings
from drake_dress.discrepancy.motions import USUAL
from drake_dress.discrepancy.reading import all_notes, read_recordings
from drake_dress.discrepancy.results import write_json
from drake_dress.errors import UserError
from drake_dress.file_output import (
    DATASET_FILES,
    claimed,
    remove_results,
)
from drake_dress.models.effects.effect import Effect

DURATION = 4.0


def explain_files(
    files: Sequence[str],
    scenario_file: str,
    overrides: Sequence[str],
    out: Path,
    workers: int | None = None,
) -> Explained:
    """Explains measured logs and writes explanation.json, report.html and extended.yaml.

    Args:
        files: measured logs.
        scenario_file: YAML of the model that is compared with them.
        overrides: KEY=VALUE changes of the scenario.
        out: directory to write to; it is made once all input has proved usable.
        workers: number of processes; by default the number of cores.

    Raises:
        UserError: a file cannot be used.
    """
    scenario = load_scenario(scenario_file, overrides)
    base = Path(scenario_file).parent
    mesh = build_garment(scenario.garment, scenario.plant.spacing, base)
    recordings = read_recordings(files, mesh, scenario.plant.material.surface_density)
    for note in all_notes(recordings):
        print(f"note: {note}")
    with _progress() as (stage, tick):
        found = explained(scenario, base, recordings, None, workers, stage, tick)
    # print the answer first, in case the files cannot be written
    print(found, flush=True)
    found.write(out, "--out")
    print(f"report, explanation and extended scenario: {out}")
    return found


def write_dataset(
    hide: str,
    seed: int,
    out: Path,
    scenario_file: str,
    overrides: Sequence[str] = (),
    size: float = 1.0,
    sensors: Sensors | None = None,
    motions: Sequence[str] = USUAL,
) -> None:
    """Writes measured.h5, and the hidden effects to answer.json.

    Args:
        hide: names of effects joined by "+", `nothing` or `random`.
        seed: seed of all random draws.
        out: directory to write to.
        scenario_file: YAML of the model without the hidden effects.
        overrides: KEY=VALUE changes of the scenario.
        size: factor on the strength of the hidden effects.
        sensors: noise, number of markers and rate.
        motions: motions of the garment.

    Raises:
        UserError: an effect is unknown, or the scenario cannot be used.
    """
    if seed < 0:
        raise UserError("--seed", "", f"is {seed}, expected 0 or more")
    session = Session(motions, DURATION, sensors or Sensors())
    session.check("--motions")
    scenario = load_scenario(scenario_file, overrides)
    base = Path(scenario_file).parent
    with _progress() as (stage, _):
        made = make_dataset(scenario, base, hide, seed, size, session, stage=stage)
    measured_file, answer_file = (out / name for name in DATASET_FILES)
    with claimed("--out", out, wait=True):
        remove_results(out, DATASET_FILES)
        write_recordings(measured_file, made.recordings, resolved_yaml(scenario))
        write_json(answer_file, _answer(made.hidden))
    print(f"measured.h5 and answer.json: {out}" + (" (random)" if hide == RANDOM else ""))


def _answer(hidden: Sequence[Effect]) -> dict[str, Any]:
    """Returns the content of answer.json: the hidden effects and their parameters.

    Parameters are grouped by effect if there are several effects.
    """
    names = [e.NAME for e in hidden]
    answer = {
        "effect": "+".join(names) if names else NOTHING,
        "parameters": {e.NAME: e.values() for e in hidden} if len(names) > 1 else {},
    }
    if len(hidden) == 1:
        answer["parameters"] = hidden[0].values()
    return answer


@contextmanager
def _progress() -> Iterator[tuple[Callable[[str], None], Callable[[], None]]]:
    """Yields callbacks for stages and replays: a progress bar, or lines if not on a terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda text: print(text, file=sys.stderr, flush=True), lambda: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} replays"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=None)
        yield (
            lambda text: bar.update(task, description=text),
            lambda: bar.advance(task),
        )
