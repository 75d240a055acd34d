"""Tables of the hardware path: measured and required values."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, every
from benchmarks.hardware.faults import BELIEFS, FAULTS
from benchmarks.hardware.parts import Case


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the tables of the available results."""
    done = [(Case(**r["case"]), r["summary"]) for r in results if "summary" in r]
    of_part = {case.part: summary for case, summary in done}
    faults = [(case, summary) for case, summary in done if case.part == "faults"]
    commands = [summary for case, summary in done if case.part == "commands"]

    def rows(part: str, make: Callable[[dict[str, Any]], list[list[Any]]]) -> list[list[Any]]:
        return make(of_part[part]) if part in of_part else []

    return [
        Table(
            "Commands, coarse lab at full rate",
            ["", "asked", "median", "least", "most", "as asked"],
            _commands(commands),
        ),
        Table(
            "Dressing in two processes",
            ["", "run", "lab"],
            rows("dressing", _dressing),
        ),
        Table(
            "Memory of its own",
            ["", "minutes", "first, MB", "last, MB", "growth, MB/h", "a week at most, MB"],
            rows("soak", _memory),
        ),
        Table(
            "Faults",
            ["", "rate", "as stated", "held within, s", "longest, s", "speed", "torque"],
            _faults(faults, FAULTS),
        ),
        Table(
            "Messages that cannot be believed, or are out of order",
            ["", "rate", "as stated", "held within, s", "longest, s", "speed", "torque"],
            _faults(faults, BELIEFS),
        ),
        Table(
            "Not as stated",
            ["", "what"],
            [[case.name, "; ".join(s["wrong"])] for case, s in faults if s["wrong"]],
        ),
    ]


def tell(summary: dict[str, Any]) -> str:
    """Returns a short text on the result of one measurement."""
    if "wrong" in summary:
        how = "; ".join(summary["wrong"]) or "as stated"
        return f"{summary['source'] or 'run'} at {summary['start']:.2f} s: {how}"
    return "measured"


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns medians of commands, and how many faults were answered as stated."""
    done = [(Case(**r["case"]), r["summary"]) for r in results]
    found = []
    for what, unit, values, least, most in _asked([s for c, s in done if c.part == "commands"]):
        middle = float(np.median(values))
        found.append(Figure(what, middle, unit, most, least <= middle <= most))
    faults = [s for c, s in done if c.part == "faults"]
    if faults:
        right = sum(not s["wrong"] for s in faults)
        found.append(every("faults answered as stated", right, len(faults)))
    return found


def _asked(
    done: Sequence[dict[str, Any]],
) -> list[tuple[str, str, list[float], float, float]]:
    """Returns of each figure of commands: name, unit, values, least and most that are asked."""
    if not done:
        return []
    latency = [s["command_latency_ms"] for s in done]
    return [
        ("rate", "Hz", [s["command_rate_hz"] for s in done], 196.0, 204.0),
        ("status to command, median", "ms", [ms["median"] for ms in latency], 0.0, 10.0),
        ("status to command, 99 %", "ms", [ms["p99"] for ms in latency], 0.0, 25.0),
        ("start of the process to first command", "s", [s["start_up_s"] for s in done], 0.0, 10.0),
    ]


def _commands(done: Sequence[dict[str, Any]]) -> list[list[Any]]:
    """Returns what is asked, and of the measurements the middle, the ends, and how many meet it."""
    rows = []
    for what, unit, values, least, most in _asked(done):
        asked = f"≤ {most:g}" if least == 0.0 else "200 ± 2 %"
        met = sum(least <= v <= most for v in values)
        shown = (f"{v:.1f}" for v in (np.median(values), min(values), max(values)))
        rows.append([f"{what}, {unit}", asked, *shown, f"{met} of {len(values)}"])
    return rows


def _dressing(summary: dict[str, Any]) -> list[list[Any]]:
    run, lab = summary["run"], summary["lab"]
    latency = summary["command_latency_ms"]
    return [
        ["simulated seconds a second", summary["rate"], ""],
        ["exit status", run["status"], lab["status"]],
        ["reason", run["reason"] or "on", lab["reason"] or "on"],
        ["dressed in, s", run["dressing_time_s"], lab["dressing_time_s"]],
        ["largest gripper force, N", run["max_gripper_force_N"], lab["max_gripper_force_N"]],
        ["commands a second of this machine's clock", summary["command_rate_hz"], ""],
        ["commands a simulated second", summary["command_rate_hz"] / summary["rate"], ""],
        ["status to command, median, ms of this machine's clock", latency["median"], ""],
        ["status to command, 99 %, ms of this machine's clock", latency["p99"], ""],
        ["status to command, median, simulated ms", summary["rate"] * latency["median"], ""],
        ["status to command, 99 %, simulated ms", summary["rate"] * latency["p99"], ""],
        ["start of the process to first command, s", summary["start_up_s"], ""],
    ]


def _memory(summary: dict[str, Any]) -> list[list[Any]]:
    return [
        [
            name,
            summary["minutes"],
            *(summary[name][key] for key in ("first", "last", "per_hour", "week_at_most")),
        ]
        for name in ("run", "lab")
    ]


def _faults(done: Sequence[tuple[Case, dict[str, Any]]], kinds: Collection[str]) -> list[list[Any]]:
    rows = []
    for kind, rate in itertools.product(kinds, sorted({s["rate"] for _, s in done})):
        mine = [s for case, s in done if case.kind == kind and s["rate"] == rate]
        if not mine:
            continue
        within = mine[0]["within"]
        held = [s["held_after"] for s in mine if s["held_after"] is not None]
        rows.append(
            [
                kind,
                rate,
                f"{sum(not s['wrong'] for s in mine)} of {len(mine)}",
                within,
                None if within is None or not held else max(held),
                max(s["speed"] for s in mine),
                max(s["torque"] for s in mine),
            ]
        )
    return rows
