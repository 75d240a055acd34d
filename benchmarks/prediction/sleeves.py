"""What sleeves tell of a person: predictions on the same sequences with and without them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least
from drake_dress.learning.evaluation.held_out import compared, held_out_batches, intent_score
from drake_dress.learning.motion.sequence import Kind
from drake_dress.learning.motion.windows import Sequences
from drake_dress.models.human.learned.network import HISTORY
from drake_dress.models.human.learned.predictor import Networks

_ASKED = 20.0  # %, by which the error of passive persons is higher without sleeves


@dataclass(frozen=True)
class Way:
    """A way to predict: its name, weights, and whether sleeves are shown."""

    name: str
    weights: Networks
    shown: bool


def ways_to_see(weights: Networks, sleeveless: Networks | None) -> list[Way]:
    """Returns the ways to predict, that with sleeves first.

    Args:
        weights: trained with sleeves; in some windows none was shown.
        sleeveless: trained without any; None without.
    """
    ways = [Way("seen", weights, True), Way("not seen", weights, False)]
    if sleeveless is not None:
        ways.append(Way("never seen in training", sleeveless, False))
    return ways


def told_by_sleeves(
    data: Mapping[Kind, Sequences], ways: Sequence[Way], noise: float
) -> tuple[list[Table], list[Figure]]:
    """Returns errors and intent by kind and way, and by how much each errs more than the first.

    Args:
        data: held-out sequences.
        ways: to predict.
        noise: of each observed coordinate, m.
    """
    rows: list[list[object]] = []
    figures = []
    for kind, sequences in data.items():
        errors = []
        for way in ways:
            batches = held_out_batches(sequences, noise, way.shown)
            found = compared(batches, way.weights, {}).mean().errors["learned"]
            score = intent_score(batches, way.weights.intent, HISTORY)
            name = f"{kind}, sleeves {way.name}"
            in_mm = [1e3 * error for error in found.values()]
            rows.append([name, *in_mm, 100.0 * score.balanced, score.area])
            errors.append(found["2 s"])
            if len(errors) == 1:
                continue
            more, what = 100.0 * (errors[-1] / errors[0] - 1.0), f"{name}: error higher by"
            if kind == "passive":
                figures.append(at_least(what, more, "%", _ASKED))
            else:
                figures.append(Figure(what, more, "%"))
    header = ["", "mm, 1 s", "mm, 2 s", "intent, both alike, %", "area under the curve"]
    return [Table("What sleeves tell", header, rows)], figures
