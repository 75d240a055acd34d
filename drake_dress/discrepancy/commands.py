"""What `drake-dress explain` and `drake-dress dataset measured` do."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario, resolved_yaml
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import Explanation, explain
from drake_dress.discrepancy.generate import Sensors, measured, record_all
from drake_dress.discrepancy.hidden import NOTHING, RANDOM, draw_hidden
from drake_dress.discrepancy.motions import MOTIONS, USUAL
from drake_dress.discrepancy.reading import all_notes, read_recordings
from drake_dress.discrepancy.results import as_json, extended_yaml, write_json
from drake_dress.discrepancy.sentences import headline
from drake_dress.discrepancy.suggestion import suggest
from drake_dress.discrepancy.where import spots
from drake_dress.discrepancy.windows import windows
from drake_dress.discrepancy.writing import write_recordings
from drake_dress.errors import UserError
from drake_dress.file_output import (
    DATASET_FILES,
    EXPLAIN_FILES,
    claimed,
    remove_results,
    write_text,
)
from drake_dress.models.effects.effect import Effect

DURATION = 4.0


def explain_files(
    files: Sequence[str],
    scenario_file: str,
    overrides: Sequence[str],
    out: Path,
    workers: int | None = None,
) -> Explanation:
    """Explains measured logs and writes explanation.json, report.html and extended.yaml.

    Args:
        files: measured logs.
        scenario_file: YAML of the model that is held against them.
        overrides: KEY=VALUE changes of it.
        out: directory to write to; made when all input has proved usable.
        workers: processes; by default as many as there are cores.

    Raises:
        UserError: a file cannot be used.
    """
    scenario = load_scenario(scenario_file, overrides)
    base = Path(scenario_file).parent
    mesh = build_garment(scenario.garment, scenario.plant.spacing, base)
    recordings = read_recordings(files, mesh, scenario.plant.material.surface_density)
    notes = all_notes(recordings)
    for note in notes:
        print(f"note: {note}")
    with _progress() as (stage, tick):
        stage("settling")
        with Experiment(scenario, base, recordings, workers=workers) as experiment:
            found = explain(experiment, scenario.seed, stage, tick)
            comparison = found.comparison
            off = spots(
                comparison.whitening,
                comparison.vector["refined"],
                experiment.recordings,
                mesh,
                [t.contact for t in comparison.told["refined"]],
                experiment.samples,
                experiment.labs["scenario"].person(()),
            )
            stage("running on its own")
            alone = windows(experiment, found, tick)
            advice = suggest(found, scenario, base, stage)
            yaml_text = extended_yaml(scenario, experiment, found)
            page = _page(out, found, experiment, off, alone, advice, resolved_yaml(scenario), notes)
    # whatever comes of the files, the answer is there
    print(headline(found), flush=True)
    extended, report, explanation = (out / name for name in EXPLAIN_FILES)
    with claimed("--out", out, wait=True):
        remove_results(out, EXPLAIN_FILES)
        write_text(extended, yaml_text)
        write_json(explanation, as_json(found, off, alone, advice, notes))
        if page is not None:
            write_text(report, page)
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
    """Writes measured.h5, and apart answer.json.

    Args:
        hide: effects joined by "+", `nothing` or `random`.
        seed: of all that is drawn.
        out: directory.
        scenario_file: the model that knows nothing of what is hidden.
        overrides: KEY=VALUE changes of it.
        size: of the effect, times what matters.
        sensors: noise, markers, rate.
        motions: what is done with the garment.

    Raises:
        UserError: an effect has no such name, or the scenario cannot be used.
    """
    if seed < 0:
        raise UserError("--seed", "", f"is {seed}, expected 0 or more")
    _check_motions(motions)
    scenario = load_scenario(scenario_file, overrides)
    seeds = [seed, *hide.encode()]
    rng = np.random.default_rng(seeds)
    hidden = draw_hidden(hide, rng, size)
    sensors = sensors or Sensors()
    with _progress() as (stage, _):
        stage(f"recording {', '.join(motions)}")
        clean = record_all(
            scenario,
            Path(scenario_file).parent,
            hidden,
            seeds,
            DURATION,
            sensors,
            done=lambda name: stage(f"recorded {name}"),
            motions=motions,
        )
    recordings = [measured(r, sensors, rng) for r in clean]
    measured_file, answer_file = (out / name for name in DATASET_FILES)
    with claimed("--out", out, wait=True):
        remove_results(out, DATASET_FILES)
        write_recordings(measured_file, recordings, resolved_yaml(scenario))
        write_json(answer_file, _answer(hidden))
    print(f"measured.h5 and answer.json: {out}" + (" (random)" if hide == RANDOM else ""))


def _check_motions(motions: Sequence[str]) -> None:
    """Raises UserError where a motion is unknown or named twice."""
    for name in motions:
        if name not in MOTIONS:
            named = name or "an empty name"
            raise UserError("--motions", named, f"is no motion, expected {', '.join(MOTIONS)}")
        if motions.count(name) > 1:
            raise UserError("--motions", name, "stands twice, expected it once")


def _answer(hidden: Sequence[Effect]) -> dict[str, Any]:
    """Returns the content of answer.json: the hidden effects and their parameters.

    Parameters are grouped by effect where there are several.
    """
    names = [e.NAME for e in hidden]
    answer = {
        "effect": "+".join(names) if names else NOTHING,
        "parameters": {e.NAME: e.values() for e in hidden} if len(names) > 1 else {},
    }
    if len(hidden) == 1:
        answer["parameters"] = hidden[0].values()
    return answer


def _page(out: Path, *told: Any) -> str | None:
    """Returns the report; where it cannot be made, tells so in a line and returns None."""
    try:
        from drake_dress.discrepancy.report import report_page

        return report_page(*told)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        print(f"drake-dress: {out / EXPLAIN_FILES[1]}: {reason}", file=sys.stderr)
        return None


@contextmanager
def _progress() -> Iterator[tuple[Callable[[str], None], Callable[[], None]]]:
    """Yields what says the stage and what counts replays: a bar, or lines where no one watches."""
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
