"""The verdict on a run, `summary.json`: computed from what the log holds, not from the controller.

Progress s alone proves nothing: an armhole that slid up beside the arm reads s = 2 too. So the arm
must be inside by the linking number of the armhole's nodes with the arm's line, and force,
penetration and strain must have stayed within their limits at every sample.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.models.control.safety import Verdict
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog
from drake_dress.report.measures import Measures, first_lasting, measure


@dataclass(frozen=True)
class SuccessRules:
    """What a dressing must reach to count.

    Attributes:
        min_s: of both sleeves at the end; 2 is the shoulder.
        max_gripper_force: at every sample, N.
        max_penetration: of garment into person at every sample, m.
        max_edge_strain: of 99 % of the edges at every sample.
    """

    min_s: float = 1.9
    max_gripper_force: float = 40.0
    max_penetration: float = 5e-3
    max_edge_strain: float = 0.10


def summarize(
    log: RunLog,
    *,
    wall_time: float,
    rules: SuccessRules | None = None,
    measures: Measures | None = None,
) -> dict[str, Any]:
    """Returns what `summary.json` holds; figures that do not exist are None.

    Beyond the fixed keys: `linking_number_left`, `…_right` (final), `simulated_time_s`,
    `max_edge_strain_all`, `max_total_contact_force_N`. `max_edge_strain` is the 99th percentile
    over the edges of |length / rest length - 1|, at its worst sample; `max_edge_strain_all` the
    worst edge at its worst sample. `max_contact_force_N` is the largest at one node,
    `max_total_contact_force_N` the largest sum over the nodes. `dressing_time_s` is the first
    time from which both sleeves stay on (s and linking number). `safety_cut_s` is, for each side
    and each flag of the safety governor that came up, the time of the samples that have it; None
    where not logged.

    Args:
        log: of the run.
        wall_time: what the simulation took, s.
        rules: of success.
        measures: of this log where they are known already; computed otherwise.
    """
    rules = rules or SuccessRules()
    m = measures if measures is not None else measure(log)
    reason = _reason(log, m, rules)
    s = np.stack([log.dressing[side][:, 0] for side in SIDES], axis=1)
    on = (s >= rules.min_s) & (np.abs(m.linking) == 1)
    dressed = first_lasting(on.all(axis=1))
    duration = float(log.time[-1] - log.time[0]) if len(log) else 0.0
    summary: dict[str, Any] = {"success": reason is None, "reason": reason}
    for k, side in enumerate(SIDES):
        summary[f"s_{side}"] = _number(s[-1, k]) if len(log) else None
    for k, side in enumerate(SIDES):
        summary[f"arm_inside_{side}"] = bool(len(log)) and abs(int(m.linking[-1, k])) == 1
        summary[f"linking_number_{side}"] = int(m.linking[-1, k]) if len(log) else None
    for k, side in enumerate(SIDES):
        summary[f"hand_through_cuff_{side}"] = (
            bool(len(log)) and abs(int(m.cuff_linking[-1, k])) == 1
        )
    summary |= {
        "dressing_time_s": None if dressed is None else float(log.time[dressed]),
        "simulated_time_s": duration,
        "max_gripper_force_N": _largest(m.gripper_force),
        "max_contact_force_N": _largest(m.node_contact_force),
        "max_total_contact_force_N": _largest(m.total_contact_force),
        "max_edge_strain": _largest(m.edge_strain),
        "max_edge_strain_all": _largest(m.edge_strain_max),
        "max_penetration_m": _largest(m.penetration),
        "realtime_factor": duration / wall_time if wall_time > 0.0 else None,
        "wall_time_s": float(wall_time),
    }
    for name in ("global", "local"):
        solve = log.solve_time(name)
        solve = solve[np.isfinite(solve)]
        summary[f"{name}_rate_hz"] = len(solve) / duration if duration > 0.0 else None
        summary[f"{name}_solve_ms"] = {
            "median": 1e3 * float(np.median(solve)) if len(solve) else None,
            "p99": 1e3 * float(np.quantile(solve, 0.99)) if len(solve) else None,
        }
    summary["safety_cut_s"] = _safety_cuts(log)
    return summary | {"seed": log.seed, "version": log.version}


def write_summary(summary: dict[str, Any], path: str | Path) -> None:
    """Writes a summary as strict JSON (no NaN in it)."""
    Path(path).write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _reason(log: RunLog, m: Measures, rules: SuccessRules) -> str | None:
    """Returns the first rule that was broken, in words with the figure; None if none was."""
    if not len(log):
        return "nothing was logged"
    if not m.finite.all():
        t = log.time[np.argmin(m.finite)]
        return f"simulation diverged: positions or forces not finite at t = {t:.2f} s"
    for side in SIDES:
        s = log.dressing[side][-1, 0]
        if not s >= rules.min_s:
            return f"{side} sleeve not on: s = {s:.2f} < {rules.min_s:g}"
    for k, side in enumerate(SIDES):
        linking = int(m.linking[-1, k])
        if abs(linking) != 1:
            return f"{side} arm outside the sleeve: linking number {linking}"
    for k, side in enumerate(SIDES):
        i = int(np.argmax(m.gripper_force[:, k]))
        force = m.gripper_force[i, k]
        if force > rules.max_gripper_force:
            limit = f"{force:.1f} N > {rules.max_gripper_force:g} N"
            return f"{side} gripper force too high: {limit} at t = {log.time[i]:.2f} s"
    i = int(np.argmax(m.penetration))
    if m.penetration[i] > rules.max_penetration:
        limit = f"{1e3 * m.penetration[i]:.1f} mm > {1e3 * rules.max_penetration:g} mm"
        return f"garment penetrates the person: {limit} at t = {log.time[i]:.2f} s"
    i = int(np.argmax(m.edge_strain))
    if m.edge_strain[i] > rules.max_edge_strain:
        limit = f"{100 * m.edge_strain[i]:.1f} % > {100 * rules.max_edge_strain:g} %"
        return f"edges over-strained: 99th percentile {limit} at t = {log.time[i]:.2f} s"
    return None


def _safety_cuts(log: RunLog) -> dict[str, dict[str, float]] | None:
    if log.safety is None:
        return None
    since_last = np.diff(log.time, prepend=log.time[:1])
    cuts: dict[str, dict[str, float]] = {}
    for k, side in enumerate(SIDES):
        time = {v: float(since_last[(log.safety[:, k] & v.value) != 0].sum()) for v in Verdict}
        cuts[side] = {str(v.name).lower(): t for v, t in time.items() if t > 0.0}
    return cuts


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _largest(values: npt.NDArray[np.float64]) -> float | None:
    values = values[np.isfinite(values)]
    return float(values.max()) if values.size else None
