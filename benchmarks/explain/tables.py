"""Tables of a study: rate of correct verdicts, and errors of the parameters."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least
from benchmarks.statistics import wilson
from drake_dress.discrepancy.explanation import DISCRETISATION
from drake_dress.drawing import as_svg, plain_settings
from drake_dress.report.page import chart

ASKED = {"effect": 90, "nothing": 95, "pair": 75, "coarse": 90, "outside": 100}
_CONFIDENCES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)
# Confidence below which a related effect may be named without being wrong.
_LOW = 0.7


def right(result: dict[str, Any]) -> bool:
    """Returns whether the verdict names exactly the hidden effects.

    An effect outside the list must be called unexplained, or be attributed to other effects with
    low confidence.
    """
    named = {c["effect"] for c in result["causes"]}
    wanted = set(result["hidden"])
    if result["case"]["group"] == "coarse":
        return result["verdict"] == "named" and named == {DISCRETISATION}
    if result["case"]["group"] == "outside":
        sure = any(c["confidence"] >= _LOW for c in result["causes"])
        return result["verdict"] == "unexplained" or (result["verdict"] != "nothing" and not sure)
    if not wanted:
        return bool(result["verdict"] == "nothing")
    return bool(result["verdict"] == "named" and named == wanted)


def right_but_for_numerics(result: dict[str, Any]) -> bool:
    """Returns whether the hidden effects are named together with the scenario's discretisation.

    With little noise, discretisation errors exceed the noise and are named with good reason;
    strictly, the verdict is not right.
    """
    named = {c["effect"] for c in result["causes"]}
    wanted = set(result["hidden"])
    return bool(wanted and result["verdict"] == "named" and named == wanted | {DISCRETISATION})


def parameter_error(result: dict[str, Any]) -> float | None:
    """Returns the relative error of the parameters of a correctly named cause.

    It is the norm of the difference over the norm of the true parameters. Only the mass of
    `local_mass` and the rate of `gripper_slip` count. Only the group `effect` has parameters to
    compare.
    """
    if result["case"]["group"] != "effect" or not right(result):
        return None
    (name, true), found = next(iter(result["hidden"].items())), result["causes"][0]["values"]
    keys = ["mass"] if name == "local_mass" else ["rate"] if name == "gripper_slip" else list(true)
    a, b = np.array([true[k] for k in keys]), np.array([found[k] for k in keys])
    return float(np.linalg.norm(b - a) / np.linalg.norm(a))


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the tables of a study; the first result's noise and size are the reference."""
    if not results:
        return []
    centre = _setting(results[0])
    central = [r for r in results if _setting(r) == centre]
    every = [r for r in results if r["case"]["group"] == "effect"]
    effects = [r for r in every if _setting(r) == centre]
    header = ["right", "ambiguous", "parameter error, %", "gain", "loss before"]
    names = dict.fromkeys(r["case"]["hide"] for r in effects)
    each = [[name, *_summary([r for r in effects if r["case"]["hide"] == name])] for name in names]
    shared = _shared(every)
    beside = []
    for noise, size in sorted({_setting(r) for r in shared}):
        there = [r for r in shared if _setting(r) == (noise, size)]
        count, correct, *others = _summary(there)
        too = sum(map(right_but_for_numerics, there))
        beside.append([f"{1e3 * noise:g}", size, count, correct, too, *others])
    return [
        Table("Each effect", ["hidden", "draws", *header], each),
        Table("All", *_groups(central)),
        Table(
            "By noise and size, the same draws at each",
            ["noise, mm", "size", "draws", "right", "and discretisation", *header[1:]],
            beside,
        ),
        Table(
            "Confidence",
            ["said", "causes", "right, %"],
            [
                [f"{100 * low:.0f} to {100 * high:.0f} %", len(hits), 100.0 * float(np.mean(hits))]
                for low, high, hits in reliability(results)
                if hits
            ],
        ),
    ]


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns the share of each group that is right beside what is asked; at the study's centre."""
    found = []
    central = [r for r in results if _setting(r) == _setting(results[0])]
    for group, asked in ASKED.items():
        hits = [right(r) for r in central if r["case"]["group"] == group]
        if hits:
            found.append(at_least(f"{group}: right", 100.0 * float(np.mean(hits)), "%", asked))
    return found


def _shared(results: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns the results of the draws that exist at every noise and size."""
    settings = {_setting(r) for r in results}
    made: dict[tuple[str, int], set[tuple[float, float]]] = {}
    for r in results:
        made.setdefault(_draw(r), set()).add(_setting(r))
    return [r for r in results if made[_draw(r)] == settings]


def _draw(result: dict[str, Any]) -> tuple[str, int]:
    return result["case"]["hide"], result["case"]["seed"]


def _setting(result: dict[str, Any]) -> tuple[float, float]:
    return result["case"]["marker_noise"], result["case"]["size"]


def _summary(results: Sequence[dict[str, Any]]) -> list[Any]:
    """Returns numbers of draws, right and ambiguous ones, and medians of error, gain, loss."""
    return [
        len(results),
        sum(map(right, results)),
        sum(map(unsure, results)),
        _median_error(results),
        float(np.median([r["gain"][0] for r in results])),
        float(np.median([r["loss"]["refined"] for r in results])),
    ]


def _median_error(results: Sequence[dict[str, Any]]) -> float | None:
    """Returns the median relative error of the parameters, %."""
    return _median([100.0 * e for r in results if (e := parameter_error(r)) is not None])


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _groups(results: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[Any]]]:
    """Returns header and rows of required and reached rates of each group."""
    rows: list[list[Any]] = []
    for group, asked in ASKED.items():
        mine = [r for r in results if r["case"]["group"] == group]
        if not mine:
            continue
        gains = [r["gain"][0] for r in mine if r["hidden"]]
        # cases run in parallel have one process each, so their time is not representative
        times = [r["seconds"] for r in mine if r["workers"] > 1]
        rows.append(
            [
                group,
                len(mine),
                100.0 * float(np.mean([right(r) for r in mine])),
                asked,
                100.0 * float(np.mean([unsure(r) for r in mine])),
                _median_error(mine),
                _median(gains),
                _median(times),
            ]
        )
    header = ["group", "draws", "right, %", "asked, %", "ambiguous, %"]
    return [*header, "parameter error, %", "gain", "time, s"], rows


def unsure(result: dict[str, Any]) -> bool:
    """Returns whether the verdict is ambiguous but includes a right cause."""
    named = {c["effect"] for c in result["causes"]}
    return result["verdict"] == "ambiguous" and bool(named & set(result["hidden"]))


def reliability(results: Sequence[dict[str, Any]]) -> list[tuple[float, float, list[bool]]]:
    """Returns, for ranges of confidence, whether each cause in the range is right."""
    found = []
    for low, high in itertools.pairwise(_CONFIDENCES):
        hits = [
            _hidden_there(r, c["effect"])
            for r in results
            for c in r["causes"]
            if low <= c["confidence"] < high or (high == 1.0 and c["confidence"] == 1.0)
        ]
        found.append((low, high, hits))
    return found


def _hidden_there(result: dict[str, Any], name: str) -> bool:
    return name in result["hidden"] or (
        name == DISCRETISATION and result["case"]["group"] == "coarse"
    )


@plain_settings()
def reliability_plot(results: Sequence[dict[str, Any]]) -> str:
    """Returns an SVG of the share of right causes over the stated confidence."""
    figure, (ax,) = chart(4.5, 4.0)
    ax.plot([0.0, 1.0], [0.0, 1.0], color="#66727f", ls=":")
    for low, high, hits in reliability(results):
        if not hits:
            continue
        share, count = float(np.mean(hits)), len(hits)
        least, most = wilson(sum(hits), count)
        at = 0.5 * (low + high)
        ax.plot([at, at], [least, most], color="#0b7a5e")
        ax.plot(at, share, "o", color="#0b7a5e")
        ax.annotate(str(count), (at, share), (5, -10), textcoords="offset points", fontsize=8)
    ax.set_xlabel("confidence given")
    ax.set_ylabel("share that is right")
    return as_svg(figure).decode("utf-8")
