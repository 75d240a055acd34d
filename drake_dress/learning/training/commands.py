"""Implements `drake-dress train`: reads data, trains with progress, writes weights and figures."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from drake_dress import __version__
from drake_dress.errors import UserError
from drake_dress.file_output import claimed, write_text
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.learning.evaluation.held_out import compared, held_out_batches, intent_score
from drake_dress.learning.motion.dataset import MotionData, Part, read_motion
from drake_dress.learning.motion.sequence import Kind
from drake_dress.learning.recordings import Listed, read_all
from drake_dress.learning.recordings.pieces import LENGTH, Pieces
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.learning.training.intent import IntentTraining
from drake_dress.learning.training.loop import Report, Schedule
from drake_dress.learning.training.motion import ADAPTING, MotionTraining, shortened
from drake_dress.learning.training.recurrent import RecurrentTraining, recurrent_errors
from drake_dress.models.human.learned.predictor import Networks
from drake_dress.models.human.learned.weights import (
    FILES,
    INTENT,
    SHIPPED,
    intent_shapes,
    networks,
    read_weights,
    write_weights,
)

FIGURES = "figures.json"
_DRESSED: tuple[Kind, ...] = ("passive", "active")
_KINDS: tuple[Kind, ...] = ("passive", "active", "free")
_NOISES = (0.004, 0.0)
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class TrainOptions:
    """Options of a training.

    Attributes:
        data: folder of the data set.
        out: folder to write to.
        seed: of weights and batches.
        steps: largest number of steps of each part; None: as scheduled.
        with_sleeves: whether the networks see sleeves.
        recordings: of people that the motion is learned from, too.
        start: folder of the weights that recordings are added to.
    """

    data: Path
    out: Path
    seed: int = 0
    steps: int | None = None
    with_sleeves: bool = True
    recordings: tuple[Listed, ...] = ()
    start: Path = SHIPPED


def train_command(name: str, options: TrainOptions) -> int:
    """Trains a network by its name and writes weights and figures; returns the exit status.

    Raises:
        UserError: the data cannot be used, or there are no weights that this training needs.
    """
    begin = time.perf_counter()
    with claimed("--out", options.out), caught_interrupt() as stop:
        trainings = {"intent": _intent, "motion": _motion, "recurrent": _recurrent}
        weights, figures = trainings[name](options, stop)
        if weights is None:
            print(f"stopped; the same command goes on from {options.out}", flush=True)
            return stop.status
        told = {
            "command": _command(name, options),
            "version": __version__,
            "data": _told_of(options.data),
        }
        write_weights(options.out / FILES[name], weights, told)
        kept = _figures_of(options.out)
        # a training that went on tells the time of its last part only
        kept[name] = figures | told | {"seconds_of_last_part": time.perf_counter() - begin}
        write_text(options.out / FIGURES, json.dumps(kept, indent=1) + "\n")
    print(f"weights and figures: {options.out}")
    return 0


def _command(name: str, options: TrainOptions) -> str:
    """Returns the command without folders and without what is said of the recordings."""
    words = ["drake-dress train", name, f"--seed {options.seed}"]
    if options.steps is not None:
        words.append(f"--steps {options.steps}")
    if not options.with_sleeves:
        words.append("--no-sleeves")
    if options.recordings:
        words.append(" ".join(["--recordings", *(file.path.name for file in options.recordings)]))
    return " ".join(words)


def _intent(options: TrainOptions, stop: Interrupt) -> tuple[Arrays | None, dict[str, Any]]:
    data = {part: read_motion(options.data, _DRESSED, part) for part in _PARTS}
    training = IntentTraining(
        data["training"], data["validation"], options.seed, with_sleeves=options.with_sleeves
    )
    weights = _carried_out("intent", training, options, stop)
    if weights is None:
        return None, {}
    batches = held_out_batches(data["test"], _NOISES[0], options.with_sleeves)
    return weights, {
        f"after_{steps}_steps": vars(intent_score(batches, weights, steps)) for steps in (20, 10)
    }


def _motion(options: TrainOptions, stop: Interrupt) -> tuple[Arrays | None, dict[str, Any]]:
    start = None
    if options.recordings:
        start = networks(options.start)
        write_weights(options.out / INTENT, start.intent, {"copied from": options.start.name})
    intent = read_weights(options.out / INTENT, intent_shapes())
    training = MotionTraining(
        read_motion(options.data, _KINDS, "training"),
        {kind: read_motion(options.data, (kind,), "validation") for kind in _KINDS},
        intent,
        options.seed,
        options.with_sleeves,
    )
    if start is not None:
        motions = read_all(options.recordings, lambda line: print(f"note: {line}", flush=True))
        training = with_recordings(training, start.motion, motions)
    if options.steps is not None:
        training = shortened(training, options.steps)
    schedules = {name: getattr(training, name).steps for name in _STAGES}
    with _progress() as said:
        weights = training.run(
            options.out, lambda stage: said(stage, schedules[stage]), stop.is_set
        )
    if weights is None:
        return None, {}
    test = {kind: read_motion(options.data, (kind,), "test") for kind in _KINDS}
    return weights, motion_figures(test, Networks(intent, weights), options.with_sleeves)


def _recurrent(options: TrainOptions, stop: Interrupt) -> tuple[Arrays | None, dict[str, Any]]:
    training = RecurrentTraining(
        read_motion(options.data, _KINDS, "training"),
        {kind: read_motion(options.data, (kind,), "validation") for kind in _KINDS},
        options.seed,
        with_sleeves=options.with_sleeves,
    )
    weights = _carried_out("recurrent", training, options, stop)
    if weights is None:
        return None, {}
    test = {kind: read_motion(options.data, (kind,), "test") for kind in _KINDS}
    return weights, {
        kind: float(
            np.mean(
                [
                    recurrent_errors(weights, batch).mean()
                    for batch in held_out_batches(data, _NOISES[0], options.with_sleeves)
                ]
            )
        )
        for kind, data in test.items()
    }


def _carried_out(
    name: str,
    training: IntentTraining | RecurrentTraining,
    options: TrainOptions,
    stop: Interrupt,
) -> Arrays | None:
    """Trains one network with progress and a checkpoint; returns None if it was stopped."""
    if options.steps is not None:
        training = replace(training, schedule=_at_most(training.schedule, options.steps))
    with _progress() as said:
        report = said(name, training.schedule.steps)
        return training.run(options.out / f"{name}.checkpoint.safetensors", report, stop.is_set)


def with_recordings(
    training: MotionTraining, start: Mapping[str, np.ndarray], motions: Sequence[TimedMotion]
) -> MotionTraining:
    """Returns a training that goes on from the weights `start` with recordings.

    The last fifth of each recording is for validation, and at least one piece; a recording that is
    not twice as long as a piece is learned from alone.

    Raises:
        UserError: the recordings are too short.
    """
    cut = [_cut_of(m) for m in motions]
    early = Pieces.of(m.between(-np.inf, t) for m, t in zip(motions, cut, strict=True))
    late = Pieces.of(m.between(t, np.inf) for m, t in zip(motions, cut, strict=True))
    return replace(
        training,
        recorded=early,
        start=start,
        residual=ADAPTING,
        validation={**training.validation, "recorded": late},
    )


def _cut_of(motion: TimedMotion) -> float:
    """Returns the time, s, from which a recording is for validation."""
    begin, end = float(motion.time[0]), float(motion.time[-1])
    if end - begin < 2.0 * LENGTH:
        return np.inf
    return end - max(LENGTH, _HELD_BACK * (end - begin))


_HELD_BACK = 0.2  # share of a recording
_PARTS: tuple[Part, ...] = ("training", "validation", "test")
_STAGES = ("residual", "denoiser", "initialiser")


def motion_figures(
    test: Mapping[Kind, MotionData], networks: Networks, with_sleeves: bool = True
) -> dict[str, Any]:
    """Returns the results on held-out sequences, by kind and noise."""
    return {
        f"{kind}, noise {1e3 * noise:g} mm": vars(
            compared(held_out_batches(data, noise, with_sleeves), networks, {}).mean()
        )
        for kind, data in test.items()
        for noise in _NOISES
    }


def _at_most(schedule: Schedule, steps: int) -> Schedule:
    return replace(schedule, steps=steps, every=min(schedule.every, steps))


def _told_of(data: Path) -> str:
    card = data / "card.md"
    if not card.is_file():
        return str(data.name)
    lines = card.read_text(encoding="utf-8").splitlines()
    return next((line.strip("` ") for line in lines if "drake-dress dataset" in line), data.name)


def _figures_of(folder: Path) -> dict[str, Any]:
    path = folder / FIGURES
    if not path.is_file():
        return {}
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        raise UserError(str(path), "", "is no JSON; remove it to write it anew") from None
    return kept if isinstance(kept, dict) else {}


@contextmanager
def _progress() -> Iterator[Callable[[str, int], Report]]:
    """Yields what makes a progress bar, or lines where there is no terminal, for a stage."""
    console = Console()
    columns = (
        TextColumn("{task.description:12}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f} steps, loss {task.fields[loss]:.4g}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:

        def said(stage: str, steps: int) -> Report:
            task = bar.add_task(stage, total=steps, loss=float("nan"))

            def report(step: int, loss: float) -> None:
                bar.update(task, completed=step, loss=loss)
                if not console.is_terminal:
                    print(f"{stage}: {step}/{steps} steps, loss {loss:.4g}", flush=True)

            return report

        yield said
