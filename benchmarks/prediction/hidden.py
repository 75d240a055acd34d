"""Joints that are hidden for a while: how far off they are filled in, beside holding them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.learning.evaluation.stream import followed
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.arrays import BoolArray
from drake_dress.models.human.learned.forecast import PersonPredictor

HAND, ELBOW = 2, 1
_BEGINS = 3.0  # s into a motion


@dataclass(frozen=True)
class Hidden:
    """Errors of a joint at the end of a time in which it was hidden, m.

    Attributes:
        filled: of the predictor.
        held: of its last seen place.
    """

    filled: float
    held: float


def hidden_errors(
    motions: Sequence[TimedMotion],
    predictor: PersonPredictor,
    joint: int,
    duration: float,
    noise: float,
) -> Iterator[Hidden]:
    """Yields the errors of both arms of each motion, one arm hidden at a time.

    Args:
        motions: at least `_BEGINS` + `duration` + 2 s long.
        predictor: of the person.
        joint: `HAND` or `ELBOW`.
        duration: for which it is hidden, s.
        noise: of observed coordinates, m.
    """
    for number, motion in enumerate(motions):
        arm = number % 2
        row = 3 * arm + joint
        since = motion.time[0] + _BEGINS
        until = since + duration

        def hide(time: float, row: int = row, since: float = since) -> BoolArray:
            hidden = np.zeros(6, dtype=bool)
            hidden[row] = time >= since
            return hidden

        last = motion.joints_at(np.array([since - 1e-6, until]))[:, row]
        for c in followed(motion, predictor, {}, noise, seed=number, hide=hide):
            if c.time >= until - 1e-6:
                held = float(np.linalg.norm(last[1] - last[0]))
                yield Hidden(float(c.errors["learned"][0, row]), held)
                break
