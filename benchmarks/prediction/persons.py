"""Learns from recordings of some persons and predicts others, beside the linear map."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.prediction.streams import Told
from drake_dress.errors import UserError
from drake_dress.learning.evaluation.baselines import damped_velocity, mean_of, still
from drake_dress.learning.evaluation.stream import followed
from drake_dress.learning.motion.windows import WindowSource
from drake_dress.learning.recordings.pieces import Pieces
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.learning.training.commands import with_recordings
from drake_dress.learning.training.motion import NOISE, MotionTraining, shortened
from drake_dress.models.human.learned.linear import LinearFit, LinearMotion
from drake_dress.models.human.learned.network import FUTURE, HISTORY
from drake_dress.models.human.learned.predictor import LearnedPredictor, Networks
from drake_dress.models.human.learned.ridge import RidgePredictor

SHIPPED_RIDGE, OWN_RIDGE = "ridge", "ridge of the same recordings"
FOLDS = 3
_BATCHES, _BATCH = 30, 1024


def folds(paths: Sequence[Path], durations: Sequence[float]) -> list[list[int]]:
    """Returns the numbers of the recordings in each fold; those in one folder are of one person.

    Folders are dealt out by their duration, the longest first, each to the shortest fold.

    Raises:
        UserError: there are not enough folders.
    """
    groups: dict[Path, list[int]] = {}
    for number, path in enumerate(paths):
        groups.setdefault(path.resolve().parent, []).append(number)
    if len(groups) < FOLDS:
        raise UserError(
            "bench",
            "--recordings",
            f"are in {len(groups)} folders, expected {FOLDS} or more: one folder a person",
        )
    total = {folder: sum(durations[n] for n in numbers) for folder, numbers in groups.items()}
    found: list[list[int]] = [[] for _ in range(FOLDS)]
    for folder in sorted(groups, key=lambda g: -total[g]):
        shortest = min(found, key=lambda fold: sum(durations[n] for n in fold))
        shortest += groups[folder]
    return found


def across_persons(
    motions: Sequence[TimedMotion],
    parts: Sequence[Sequence[int]],
    base: MotionTraining,
    networks: Networks,
    steps: int | None = None,
    tell: Callable[[str], None] = lambda line: None,
) -> Mapping[str, Told]:
    """Returns what was found on each recording, predicted by what learned from other folds.

    Args:
        motions: recordings.
        parts: folds, from `folds`.
        base: training on synthetic sequences, to which recordings are added.
        networks: weights that each training goes on from.
        steps: largest number of steps of a training; None: as scheduled.
        tell: is called with lines on what is done.
    """
    found: dict[str, Told] = {}
    for k, part in enumerate(parts):
        others = [motion for n, motion in enumerate(motions) if n not in part]
        tell(f"part {k + 1} of {len(parts)}: learns from {len(others)} recordings")
        training = with_recordings(replace(base, seed=k), networks.motion, others)
        weights = (training if steps is None else shortened(training, steps)).run()
        assert weights is not None
        learned = LearnedPredictor(Networks(networks.intent, weights))
        baselines = {
            "still": still,
            "damped velocity": damped_velocity,
            SHIPPED_RIDGE: mean_of(RidgePredictor(networks.linear)),
            OWN_RIDGE: mean_of(RidgePredictor(linear_of(others))),
        }
        for number in part:
            told = found.setdefault(motions[number].name, Told())
            told.add(followed(motions[number], learned, baselines))
            tell(f"followed {motions[number].name}")
    return found


def linear_of(motions: Sequence[TimedMotion], seed: int = 0) -> LinearMotion:
    """Returns the linear map that is fitted to recordings."""
    source, fit = WindowSource(Pieces.of(motions), seed, noise=NOISE), LinearFit(HISTORY, FUTURE)
    for _ in range(_BATCHES):
        batch = source.drawn(_BATCH)
        fit.add(batch.arms.joints[:, :, :3], batch.displacement)
    return fit.solved()


def gain(told: Sequence[Told], ridge: str) -> float:
    """Returns by which share the learned predictor's error is below a ridge's, all arms alike."""
    errors = {
        name: np.concatenate([t.moving.get(name, []) + t.resting.get(name, []) for t in told])
        for name in ("learned", ridge)
    }
    return float(1.0 - errors["learned"].mean() / errors[ridge].mean())
