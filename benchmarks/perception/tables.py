"""Tables and figures of tracking."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_most
from benchmarks.perception.tracking import WAYS

# Figure to its heading, the factor to its unit, and what is asked of the tracker.
_FIGURES: dict[str, tuple[str, float, float | None]] = {
    "node_mean_m": ("nodes, mean, cm", 100.0, 1.5),
    "hidden_mean_m": ("hidden nodes, mean, cm", 100.0, 2.5),
    "armhole_median_m": ("armhole, median, cm", 100.0, 1.0),
    "armhole_95_m": ("armhole, 95 %, cm", 100.0, 2.5),
    "direction_median_deg": ("direction, median, °", 1.0, None),
    "direction_95_deg": ("direction, 95 %, °", 1.0, 10.0),
}
Result = dict[str, Any]


def tables(results: Sequence[Result]) -> list[Table]:
    """Returns the errors of each way of tracking: means over runs, and the worst run."""
    done = [r for r in results if "summary" in r]
    heads = [heading for heading, _, _ in _FIGURES.values()]
    rows: list[list[Any]] = []
    for way in WAYS if done else ():
        rows.append([way, *(_told(done, way, name) for name in _FIGURES)])
    rows.append(["asked of the tracker", *(asked for _, _, asked in _FIGURES.values())])
    persons = sorted({r["case"]["person"] for r in done})
    by_person = [
        [person, sum(r["case"]["person"] == person for r in done)]
        + [
            _told([r for r in done if r["case"]["person"] == person], "tracker", name)
            for name in _FIGURES
        ]
        for person in persons
    ]
    return [
        Table("Errors of the tracked coat: mean over runs (worst run)", ["", *heads], rows),
        Table("The tracker by person", ["", "runs", *heads], by_person),
    ]


def figures(results: Sequence[Result]) -> list[Figure]:
    """Returns the tracker's errors, and how they compare with the simulation alone."""
    done = [r for r in results if "summary" in r]
    if not done:
        return []
    found = []
    for name, (heading, factor, asked) in _FIGURES.items():
        value = factor * float(np.mean(_values(done, "tracker", name)))
        what, _, unit = heading.rpartition(", ")
        if asked is not None:
            found.append(at_most(f"tracker: {what}", value, unit, asked))
    share = float(np.mean(_values(done, "tracker", "hidden_share")))
    found.append(Figure("share of the coat that is hidden", share, "1"))
    alone, used = (
        float(np.mean(_values(done, way, "node_mean_m"))) for way in ("simulation alone", "tracker")
    )
    found.append(
        at_most("tracker: nodes, as a share of the simulation alone", used / alone, "1", 0.5)
    )
    return found


def tell(summary: dict[str, Any]) -> str:
    """Returns the tracker's errors of one run in a few words."""
    t, alone = summary["ways"]["tracker"], summary["ways"]["simulation alone"]
    return (
        f"nodes {100 * t['node_mean_m']:.1f} cm (simulation alone "
        f"{100 * alone['node_mean_m']:.1f} cm), armholes {100 * t['armhole_median_m']:.1f} cm"
    )


def _told(results: Sequence[Result], way: str, name: str) -> str:
    values = _FIGURES[name][1] * np.array(_values(results, way, name))
    return f"{values.mean():.1f} ({values.max():.1f})"


def _values(results: Sequence[Result], way: str, name: str) -> list[float]:
    return [r["summary"]["ways"][way][name] for r in results]
