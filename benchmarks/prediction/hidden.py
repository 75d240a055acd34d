"""Joints that are hidden for a while: how far off they are filled in, beside holding them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.learning.evaluation.stream import followed
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.arrays import BoolArray
from drake_dress.models.human.learned.forecast import PersonPredictor
from drake_dress.models.human.learned.network import FUTURE, PERIOD

HAND, ELBOW = 2, 1
_SEED = 11  # of the times at which a joint is hidden
_BEFORE = 3.0  # s for which all joints are seen before
_AFTER = FUTURE * PERIOD  # s that a forecast goes on beyond what is compared


@dataclass(frozen=True)
class Hidden:
    """Errors of a joint at the end of a time in which it was hidden, m.

    Attributes:
        filled: of the predictor.
        held: of its last seen place.
    """

    filled: float
    held: float


def mean_errors(found: Sequence[Hidden]) -> tuple[float, float]:
    """Returns the mean errors of the predictor and of the last seen place, m."""
    return float(np.mean([h.filled for h in found])), float(np.mean([h.held for h in found]))


def hidden_errors(
    motions: Sequence[TimedMotion],
    predictor: PersonPredictor,
    joint: int,
    duration: float,
    noise: float,
) -> Iterator[Hidden]:
    """Yields the error of an arm of each motion, left and right in turn, hidden at a drawn time.

    Args:
        motions: at least `_BEFORE` + `duration` + `_AFTER` long.
        predictor: of the person.
        joint: `HAND` or `ELBOW`.
        duration: for which it is hidden, s.
        noise: of observed coordinates, m.
    """
    for number, motion in enumerate(motions):
        arm = number % 2
        row = 3 * arm + joint
        first, last = motion.time[0] + _BEFORE, motion.time[-1] - duration - _AFTER
        since = float(np.random.default_rng((_SEED, number)).uniform(first, max(first, last)))
        part = motion.between(since - _BEFORE, since + duration + _AFTER + PERIOD)
        since = float(part.time[0]) + _BEFORE
        until = since + duration

        def hide(time: float, row: int = row, since: float = since) -> BoolArray:
            hidden = np.zeros(6, dtype=bool)
            hidden[row] = time >= since
            return hidden

        places = motion.joints_at(np.array([since - 1e-6, until]))[:, row]
        for c in followed(part, predictor, {}, noise, seed=number, hide=hide):
            if c.time >= until - 1e-6:
                held = float(np.linalg.norm(places[1] - places[0]))
                yield Hidden(float(c.errors["learned"][0, row]), held)
                break
