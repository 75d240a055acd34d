"""Tables and figures of the dressing experiments: success, time and forces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.dressing.cases import METHODS, SERIES_STEP
from benchmarks.figures import Figure, at_most
from benchmarks.statistics import wilson
from drake_dress.drawing import as_svg, plain_settings
from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES
from drake_dress.report.page import chart
from drake_dress.report.summary import SuccessRules

_COLOURS = {"full": "#0b7a5e", "global": "#2a5db0", "local": "#b0562a"}
_WHAT = (("s", "s"), ("l", "l, m"), ("force", "gripper force, N"))
_HEADER = [
    "runs",
    "dressed",
    "90 % interval, %",
    "time to dress, s",
    "force 99 %, N",
    "largest force, N",
    "penetration, mm",
    "both arms inside, s < 1.9",
    "runs with layers crossed at the end",
    "real-time factor",
]
_BESIDE = ["pairs", "both dressed", "only full", "only this", "neither", "longer by, s"]
_STAGES = [
    "first hand in, runs",
    "time, s",
    "second hand in, runs",
    "further time, s",
    "dressed, runs",
    "further time, s",
    "hand lost again, runs",
]
MIN_S = SuccessRules().min_s
# A hand counts as in once it stays in for this long, s.
_LASTING = 2.0


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the results of each method, in total and by person and coat, and failure reasons."""
    done = [r for r in results if "summary" in r]
    methods = [m for m in METHODS if any(r["case"]["method"] == m for r in done)]
    by_method = [[m, *_row(_of(done, method=m))] for m in methods]
    by_group = [
        [f"{m}, {person}, {coat}", *_row(_of(done, method=m, person=person, coat=coat))]
        for m in methods
        for person in _values(done, "person")
        for coat in _values(done, "coat")
    ]
    reasons = [
        [m, reason, count]
        for m in methods
        for reason, count in _reasons(_of(done, method=m)).items()
    ]
    stages = [[m, *_stages(_of(done, method=m))] for m in methods]
    beside = [[m, *_beside(done, m)] for m in methods if m != "full" and "full" in methods]
    return [
        Table("Methods", ["", *_HEADER], by_method),
        Table("Compared with full: the same persons, coats and seeds", ["", *_BESIDE], beside),
        Table("Stages reached", ["", *_STAGES], stages),
        Table("Persons and coats", ["", *_HEADER], by_group),
        Table("Reasons of failure", ["method", "reason", "runs"], reasons),
    ]


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns the figures of each method beside what is asked."""
    found = []
    for method in METHODS:
        mine = [r["summary"] for r in _of(results, method=method)]
        if not mine:
            continue
        count = len(mine)
        dressed = sum(bool(s["success"]) for s in mine)
        low, high = wilson(dressed, count)
        short = 100.0 * sum(map(_short_of_the_shoulder, mine)) / count
        layers = [s["layers_crossed_at_end"] for s in mine if _tells_layers(s)]
        crossed = sum(count > 0 for count in layers)
        found += [
            Figure(f"{method}: runs dressed", dressed, f"of {count}"),
            Figure(f"{method}: dressed, lower end of the 90 % interval", 100.0 * low, "%"),
            Figure(f"{method}: dressed, upper end of the 90 % interval", 100.0 * high, "%"),
            at_most(f"{method}: both arms inside, a sleeve below s = {MIN_S:g}", short, "%", 1.0),
        ]
        if layers:
            name = f"{method}: runs with layers crossed at the end"
            found.append(at_most(name, crossed, f"of {len(layers)}", 0))
    return found


@plain_settings()
def figure(results: Sequence[dict[str, Any]]) -> str:
    """Returns an SVG of s, l and force of both sleeves over time: medians and quartiles."""
    done = [r for r in results if "summary" in r]
    drawing, axes = chart(9.0, 7.0, rows=len(_WHAT) * len(SIDES))
    for row, ((name, label), side) in enumerate((w, s) for w in _WHAT for s in SIDES):
        ax = axes[row]
        for method in METHODS:
            mine = _of(done, method=method)
            if not mine:
                continue
            time, low, middle, high = _bands([r["series"] for r in mine], f"{name}_{side}")
            ax.fill_between(time, low, high, color=_COLOURS[method], alpha=0.15, lw=0)
            ax.plot(time, middle, color=_COLOURS[method], label=method, lw=1.2)
        ax.set_ylabel(f"{side}\n{label}", fontsize=8)
    axes[0].legend(fontsize=8, ncols=3, frameon=False)
    axes[-1].set_xlabel("s")
    return as_svg(drawing).decode("utf-8")


def _bands(
    series: Iterable[dict[str, Any]], name: str
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Returns times and quartiles over runs; a finished run keeps its last value."""
    rows = [np.array(s[name], dtype=float) for s in series]
    longest = max(map(len, rows))
    padded = np.stack([np.concatenate([r, np.full(longest - len(r), r[-1])]) for r in rows])
    return SERIES_STEP * np.arange(longest), *np.nanquantile(padded, [0.25, 0.5, 0.75], axis=0)


def _row(results: Sequence[dict[str, Any]]) -> list[Any]:
    summaries = [r["summary"] for r in results]
    dressed = sum(s["success"] for s in summaries)
    low, high = wilson(dressed, len(summaries))

    def median(key: str, among: Sequence[dict[str, Any]] = summaries) -> float | None:
        values = [s[key] for s in among if s[key] is not None]
        return float(np.median(values)) if values else None

    # summaries of earlier versions lack this key
    layers = [s for s in summaries if _tells_layers(s)]
    penetration = [1e3 * s["max_penetration_m"] for s in summaries]
    return [
        len(summaries),
        dressed,
        f"{100 * low:.0f} to {100 * high:.0f}",
        median("dressing_time_s", [s for s in summaries if s["success"]]),
        float(np.median([r["force_p99"] for r in results])) if results else None,
        max((s["max_gripper_force_N"] for s in summaries), default=None),
        max(penetration, default=None),
        sum(map(_short_of_the_shoulder, summaries)),
        sum(s["layers_crossed_at_end"] > 0 for s in layers) if layers else None,
        median("realtime_factor"),
    ]


def _tells_layers(summary: dict[str, Any]) -> bool:
    return summary.get("layers_crossed_at_end") is not None


def _short_of_the_shoulder(summary: dict[str, Any]) -> bool:
    inside = all(summary[f"arm_inside_{side}"] for side in SIDES)
    return inside and not all((summary[f"s_{side}"] or 0.0) >= MIN_S for side in SIDES)


def _beside(done: Sequence[dict[str, Any]], method: str) -> list[Any]:
    """Compares full with another method over pairs of runs that are otherwise equal.

    The time is the median of how much longer the other method took if both dressed.
    """

    def by_rest(which: str) -> dict[tuple[Any, ...], dict[str, Any]]:
        mine = _of(done, method=which)
        return {tuple(r["case"][k] for k in ("person", "coat", "seed")): r["summary"] for r in mine}

    full, other = by_rest("full"), by_rest(method)
    pairs = [(full[key], other[key]) for key in full if key in other]
    ended = [(bool(a["success"]), bool(b["success"])) for a, b in pairs]
    longer = [
        b["dressing_time_s"] - a["dressing_time_s"]
        for a, b in pairs
        if a["success"] and b["success"]
    ]
    counts = [ended.count(how) for how in ((True, True), (True, False), (False, True))]
    rest = len(ended) - sum(counts)
    return [len(pairs), *counts, rest, float(np.median(longer)) if longer else None]


def _stages(results: Sequence[dict[str, Any]]) -> list[Any]:
    """Returns counts and times of runs with one hand in, both hands in, and both sleeves on.

    Times are medians over the runs that reached that stage. The last number counts the runs in
    which a hand slipped out again.
    """
    first, second, last, lost = [], [], [], 0
    for r in results:
        series, summary = r["series"], r["summary"]
        inside = [np.array(series[f"s_{side}"], dtype=float) > 0.0 for side in SIDES]
        came = [(_first_lasting(row), bool(row[-1])) for row in inside]
        begun = sorted(time for time, _ in came if time is not None)
        lost += any(time is not None and not stays for time, stays in came)
        if begun:
            first.append(begun[0])
        if len(begun) == len(SIDES):
            second.append(begun[1] - begun[0])
            if summary["success"]:
                last.append(summary["dressing_time_s"] - begun[1])
    cells: list[Any] = []
    for times in (first, second, last):
        cells += [len(times), float(np.median(times)) if times else None]
    return [*cells, lost]


def _first_lasting(inside: np.ndarray) -> float | None:
    """Returns when a hand came in and stayed in for `_LASTING`, s; None if it never did."""
    count = round(_LASTING / SERIES_STEP)
    for k in np.flatnonzero(inside):
        if inside[k : k + count].all():
            return float(k * SERIES_STEP)
    return None


def _reasons(results: Sequence[dict[str, Any]]) -> dict[str, int]:
    """Returns the number of runs per failure reason, without figures."""
    found: dict[str, int] = {}
    for r in results:
        reason = r["summary"]["reason"]
        if reason is not None:
            what = reason.split(":")[0]
            found[what] = found.get(what, 0) + 1
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _of(results: Sequence[dict[str, Any]], **wanted: str) -> list[dict[str, Any]]:
    return [r for r in results if all(r["case"][k] == v for k, v in wanted.items())]


def _values(results: Sequence[dict[str, Any]], key: str) -> list[str]:
    return list(dict.fromkeys(r["case"][key] for r in results))
