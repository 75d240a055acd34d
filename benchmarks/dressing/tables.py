"""How often, how fast and how gently: tables and figures of the dressing experiments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.dressing.cases import METHODS, SERIES_STEP
from benchmarks.statistics import wilson
from drake_dress.models.sides import SIDES
from drake_dress.report.page import chart, svg

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
    "real-time factor",
]


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns what each method came to, over all, and by person and coat; and why runs failed."""
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
    return [
        Table("Methods", ["", *_HEADER], by_method),
        Table("Persons and coats", ["", *_HEADER], by_group),
        Table("Why not", ["method", "reason", "runs"], reasons),
    ]


def figure(results: Sequence[dict[str, Any]]) -> str:
    """Returns an SVG: s, l and force of both sleeves over time, medians and quartiles."""
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
    return svg(drawing).decode("utf-8")


def _bands(series: Iterable[dict[str, Any]], name: str):  # type: ignore[no-untyped-def]
    """Returns times and quartiles over runs; a run that has ended stays as it ended."""
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

    penetration = [1e3 * s["max_penetration_m"] for s in summaries]
    return [
        len(summaries),
        dressed,
        f"{100 * low:.0f} to {100 * high:.0f}",
        median("dressing_time_s", [s for s in summaries if s["success"]]),
        float(np.median([r["force_p99"] for r in results])) if results else None,
        max((s["max_gripper_force_N"] for s in summaries), default=None),
        max(penetration, default=None),
        median("realtime_factor"),
    ]


def _reasons(results: Sequence[dict[str, Any]]) -> dict[str, int]:
    """Returns how often each reason came up, without its figures."""
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
