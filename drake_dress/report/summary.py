"""The verdict on a run, `summary.json`, computed from the log, not from the controller.

Progress s alone proves nothing: an armhole that slid up beside the arm gives s = 2, too. Therefore,
the linking number of the armhole loop and the arm's line must show that the arm is inside, and
force, penetration and strain must stay within their limits at every sample.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.file_output import write_text
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.control.safety import Verdict
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.finish import arms_hang
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.arms import ArmMeasures, measure_arms
from drake_dress.report.chair import gripper_to_chair
from drake_dress.report.log import RunLog
from drake_dress.report.measures import Measures, first_lasting, measure
from drake_dress.report.release import Release, ReleaseRules, judge_release
from drake_dress.report.sight import sight_figures


@dataclass(frozen=True)
class SuccessRules:
    """Success criteria of a dressing.

    Attributes:
        min_s: Least progress s of both sleeves when the coat is laid; 2 is the shoulder.
        min_hanging_s: The same of a sleeve whose arm hangs. An armhole that hangs on the shoulder
            of a lowered arm lies lower; from 1.65 on its upper edge is 2 cm and more beyond the
            joint.
        hanging_angle: Greatest angle of an upper arm to the vertical at which it hangs, rad.
        max_gripper_force: Limit of the gripper force at every sample, N.
        max_penetration: Limit of the garment's penetration into the person at every sample, m.
        max_edge_strain: Limit of the strain of 99 % of the edges at every sample.
        min_gripper_to_chair: Least distance of a gripper to the person's wheelchair at every
            sample, m.
        min_arm_distance: Least distance between the arms, and of the arms without their hands to
            the person and the wheelchair, at every sample, m. Joints must also stay within their
            limits of position, speed and torque.
        release: Criteria after the grippers have let go.
    """

    min_s: float = 1.9
    min_hanging_s: float = 1.65
    hanging_angle: float = 0.6
    max_gripper_force: float = 40.0
    max_penetration: float = 5e-3
    max_edge_strain: float = 0.10
    min_gripper_to_chair: float = 0.0
    min_arm_distance: float = 0.05
    release: ReleaseRules = ReleaseRules()

    def least_s(self, joints: FloatArray, lets_go: bool) -> FloatArray:
        """Returns (...,2) the least progress of left and right sleeve of a person.

        Args:
            joints: (...,6,3) shoulder, elbow, hand of left, then of right arm, m.
            lets_go: Whether the coat is let go in the end, which shows that hanging sleeves are on.
        """
        hang = arms_hang(joints, self.hanging_angle)
        return np.where(hang & lets_go, self.min_hanging_s, self.min_s)


def summarize(
    log: RunLog,
    *,
    wall_time: float,
    rules: SuccessRules | None = None,
    measures: Measures | None = None,
) -> dict[str, Any]:
    """Returns the content of `summary.json`; figures that do not exist are None.

    `s_asked_left`, `…_right` are the progress that is asked when the coat is laid.
    `armhole_to_shoulder_left_m`, `…_right_m` are the remaining distances along the arm at the end.
    Beyond the fixed keys: `linking_number_left`, `…_right` (final), `simulated_time_s`,
    `max_edge_strain_all`, `max_total_contact_force_N`. `max_edge_strain` is the 99th percentile
    over the edges of length / rest length - 1, at its worst sample; `max_edge_strain_all` is the
    strain of the worst edge at its worst sample. `max_contact_force_N` is the largest force at one
    node, `max_total_contact_force_N` the largest sum over the nodes. `dressing_time_s` is the first
    time from which both sleeves stay on (s and linking number) until the coat is laid, and
    `s_dressed_left`, `…_right` are the progress then; both are final if it is not laid. `stays_on`
    is whether both are still on 3 s after the grippers have let go, None if they have not.
    `collar_to_neck_m` is the final distance of the collar's back from the nape. `late_plans` is the
    share of the global controller's solves that took longer than the modelled delay.
    `layers_crossed_at_end` counts edges that pierce another layer. `safety_cut_s` gives, for each
    side and flag of the safety governor, the total time of samples with it; None if not logged.
    Hardware runs add `command_rate_hz`, `command_latency_ms` (from the sending of a status to the
    command that responds to it), `start_up_s` (to the first command), `fell_behind_s` (real time by
    which the run fell behind the requested rate) and `dropped_messages` (repeated and late messages
    by source). Runs with arms add `max_joint_speed_share`, `max_joint_torque_share` (of the
    limits), `min_joint_margin_rad`, `arm_tracking_mm` (gripper tracking error),
    `min_arms_apart_m`, `min_arm_to_person_m` (without last link and hand). Runs with a wheelchair
    add `min_gripper_to_chair_m` and, with arms, `min_arm_to_chair_m`; there `max_penetration_m`
    holds for person and chair. Runs whose controllers see with cameras add
    `estimate_garment_rms_m` and `estimate_armhole_median_m` (`sight_figures`).

    Args:
        log: Log of the run.
        wall_time: Wall time of the simulation, s.
        rules: Success criteria.
        measures: Measures of this log, if already known; computed otherwise.
    """
    rules = rules or SuccessRules()
    m = measures if measures is not None else measure(log)
    arms = measure_arms(log)
    release = judge_release(log, m, rules.release)
    to_chair = gripper_to_chair(log)
    reason = (
        _reason(log, m, release, rules)
        or _chair_reason(log, to_chair, rules)
        or _arm_reason(log, arms, rules)
    )
    summary: dict[str, Any] = {"success": reason is None, "reason": reason}
    summary |= _sleeve_figures(log, m, release.held, rules)
    summary |= {"stays_on": release.stays_on, "collar_to_neck_m": release.collar_to_neck}
    summary |= _course_figures(log, m, release.held, rules, wall_time)
    summary |= _solve_figures(log)
    summary["late_plans"] = _late_plans(log)
    summary["safety_cut_s"] = _safety_cuts(log)
    summary |= _command_figures(log) | _arm_figures(arms) | sight_figures(log)
    if to_chair is not None:
        summary["min_gripper_to_chair_m"] = _least(to_chair)
    return summary | {"seed": log.seed, "version": log.version}


def write_summary(summary: dict[str, Any], path: str | Path) -> None:
    """Writes a summary as strict JSON (without NaN)."""
    write_text(Path(path), json.dumps(summary, indent=2, allow_nan=False) + "\n")


def read_summary(path: str | Path) -> dict[str, Any]:
    """Reads the summary of a run.

    Raises:
        UserError: The file is missing or cannot be used.
    """
    try:
        summary = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(str(path), "", "cannot be read; expected a run's summary.json") from error
    except ValueError as error:
        raise UserError(str(path), "", f"is not JSON: {error}") from error
    if not isinstance(summary, dict):
        raise UserError(str(path), "", f"holds a {type(summary).__name__}; expected an object")
    return summary


def _reason(log: RunLog, m: Measures, release: Release, rules: SuccessRules) -> str | None:
    """Returns a sentence on the first broken rule, with its figure; None if there is none."""
    if log.ended_by is not None:
        return log.ended_by
    if not len(log):
        return "nothing was logged"
    if not m.finite.all():
        t = log.time[np.argmin(m.finite)]
        return f"simulation diverged: positions or forces not finite at t = {t:.2f} s"
    broken = (
        _sleeve_that_is_off(log, m, release.held, rules)
        or _not_let_go(log, release, rules)
        or _too_large_force(log, m, rules)
    )
    # penetration and strain of an estimate reflect errors of the estimate, so do not judge them
    return broken if broken or log.estimated else _damage(log, m, rules)


def _sleeve_that_is_off(log: RunLog, m: Measures, held: int, rules: SuccessRules) -> str | None:
    """Returns a sentence on a sleeve that is off when the coat is laid, after `held` samples."""
    last = max(held, 1) - 1
    for side, least in zip(
        SIDES, rules.least_s(log.joint_position[last], log.lets_go), strict=True
    ):
        s = log.dressing[side][last, 0]
        if not s >= least:
            far = _to_shoulder(log, side, last)
            short = "" if far is None else f", armhole {100.0 * far:.1f} cm from the shoulder"
            return f"{side} sleeve not on: s = {s:.2f} < {least:g}{short}"
    for k, side in enumerate(SIDES):
        linking = int(m.linking[last, k])
        if abs(linking) != 1:
            return f"{side} arm outside the sleeve: linking number {linking}"
    return None


def _not_let_go(log: RunLog, release: Release, rules: SuccessRules) -> str | None:
    """Returns a sentence on a coat that was not let go, or does not stay on; None if it does."""
    if not log.lets_go:
        return None
    collar, most = release.collar_to_neck, rules.release.max_collar_to_neck
    off = "" if collar is None else f"collar {100.0 * collar:.1f} cm from the neck"
    if release.opened is None:
        return "the coat was not let go" + (f": {off}" if off else "")
    if release.reason is not None:
        return release.reason
    if collar is not None and collar > most:
        return f"{off}, expected at most {100.0 * most:g} cm"
    return None


def _too_large_force(log: RunLog, m: Measures, rules: SuccessRules) -> str | None:
    for k, side in enumerate(SIDES):
        i = int(np.argmax(np.nan_to_num(m.gripper_force[:, k])))
        force = m.gripper_force[i, k]
        if force > rules.max_gripper_force:
            limit = f"{force:.1f} N > {rules.max_gripper_force:g} N"
            return f"{side} gripper force too high: {limit} at t = {log.time[i]:.2f} s"
    return None


def _damage(log: RunLog, m: Measures, rules: SuccessRules) -> str | None:
    """Returns a sentence on excessive penetration or strain; None if there is none."""
    i = int(np.argmax(m.penetration))
    if m.penetration[i] > rules.max_penetration:
        limit = f"{1e3 * m.penetration[i]:.1f} mm > {1e3 * rules.max_penetration:g} mm"
        return f"garment penetrates the person: {limit} at t = {log.time[i]:.2f} s"
    i = int(np.argmax(m.edge_strain))
    if m.edge_strain[i] > rules.max_edge_strain:
        limit = f"{100 * m.edge_strain[i]:.1f} % > {100 * rules.max_edge_strain:g} %"
        return f"edges over-strained: 99th percentile {limit} at t = {log.time[i]:.2f} s"
    return None


def _sleeve_figures(log: RunLog, m: Measures, held: int, rules: SuccessRules) -> dict[str, Any]:
    """Returns the progress of each sleeve: final, and when the coat began to be laid."""
    figures: dict[str, Any] = {}
    last = max(held, 1) - 1
    least = rules.least_s(log.joint_position[last], log.lets_go) if len(log) else None
    for k, side in enumerate(SIDES):
        figures[f"s_{side}"] = _number(log.dressing[side][-1, 0]) if len(log) else None
        dressed = _number(log.dressing[side][last, 0]) if len(log) else None
        figures[f"s_dressed_{side}"] = dressed
        figures[f"s_asked_{side}"] = None if least is None else float(least[k])
        figures[f"armhole_to_shoulder_{side}_m"] = _to_shoulder(log, side)
    for k, side in enumerate(SIDES):
        figures[f"arm_inside_{side}"] = bool(len(log)) and abs(int(m.linking[-1, k])) == 1
        figures[f"linking_number_{side}"] = int(m.linking[-1, k]) if len(log) else None
    for k, side in enumerate(SIDES):
        through = bool(len(log)) and abs(int(m.cuff_linking[-1, k])) == 1
        figures[f"hand_through_cuff_{side}"] = through
    return figures


def _course_figures(
    log: RunLog, m: Measures, held: int, rules: SuccessRules, wall_time: float
) -> dict[str, Any]:
    """Returns times and the largest forces, strains and penetrations of the run."""
    s = np.stack([log.dressing[side][:, 0] for side in SIDES], axis=1)
    on = (s >= rules.least_s(log.joint_position, log.lets_go)) & (np.abs(m.linking) == 1)
    dressed = first_lasting(on.all(axis=1)[:held])
    duration = _duration(log)
    return {
        "dressing_time_s": None if dressed is None else float(log.time[dressed]),
        "simulated_time_s": duration,
        "max_gripper_force_N": _largest(m.gripper_force),
        "max_contact_force_N": _largest(m.node_contact_force),
        "max_total_contact_force_N": _largest(m.total_contact_force),
        "max_edge_strain": _largest(m.edge_strain),
        "max_edge_strain_all": _largest(m.edge_strain_max),
        "max_penetration_m": _largest(m.penetration),
        "layers_crossed_at_end": _layers_crossed(log),
        "realtime_factor": duration / wall_time if wall_time > 0.0 else None,
        "wall_time_s": float(wall_time),
    }


def _solve_figures(log: RunLog) -> dict[str, Any]:
    """Returns rate and solve times of both controllers."""
    figures: dict[str, Any] = {}
    duration = _duration(log)
    for name in ("global", "local"):
        solve = log.solve_time(name)
        solve = solve[np.isfinite(solve)]
        figures[f"{name}_rate_hz"] = (
            float(log.solves(name).sum()) / duration if duration > 0.0 else None
        )
        figures[f"{name}_solve_ms"] = {
            "median": 1e3 * float(np.median(solve)) if len(solve) else None,
            "p95": 1e3 * float(np.quantile(solve, 0.95)) if len(solve) else None,
            "p99": 1e3 * float(np.quantile(solve, 0.99)) if len(solve) else None,
        }
    return figures


def _duration(log: RunLog) -> float:
    """Returns the simulated time of a log, s."""
    return float(log.time[-1] - log.time[0]) if len(log) else 0.0


def _to_shoulder(log: RunLog, side: Side, sample: int = -1) -> float | None:
    """Returns the distance of the armhole from the shoulder along the arm at a sample, m."""
    if not len(log):
        return None
    s = log.dressing[side][sample, 0]
    k = 3 * SIDES.index(side)
    shoulder, elbow, hand = log.joint_position[sample][k : k + 3]
    if not (np.isfinite(s) and np.isfinite([shoulder, elbow, hand]).all()):
        return None
    return ArmAxis(hand, elbow, shoulder).to_shoulder(float(s))


def _layers_crossed(log: RunLog) -> int | None:
    """Returns the number of edges that pierce another layer of the garment at the end of a run.

    Nodes connected to a triangle by an edge belong to the same layer. None if positions are not
    finite or not logged.
    """
    x = log.garment_position(-1) if len(log) else None
    if x is None or not np.isfinite(x).all():
        return None
    elements = make_elements(log.rest_position, log.faces)
    return len(np.unique(piercing_edges(x, elements, rings=1)[:, 0]))


def _late_plans(log: RunLog) -> float | None:
    """Returns the share of global solves that took longer than the modelled delay."""
    solve = log.solve_time("global")
    solve = solve[np.isfinite(solve)]
    if log.plan_delay is None or not len(solve):
        return None
    return float(np.mean(solve > log.plan_delay))


def _safety_cuts(log: RunLog) -> dict[str, dict[str, float]] | None:
    if log.safety is None:
        return None
    since_last = np.diff(log.time, prepend=log.time[:1])
    cuts: dict[str, dict[str, float]] = {}
    for k, side in enumerate(SIDES):
        time = {v: float(since_last[(log.safety[:, k] & v.value) != 0].sum()) for v in Verdict}
        cuts[side] = {str(v.name).lower(): t for v, t in time.items() if t > 0.0}
    return cuts


def _chair_reason(log: RunLog, to_chair: FloatArray | None, rules: SuccessRules) -> str | None:
    """Returns a sentence on a gripper that was inside the wheelchair; None if none was."""
    if to_chair is None:
        return None
    for k, side in enumerate(SIDES):
        distance = np.where(np.isfinite(to_chair[:, k]), to_chair[:, k], np.inf)
        i = int(np.argmin(distance)) if len(distance) else 0
        if len(distance) and distance[i] < rules.min_gripper_to_chair:
            deep = 100.0 * (rules.min_gripper_to_chair - distance[i])
            return f"{side} gripper inside the wheelchair: {deep:.1f} cm at t = {log.time[i]:.2f} s"
    return None


def _arm_reason(log: RunLog, arms: ArmMeasures | None, rules: SuccessRules) -> str | None:
    """Returns a sentence on the first rule that the arms broke; None if there is none."""
    if arms is None or not len(log):
        return None
    if not arms.kept.all():
        t = log.time[int(np.argmin(arms.kept))]
        return f"an arm's joint was beyond its limits at t = {t:.2f} s"
    for name, distance in (
        ("arms", arms.apart),
        ("left arm and person", arms.to_person[:, 0]),
        ("right arm and person", arms.to_person[:, 1]),
        ("left arm and wheelchair", arms.to_chair[:, 0]),
        ("right arm and wheelchair", arms.to_chair[:, 1]),
    ):
        i = int(np.argmin(np.where(np.isfinite(distance), distance, np.inf)))
        if distance[i] < rules.min_arm_distance:
            limit = f"{100 * distance[i]:.1f} cm < {100 * rules.min_arm_distance:g} cm"
            return f"{name} too near: {limit} at t = {log.time[i]:.2f} s"
    return None


def _arm_figures(arms: ArmMeasures | None) -> dict[str, Any]:
    if arms is None or not len(arms.apart):
        return {}
    figures: dict[str, Any] = {
        "max_joint_speed_share": _largest(arms.speed_share),
        "max_joint_torque_share": _largest(arms.torque_share),
        "min_joint_margin_rad": _number(float(arms.margin.min())),
        "arm_tracking_mm": {
            "median": 1e3 * float(np.median(arms.off)),
            "p99": 1e3 * float(np.quantile(arms.off, 0.99)),
        },
        "min_arms_apart_m": _number(float(arms.apart.min())),
        "min_arm_to_person_m": _number(float(arms.to_person.min())),
    }
    if np.isfinite(arms.to_chair).any():
        figures["min_arm_to_chair_m"] = _least(arms.to_chair)
    return figures


def _command_figures(log: RunLog) -> dict[str, Any]:
    """Returns rate, latency and start-up time of commands to hardware; empty for a simulation."""
    if log.commands is None or len(log.commands[0]) < 2:
        return {}
    times, ages = log.commands
    ages = ages[np.isfinite(ages)]
    return {
        "command_rate_hz": float((len(times) - 1) / (times[-1] - times[0])),
        "command_latency_ms": {
            "median": 1e3 * float(np.median(ages)) if len(ages) else None,
            "p99": 1e3 * float(np.quantile(ages, 0.99)) if len(ages) else None,
        },
        "start_up_s": log.start_up,
        "fell_behind_s": log.behind,
        "dropped_messages": log.dropped_messages,
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _least(values: FloatArray) -> float | None:
    values = values[np.isfinite(values)]
    return float(values.min()) if values.size else None


def _largest(values: FloatArray) -> float | None:
    values = values[np.isfinite(values)]
    return float(values.max()) if values.size else None
