"""Self-contained report of a run, `report.html`: verdict, limits, pictures and charts."""

from __future__ import annotations

import base64
import html
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drake_dress.drawing import as_png, plain_settings
from drake_dress.file_output import write_text
from drake_dress.models.sides import SIDES
from drake_dress.report.arms import arm_poses
from drake_dress.report.course import course_parts
from drake_dress.report.log import RunLog
from drake_dress.report.measures import Measures, measure
from drake_dress.report.page import html_page
from drake_dress.report.person_skin import LoggedSkin, logged_skin
from drake_dress.report.stills import CameraPose, Limbs, Seated, Surface, render_still
from drake_dress.report.summary import SuccessRules, read_summary

_STILL_SIZE = (560, 440)


def write_report(
    run_dir: str | Path, *, rules: SuccessRules | None = None, measures: Measures | None = None
) -> Path:
    """Writes `report.html` from `run.h5` and `summary.json` beside it; returns its path.

    Args:
        run_dir: Directory with both files.
        rules: Limits to compare with.
        measures: Measures of this log, if already known; computed otherwise.

    Raises:
        UserError: One of the two files is missing or cannot be used.
    """
    run_dir = Path(run_dir)
    summary = read_summary(run_dir / "summary.json")
    with RunLog.open(run_dir / "run.h5") as log:
        m = measures if measures is not None else measure(log)
        page = _page(log, summary, m, rules or SuccessRules())
    path = run_dir / "report.html"
    write_text(path, page)
    return path


@plain_settings()
def _page(log: RunLog, summary: dict[str, Any], m: Measures, rules: SuccessRules) -> str:
    success = bool(summary.get("success"))
    verdict = "Both sleeves are on" if success else "The dressing failed"
    if success and summary.get("stays_on"):
        verdict = "Both sleeves are on, and stay on"
    detail = (
        f"after {_figure(summary.get('dressing_time_s'), '{:.1f} s')} of simulated time"
        if success
        else str(summary.get("reason"))
    )
    parts = [
        f'<header class="{"good" if success else "bad"}"><h1>{verdict}</h1>'
        f"<p>{html.escape(detail)}</p></header>",
        "<h2>Limits</h2>",
        _limits(summary, rules, log.estimated),
        _safety(summary),
        "<h2>Pace</h2>",
        _pace(summary),
    ]
    if log.estimated:
        parts.insert(
            parts.index("<h2>Pace</h2>"),
            '<p class="note">Garment and person are estimates, so penetration and strain are '
            "not judged.</p>",
        )
    if log.events:
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in log.events)
        parts += [f"<details><summary>events at the station</summary><ul>{lines}</ul></details>"]
    if len(log):
        parts += ["<h2>Pictures</h2>", _pictures(log, m), "<h2>Course</h2>"]
        parts += course_parts(log, m, rules)
    parts += [
        "<h2>Scenario</h2>",
        f"<p>drake_dress {html.escape(log.version)}, seed {log.seed}</p>",
        f"<details><summary>resolved YAML</summary><pre>{html.escape(log.scenario_text)}</pre>"
        "</details>",
    ]
    return html_page("Dressing report", parts)


class _Row(NamedTuple):
    """A row of the table of limits; `met` is None if there is no limit or no value."""

    name: str
    asked: str
    reached: str
    met: bool | None


def _limits(summary: dict[str, Any], rules: SuccessRules, estimated: bool) -> str:
    rows = _sleeve_rows(summary, rules)
    most = rules.max_gripper_force
    rows.append(
        _at_most(summary, "gripper force, largest", "max_gripper_force_N", most, "{:.1f} N")
    )
    if not estimated:
        rows += _garment_rows(summary, rules)
    if "min_arms_apart_m" in summary:
        rows += _arm_rows(summary, rules)
    mark = {
        True: '<td class="yes">met</td>',
        False: '<td class="no">broken</td>',
        None: "<td></td>",
    }
    body = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{asked}</td><td>{reached}</td>{mark[met]}</tr>"
        for name, asked, reached, met in rows
    )
    return (
        "<table><thead><tr><th></th><th>limit</th><th>measured</th><th></th></tr></thead>"
        f"<tbody>{body}</tbody></table>"
    )


def _at_most(
    summary: dict[str, Any], name: str, key: str, limit: float, text: str, scale: float = 1.0
) -> _Row:
    """Returns the row of a figure that must not exceed a limit.

    Args:
        summary: Summary of the run.
        name: Displayed name of the figure.
        key: Key of the figure in the summary.
        limit: Limit in the summary's unit.
        text: Format of figure and limit, with the displayed unit.
        scale: Factor from the summary's unit to the displayed one.
    """
    value = summary.get(key)
    met = None if value is None else bool(value <= limit)
    return _Row(name, "≤ " + text.format(scale * limit), _figure(value, text, scale), met)


def _sleeve_rows(summary: dict[str, Any], rules: SuccessRules) -> list[_Row]:
    """Returns the progress of each sleeve, and whether the arm and hand are through it."""
    rows = []
    for side in SIDES:
        s = summary.get(f"s_dressed_{side}")
        asked = summary.get(f"s_asked_{side}") or rules.min_s
        met = s is not None and s >= asked
        rows.append(_Row(f"progress s, {side}", f"≥ {asked:g}", _figure(s, "{:.2f}"), met))
    if summary.get("stays_on") is not None:
        rows += _release_rows(summary, rules)
    for side in SIDES:
        far = _figure(summary.get(f"armhole_to_shoulder_{side}_m"), "{:.1f} cm", 100.0)
        rows.append(_Row(f"{side} armhole to shoulder, along the arm", "", far, None))
    for side in SIDES:
        inside = bool(summary.get(f"arm_inside_{side}"))
        number = summary.get(f"linking_number_{side}")
        shown = f"{number:+d}" if number else ("±1" if inside else "0")
        rows.append(_Row(f"linking number of {side} armhole and arm", "±1", shown, inside))
    for side in SIDES:
        through = bool(summary.get(f"hand_through_cuff_{side}"))
        rows.append(_Row(f"{side} hand through the cuff", "", "yes" if through else "no", None))
    return rows


def _release_rows(summary: dict[str, Any], rules: SuccessRules) -> list[_Row]:
    """Returns whether the coat stays on once the grippers have let go."""
    rows, after = [], rules.release
    for side in SIDES:
        s = summary.get(f"s_{side}")
        met = s is not None and s >= after.min_s
        name = f"progress s after the release, {side}"
        rows.append(_Row(name, f"≥ {after.min_s:g}", _figure(s, "{:.2f}"), met))
    stays = bool(summary["stays_on"])
    rows.append(_Row("the coat stays on", "yes", "yes" if stays else "no", stays))
    far = summary.get("collar_to_neck_m")
    most = after.max_collar_to_neck
    met = far is not None and far <= most
    shown = _figure(far, "{:.1f} cm", 100.0)
    rows.append(_Row("collar to neck", f"≤ {100.0 * most:g} cm", shown, met))
    return rows


def _garment_rows(summary: dict[str, Any], rules: SuccessRules) -> list[_Row]:
    """Returns penetration, strain and contact force, for a run whose true garment is known."""
    return [
        _at_most(
            summary,
            "penetration, deepest",
            "max_penetration_m",
            rules.max_penetration,
            "{:.1f} mm",
            scale=1e3,
        ),
        _at_most(
            summary,
            "strain of 99 % of the edges, largest",
            "max_edge_strain",
            rules.max_edge_strain,
            "{:.1f} %",
            scale=1e2,
        ),
        _Row(
            "contact force at one node, largest",
            "",
            _figure(summary.get("max_contact_force_N"), "{:.2f} N"),
            None,
        ),
    ]


def _arm_rows(summary: dict[str, Any], rules: SuccessRules) -> list[_Row]:
    """Returns distances, joint limits and tracking errors of the robot arms."""
    rows = []
    least = rules.min_arm_distance
    for name, key in (
        ("distance between the arms, smallest", "min_arms_apart_m"),
        ("distance from arms to person except hands, smallest", "min_arm_to_person_m"),
    ):
        value = summary[key]
        asked, met = f"≥ {100 * least:g} cm", value is not None and value >= least
        rows.append(_Row(name, asked, _figure(value, "{:.1f} cm", 100.0), met))
    for quantity in ("speed", "torque"):
        name, key = f"joint {quantity}, share of its limit", f"max_joint_{quantity}_share"
        rows.append(_at_most(summary, name, key, 1.0, "{:.2f}"))
    margin = summary["min_joint_margin_rad"]
    kept = margin is not None and margin >= 0.0
    rows.append(
        _Row("margin to a joint limit, smallest", "≥ 0", _figure(margin, "{:.3f} rad"), kept)
    )
    tracking = summary["arm_tracking_mm"]
    shown = f"{tracking['median']:.1f} mm (median), {tracking['p99']:.1f} mm (99 %)"
    rows.append(_Row("gripper tracking error", "", shown, None))
    return rows


def _safety(summary: dict[str, Any]) -> str:
    """Returns a line on the requests that the safety governor limited; empty if none."""
    cuts = summary.get("safety_cut_s") or {}
    told = [
        f"{side}: " + ", ".join(f"{name} {time:.1f} s" for name, time in cuts[side].items())
        for side in SIDES
        if cuts.get(side)
    ]
    if not told:
        return ""
    line = html.escape("; ".join(told))
    return f'<p class="note">The safety governor limited the requested motion. {line}.</p>'


def _pace(summary: dict[str, Any]) -> str:
    rows = [
        ("dressing time", _figure(summary.get("dressing_time_s"), "{:.1f} s")),
        ("simulated time", _figure(summary.get("simulated_time_s"), "{:.1f} s")),
        ("wall time", _figure(summary.get("wall_time_s"), "{:.1f} s")),
        ("real-time factor", _figure(summary.get("realtime_factor"), "{:.2f}")),
    ]
    for name in ("global", "local"):
        solve = summary.get(f"{name}_solve_ms") or {}
        rate = _figure(summary.get(f"{name}_rate_hz"), "{:.1f} Hz")
        median = _figure(solve.get("median"), "{:.1f} ms")
        p99 = _figure(solve.get("p99"), "{:.1f} ms")
        rows.append((f"{name} controller", f"{rate}, solves {median} (median), {p99} (99 %)"))
    late = summary.get("late_plans")
    rows.append(("plans later than the modelled delay", _figure(late, "{:.0f} %", 100.0)))
    if "command_rate_hz" in summary:
        latency = summary["command_latency_ms"]
        rate = _figure(summary["command_rate_hz"], "{:.1f} Hz")
        median, p99 = (_figure(latency[n], "{:.1f} ms") for n in ("median", "p99"))
        rows.append(("commands", f"{rate}, latency {median} (median), {p99} (99 %)"))
        rows.append(("start-up to first command", _figure(summary["start_up_s"], "{:.1f} s")))
        rows.append(("fell behind real time by", _figure(summary["fell_behind_s"], "{:.1f} s")))
    return (
        "<table><tbody>"
        + "".join(f"<tr><td>{name}</td><td>{value}</td></tr>" for name, value in rows)
        + "</tbody></table>"
    )


def _figure(value: Any, text: str, scale: float = 1.0) -> str:
    return "–" if value is None else text.format(scale * value)


def _pictures(log: RunLog, m: Measures) -> str:
    inserted = [
        (first, k) for k in (0, 1) if (first := m.inserted_since(k)) is not None and first > 0
    ]
    shots: list[tuple[str, int, float]] = [("start", 0, 0.45)]
    for count, (i, k) in enumerate(sorted(inserted)):
        name = f"insertion of the {('first', 'second')[count]} sleeve ({SIDES[k]})"
        shots.append((name, i, (0.95, -0.95)[k]))
    last = len(log) - 1
    shots += [("end", last, 0.45), ("end, from behind", last, np.pi + 0.45)]
    figures, skin = [], logged_skin(log)
    for name, i, azimuth in shots:
        if not m.finite[i]:
            continue
        grippers = np.stack([log.gripper_position[side][i] for side in SIDES])
        target = log.joint_position[i].mean(axis=0) - [0.0, 0.0, 0.12]
        eye = target + 2.9 * np.array([np.cos(azimuth), np.sin(azimuth), 0.22])
        camera = CameraPose(tuple(eye), tuple(target))
        picture = render_still(
            log.faces,
            log.garment_position(i),
            _person(log, skin, i),
            grippers,
            camera,
            _STILL_SIZE,
            arms=arm_poses(log, np.array([i]))[0],
        )
        caption = f"{name}, t = {log.time[i]:.1f} s"
        figures.append(
            f'<figure><img alt="{caption}" src="data:image/png;base64,{_png(picture)}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )
    missing = [SIDES[k] for k in (0, 1) if m.inserted_since(k) is None]
    note = "".join(
        f'<p class="note">The {side} arm was not inside its sleeve at the end.</p>'
        for side in missing
    )
    return f'<div class="pictures">{"".join(figures)}</div>{note}'


def _person(log: RunLog, skin: LoggedSkin | None, i: int) -> Limbs | Surface | Seated:
    """Returns the person at sample `i`: the skin where it is known, otherwise the limbs."""
    a, b, radius = log.capsules
    own, chair = ~log.of_chair, log.of_chair
    body: Limbs | Surface = (a[i, own], b[i, own], radius[own])
    if skin is not None and skin.is_known(i):
        body = Surface(skin.vertices(i), skin.faces)
    return Seated(body, (a[i, chair], b[i, chair], radius[chair])) if chair.any() else body


def _png(picture: npt.NDArray[np.uint8]) -> str:
    return base64.b64encode(as_png(picture)).decode("ascii")
