"""Follows a motion as the predictor in a run would, and compares each forecast with what came."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned.forecast import Forecast, PersonHistory, PersonPredictor
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD

# A predictor of the mean alone: (F+1,6,3) m from a history.
Baseline = Callable[[PersonHistory], FloatArray]
# Time before the first forecast that counts, s: less than a full history, as in a run.
_SETTLING = 1.0
# Travel of a hand within a history and the future after it, above which the arm moves, m.
MOVES = 0.05


@dataclass(frozen=True)
class Compared:
    """One forecast of a motion, compared.

    Attributes:
        time: s.
        errors: (F+1,6) of each predictor's mean, m, by name; NaN where the truth is not known.
        moves: (2,) whether each arm moves, before or after now.
        inside: (F+1,6) whether the joints are in the learned predictor's regions.
        best: (2,) least mean error of a sample over an arm's joints and steps, m.
        known: (F+1,6) whether the truth is known.
        intent: (2,) predicted probability, and the truth (2,), NaN where nobody knows.
        hidden: (6,) whether each joint was hidden.
        is_linear: whether the network was not used.
    """

    time: float
    errors: Mapping[str, FloatArray]
    moves: BoolArray
    inside: BoolArray
    best: FloatArray
    known: BoolArray
    intent: tuple[FloatArray, FloatArray]
    hidden: BoolArray
    is_linear: bool


def followed(
    motion: TimedMotion,
    predictor: PersonPredictor,
    baselines: Mapping[str, Baseline],
    noise: float = 0.0,
    seed: int = 0,
    hide: Callable[[float], BoolArray] | None = None,
) -> Iterator[Compared]:
    """Yields the comparison of each forecast, every `PERIOD`.

    Args:
        motion: what is followed.
        predictor: the learned one, in its tables `learned`.
        baselines: others, by name.
        noise: standard deviation of what is added to each coordinate that is observed, m.
        seed: of the noise.
        hide: returns (6,) which joints are hidden at a time, s.
    """
    rng = np.random.default_rng(seed)
    observed = motion.joints + noise * rng.normal(size=motion.joints.shape)
    if hide is not None:
        for k, time in enumerate(motion.time):
            observed[k, hide(time)] = np.nan
    memory = predictor.begin()
    ahead = PERIOD * np.arange(FUTURE + 1)
    begin, end = motion.time[0], motion.time[-1]
    for now in np.arange(begin, end - ahead[-1] + 1e-9, PERIOD):
        history = motion.history(now, predictor.sampling, observed)
        if not np.isfinite(history.joints).any():
            continue
        forecast, memory = predictor.forecast(history, memory)
        if now < begin + _SETTLING:
            continue
        true = motion.joints_at(now + ahead)
        before = motion.joints_at(now - PERIOD * np.arange(HISTORY - 1, 0, -1))
        means = {name: of(history) for name, of in baselines.items()} | {"learned": forecast.mean}
        yield _compared(now, forecast, means, true, before, motion)


def _compared(
    now: float,
    forecast: Forecast,
    means: Mapping[str, FloatArray],
    true: FloatArray,
    before: FloatArray,
    motion: TimedMotion,
) -> Compared:
    errors = {name: np.linalg.norm(mean - true, axis=2) for name, mean in means.items()}
    known = np.all(np.isfinite(true), axis=2)
    off = np.linalg.norm(forecast.samples - true, axis=3)[:, 1:]
    every = np.concatenate([before, true])
    moves, best = np.zeros(2, dtype=bool), np.full(2, np.nan)
    for arm in (0, 1):
        hand = np.linalg.norm(every[:, 3 * arm + 2] - true[0, 3 * arm + 2], axis=1)
        moves[arm] = bool(np.nanmax(hand, initial=0.0) > MOVES)
        if known[:, 3 * arm : 3 * arm + 3].all():
            best[arm] = off[:, :, 3 * arm : 3 * arm + 3].mean(axis=(1, 2)).min()
    intent = motion.intent_at(now)
    told = np.full(2, np.nan) if intent is None else intent.astype(np.float64)
    return Compared(
        now,
        errors,
        moves,
        errors["learned"] <= forecast.radius,
        best,
        known,
        (forecast.intent, told),
        ~forecast.seen,
        forecast.is_linear,
    )
