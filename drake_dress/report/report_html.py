"""A run as one page to read, `report.html`: verdict, limits, course, pictures; self-contained."""

from __future__ import annotations

import base64
import html
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drake_dress.drawing import as_png, plain_settings
from drake_dress.file_output import write_text
from drake_dress.models.sides import SIDES
from drake_dress.report.arms import arm_capsules
from drake_dress.report.log import RunLog
from drake_dress.report.log_schema import STAGE_NAMES
from drake_dress.report.measures import Measures, measure
from drake_dress.report.page import chart, embedded, html_page
from drake_dress.report.stills import CameraPose, render_still
from drake_dress.report.summary import SuccessRules, read_summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOR = {"left": "#0b7a5e", "right": "#b8453b"}
_STAGE_SHADE = ("#eef1f4", "#dbe8f5", "#dff1e4")
_LIMIT: dict[str, Any] = {"color": "#8a2b2b", "linestyle": (0, (4, 3)), "linewidth": 1.0}
_STILL_SIZE = (560, 440)


def write_report(
    run_dir: str | Path, *, rules: SuccessRules | None = None, measures: Measures | None = None
) -> Path:
    """Writes `report.html` from `run.h5` and `summary.json` beside it; returns its path.

    Args:
        run_dir: holds both.
        rules: the limits that were asked.
        measures: of this log where they are known already; computed otherwise.

    Raises:
        UserError: one of the two is missing or cannot be used.
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
    detail = (
        f"after {_figure(summary.get('dressing_time_s'), '{:.1f} s')} of simulated time"
        if success
        else str(summary.get("reason"))
    )
    parts = [
        f'<header class="{"good" if success else "bad"}"><h1>{verdict}</h1>'
        f"<p>{html.escape(detail)}</p></header>",
        "<h2>Limits asked and reached</h2>",
        _limits(summary, rules, log.estimated),
        _safety(summary),
        "<h2>Pace</h2>",
        _pace(summary),
    ]
    if log.estimated:
        parts.insert(
            parts.index("<h2>Pace</h2>"),
            '<p class="note">Garment and person are as they were estimated: penetration and strain '
            "would tell of the estimate, and are not judged.</p>",
        )
    if log.events:
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in log.events)
        parts += [f"<details><summary>events at the station</summary><ul>{lines}</ul></details>"]
    if len(log):
        parts += ["<h2>Pictures</h2>", _pictures(log, m), "<h2>Course</h2>", _shading()]
        parts += [_chart(title, note, draw) for title, note, draw in _charts(log, m, rules)]
    parts += [
        "<h2>Scenario</h2>",
        f"<p>drake_dress {html.escape(log.version)}, seed {log.seed}</p>",
        f"<details><summary>resolved YAML</summary><pre>{html.escape(log.scenario_text)}</pre>"
        "</details>",
    ]
    return html_page("Dressing report", parts)


def _limits(summary: dict[str, Any], rules: SuccessRules, estimated: bool) -> str:
    rows: list[tuple[str, str, str, bool | None]] = []

    def at_most(name: str, key: str, limit: float, text: str, scale: float = 1.0) -> None:
        value = summary.get(key)
        met = None if value is None else bool(value <= limit)
        asked = "≤ " + text.format(scale * limit)
        rows.append((name, asked, _figure(value, text, scale), met))

    for side in SIDES:
        s = summary.get(f"s_{side}")
        met = s is not None and s >= rules.min_s
        rows.append((f"progress s, {side}", f"≥ {rules.min_s:g}", _figure(s, "{:.2f}"), met))
        far = _figure(summary.get(f"armhole_to_shoulder_{side}_m"), "{:.1f} cm", 100.0)
        rows.append((f"{side} armhole to shoulder, along the arm", "", far, None))
    for side in SIDES:
        inside = bool(summary.get(f"arm_inside_{side}"))
        number = summary.get(f"linking_number_{side}")
        shown = f"{number:+d}" if number else ("±1" if inside else "0")
        rows.append((f"linking number of {side} armhole and arm", "±1", shown, inside))
    for side in SIDES:
        through = bool(summary.get(f"hand_through_cuff_{side}"))
        rows.append((f"{side} hand through the cuff", "", "yes" if through else "no", None))
    at_most("gripper force, largest", "max_gripper_force_N", rules.max_gripper_force, "{:.1f} N")
    if not estimated:
        at_most(
            "penetration, deepest",
            "max_penetration_m",
            rules.max_penetration,
            "{:.1f} mm",
            scale=1e3,
        )
        at_most(
            "strain of 99 % of the edges, largest",
            "max_edge_strain",
            rules.max_edge_strain,
            "{:.1f} %",
            scale=1e2,
        )
        rows.append(
            (
                "contact force at one node, largest",
                "",
                _figure(summary.get("max_contact_force_N"), "{:.2f} N"),
                None,
            )
        )
    if "min_arms_apart_m" in summary:
        least = rules.min_arm_distance
        for name, key in (
            ("arms apart, least", "min_arms_apart_m"),
            ("arm to person but for hands, least", "min_arm_to_person_m"),
        ):
            value = summary[key]
            asked, met = f"≥ {100 * least:g} cm", value is not None and value >= least
            rows.append((name, asked, _figure(value, "{:.1f} cm", 100.0), met))
        at_most("joint speed, share of its limit", "max_joint_speed_share", 1.0, "{:.2f}")
        at_most("joint torque, share of its limit", "max_joint_torque_share", 1.0, "{:.2f}")
        margin = summary["min_joint_margin_rad"]
        kept = margin is not None and margin >= 0.0
        rows.append(("joint to its limit, least", "≥ 0", _figure(margin, "{:.3f} rad"), kept))
        tracking = summary["arm_tracking_mm"]
        shown = f"{tracking['median']:.1f} mm (median), {tracking['p99']:.1f} mm (99 %)"
        rows.append(("gripper off its joints' command", "", shown, None))
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
        "<table><thead><tr><th></th><th>asked</th><th>reached</th><th></th></tr></thead>"
        f"<tbody>{body}</tbody></table>"
    )


def _safety(summary: dict[str, Any]) -> str:
    """Returns a line on what the safety governor cut; empty where it cut nothing."""
    cuts = summary.get("safety_cut_s") or {}
    told = [
        f"{side}: " + ", ".join(f"{name} {time:.1f} s" for name, time in cuts[side].items())
        for side in SIDES
        if cuts.get(side)
    ]
    if not told:
        return ""
    line = html.escape("; ".join(told))
    return f'<p class="note">Requests were cut by the safety governor. {line}.</p>'


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
    rows.append(("plans later than is modelled", _figure(late, "{:.0f} %", 100.0)))
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
    figures = []
    for name, i, azimuth in shots:
        if not m.finite[i]:
            continue
        a, b, radius = log.capsules
        grippers = np.stack([log.gripper_position[side][i] for side in SIDES])
        target = log.joint_position[i].mean(axis=0) - [0.0, 0.0, 0.12]
        eye = target + 2.9 * np.array([np.cos(azimuth), np.sin(azimuth), 0.22])
        camera = CameraPose(tuple(eye), tuple(target))
        arms = arm_capsules(log, np.array([i]))
        picture = render_still(
            log.faces,
            log.garment_position(i),
            a[i],
            b[i],
            radius,
            grippers,
            camera,
            _STILL_SIZE,
            arms=(arms[0][0], arms[1][0], arms[2]),
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


def _png(picture: npt.NDArray[np.uint8]) -> str:
    return base64.b64encode(as_png(picture)).decode("ascii")


def _charts(
    log: RunLog, m: Measures, rules: SuccessRules
) -> list[tuple[str, str, Callable[[list[Axes]], None]]]:
    t = log.time

    def progress(axes: list[Axes]) -> None:
        for k, side in enumerate(SIDES):
            axes[0].plot(t, log.dressing[side][:, 0], color=_COLOR[side], label=side)
            i = m.inserted_since(k)
            if i is not None:
                axes[0].plot(t[i], log.dressing[side][i, 0], "o", color=_COLOR[side], ms=6)
            axes[1].plot(t, 1e3 * log.dressing[side][:, 1], color=_COLOR[side], label=side)
        axes[0].axhline(rules.min_s, **_LIMIT)
        axes[0].set_ylim(-0.05, 2.1)
        axes[0].set_ylabel("progress s")
        axes[1].set_ylabel("distance l, mm")

    def angle(axes: list[Axes]) -> None:
        for side in SIDES:
            theta = np.degrees(np.unwrap(np.nan_to_num(log.dressing[side][:, 2])))
            axes[0].plot(t, theta, color=_COLOR[side], label=side)
        axes[0].set_ylabel("angle θ, °")

    def gripper(axes: list[Axes]) -> None:
        for k, side in enumerate(SIDES):
            axes[0].plot(t, m.gripper_force[:, k], color=_COLOR[side], label=side)
        axes[0].axhline(rules.max_gripper_force, **_LIMIT)
        axes[0].set_ylim(bottom=0.0)
        axes[0].set_ylabel("gripper force, N")

    def contact(axes: list[Axes]) -> None:
        axes[0].plot(t, m.total_contact_force, color="#37474f", label="sum of the nodes")
        axes[0].plot(t, m.node_contact_force, color="#c77f1a", label="largest at one node")
        axes[0].set_ylim(bottom=0.0)
        axes[0].set_ylabel("contact force, N")

    def bounds(axes: list[Axes]) -> None:
        axes[0].plot(t, 1e2 * m.edge_strain, color="#37474f", label="99 % of the edges")
        axes[0].plot(t, 1e2 * m.edge_strain_max, color="#b0bec5", label="worst edge", zorder=1)
        axes[0].axhline(1e2 * rules.max_edge_strain, **_LIMIT)
        axes[0].set_ylabel("strain, %")
        worst = np.nanmax(m.edge_strain, initial=rules.max_edge_strain)
        axes[0].set_ylim(0.0, 1.6e2 * worst)
        axes[1].plot(t, 1e3 * m.penetration, color="#37474f")
        axes[1].axhline(1e3 * rules.max_penetration, **_LIMIT)
        axes[1].set_ylabel("penetration, mm")
        axes[1].set_ylim(bottom=0.0)

    def solves(axes: list[Axes]) -> None:
        for name, color in (("global", "#2f6fb3"), ("local", "#c77f1a")):
            solve = 1e3 * log.solve_time(name)
            if np.isfinite(solve).any():
                axes[0].plot(t, solve, ".", color=color, ms=4, label=name)
        axes[0].set_yscale("log")
        axes[0].set_ylabel("solve time, ms")

    charts: list[tuple[str, str, Callable[[list[Axes]], None]]] = [
        (
            "Progress and distance by stage",
            "s is 0 at the hand, 1 at the elbow, 2 at the shoulder; a dot marks where the arm "
            "came to be inside the armhole for good.",
            progress,
        ),
        ("Angle about the arm", "", angle),
        ("Force of the garment on the grippers", "", gripper),
        (
            "Contact force between person and garment",
            "Magnitudes; the sum counts forces that cancel each other.",
            contact,
        ),
        ("Strain and penetration", "", bounds),
    ]
    if any(np.isfinite(log.solve_time(name)).any() for name in ("global", "local")):
        charts.append(("Solve times", "", solves))
    return [(title, note, _with_stages(log, draw)) for title, note, draw in charts]


def _with_stages(log: RunLog, draw: Callable[[list[Axes]], None]) -> Callable[[list[Axes]], None]:
    """Returns a drawing with the stages in two strips on top: left above, right below."""

    def drawn(axes: list[Axes]) -> None:
        draw(axes)
        for ax in axes:
            for k in (0, 1):
                change = np.flatnonzero(np.diff(log.stage[:, k])) + 1
                bounds = [0, *change.tolist(), len(log) - 1]
                for i, j in zip(bounds[:-1], bounds[1:], strict=True):
                    ax.axvspan(
                        log.time[i],
                        log.time[j],
                        ymin=0.5 * (1 - k),
                        ymax=0.5 * (2 - k),
                        color=_STAGE_SHADE[int(np.clip(log.stage[i, k], 0, 2))],
                        lw=0,
                        zorder=0,
                    )
            if len(log) > 1:
                ax.set_xlim(log.time[0], log.time[-1])
        if axes[0].get_legend_handles_labels()[0]:
            axes[0].legend(loc="upper left", frameon=False, fontsize=9, ncols=2)

    return drawn


def _chart(title: str, note: str, draw: Callable[[list[Axes]], None]) -> str:
    rows = 2 if title in ("Progress and distance by stage", "Strain and penetration") else 1
    figure, axes = chart(9.0, 2.5 * rows + 0.3, rows)
    draw(axes)
    axes[-1].set_xlabel("time, s")
    return embedded(figure, title, note)


def _shading() -> str:
    shades = ", ".join(
        f'<span class="key" style="background:{shade}"></span>{name}'
        for name, shade in zip(STAGE_NAMES, _STAGE_SHADE, strict=True)
    )
    return f'<p class="note">Shaded by stage: {shades}; upper half left, lower half right.</p>'
