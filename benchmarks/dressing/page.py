"""The page of a study: success over pose, body, coat and fabric, and a list of failures."""

from __future__ import annotations

import html
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.dressing.cases import Case
from benchmarks.statistics import wilson
from drake_dress.drawing import plain_settings
from drake_dress.report.page import chart, embedded, html_page

# Maps: title, the features of both axes, and their labels. Arm angles are the mean of both arms.
MAPS = (
    ("pose", "abduction_deg", "extension_deg", "abduction, °", "extension, °"),
    ("body", "body_shoulder_width", "body_upper_arm_length", "shoulder width, m", "upper arm, m"),
    ("coat", "coat_chest", "coat_armhole_girth", "chest, m", "armhole girth, m"),
    ("coat and body", "ease", "span", "armhole less upper arm, girths, m", "shoulders, coat/body"),
    ("fabric", "fabric_friction", "fabric_stretch_stiffness", "friction", "stretch, N/m"),
    ("start", "start_distance_behind", "start_lateral_offset", "behind, m", "sideways, m"),
)
_GOOD, _BAD = "#0b7a5e", "#c2412d"
_BINS = 5


def study_page(
    results: Sequence[dict[str, Any]], drawn: Callable[[Case], Mapping[str, float]], beside: Path
) -> str:
    """Returns the HTML page.

    Args:
        results: Results of the runs, with summaries.
        drawn: Returns the numbers drawn by a run's seed.
        beside: Path of the page; replays kept in a folder next to it are linked.
    """
    rows = [(r, features(drawn(Case(**r["case"])))) for r in results]
    good = np.array([r["summary"]["success"] for r, _ in rows], dtype=bool)
    low, high = wilson(int(good.sum()), len(good))
    parts = [
        "<h1>Dressing study</h1>",
        f"<p>{int(good.sum())} of {len(good)} dressed, {100 * low:.0f} to {100 * high:.0f} % "
        "(90 % interval).</p>",
        "<h2>Success over what was drawn</h2>",
    ]
    for title, x, y, x_label, y_label in MAPS:
        points = np.array([[f[x], f[y]] for _, f in rows])
        parts.append(_map(title, points, good, x_label, y_label))
    parts += ["<h2>Runs that failed</h2>", _failures([r for r, _ in rows], beside)]
    return html_page("Dressing study", parts)


def features(drawn: Mapping[str, float]) -> dict[str, float]:
    """Returns the drawn numbers and some derived ones."""
    found = dict(drawn)
    for name in ("abduction_deg", "extension_deg", "elbow_deg"):
        found[name] = 0.5 * (drawn[f"left_{name}"] + drawn[f"right_{name}"])
    arm = 2.0 * np.pi * drawn["body_upper_arm_radius"]
    found["ease"] = drawn["coat_armhole_girth"] - arm
    found["span"] = drawn["coat_shoulder_width"] / drawn["body_shoulder_width"]
    return found


@plain_settings()
def _map(title: str, points: np.ndarray, good: np.ndarray, x: str, y: str) -> str:
    """Returns a scatter plot of the runs, and the success rate over each axis with intervals."""
    figure, (ax, over_x, over_y) = chart(11.0, 3.4, columns=3)
    for dressed, colour, marker in ((True, _GOOD, "o"), (False, _BAD, "x")):
        at = points[good == dressed]
        ax.scatter(at[:, 0], at[:, 1], s=18, c=colour, marker=marker, alpha=0.75)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    for k, (other, label) in enumerate(((over_x, x), (over_y, y))):
        middle, share, below, above = _shares(points[:, k], good)
        other.errorbar(middle, share, [share - below, above - share], fmt="o", c=_GOOD, capsize=3)
        other.set_ylim(0.0, 105.0)
        other.set_xlabel(label)
        other.set_ylabel("dressed, %")
    note = "o dressed, x not; bars are 90 % intervals of a fifth of the runs each"
    return embedded(figure, title, note)


def _shares(values: np.ndarray, good: np.ndarray) -> tuple[np.ndarray, ...]:
    """Returns the mean value, success rate and interval, %, of equally large groups of runs."""
    order = np.argsort(values, kind="stable")
    rows = []
    for group in np.array_split(order, min(_BINS, len(order))):
        dressed = int(good[group].sum())
        low, high = wilson(dressed, len(group))
        share = 100.0 * dressed / len(group)
        rows.append([float(values[group].mean()), share, 100.0 * low, 100.0 * high])
    return tuple(np.array(rows).T)


def _failures(results: Sequence[dict[str, Any]], beside: Path) -> str:
    lines = []
    for r in results:
        if r["summary"]["success"]:
            continue
        name = Case(**r["case"]).name
        links = [
            f'<a href="{html.escape(os.path.relpath(path, beside.parent))}">{path.stem}</a>'
            for path in _kept(beside, name)
        ]
        told = html.escape(str(r["summary"]["reason"]))
        lines.append(
            f"<tr><td>{html.escape(name)}</td><td>{told}</td><td>{' '.join(links)}</td></tr>"
        )
    if not lines:
        return "<p>None.</p>"
    return (
        "<table><thead><tr><th>run</th><th>why</th><th></th></tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
    )


def _kept(page: Path, name: str) -> list[Path]:
    """Returns the report and replay of a run, found in its folder below the page's folder."""
    found = sorted(page.parent.glob(f"*/{name}/*.html"))
    return [path for path in found if path.stem in ("report", "replay")]
