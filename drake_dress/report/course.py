"""Charts of a run over time, shaded by stage: the part "Course" of `report.html`."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog
from drake_dress.report.log_schema import FORECAST_AHEAD, STAGE_NAMES
from drake_dress.report.measures import Measures
from drake_dress.report.page import chart, embedded
from drake_dress.report.summary import SuccessRules

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOR = {"left": "#0b7a5e", "right": "#b8453b"}
_STAGE_SHADE = ("#eef1f4", "#dbe8f5", "#dff1e4", "#f6ecd2", "#efe3f3")
_LIMIT: dict[str, Any] = {"color": "#8a2b2b", "linestyle": (0, (4, 3)), "linewidth": 1.0}


def course_parts(log: RunLog, measures: Measures, rules: SuccessRules) -> list[str]:
    """Returns the HTML parts: the legend of the shading, then the charts.

    Args:
        log: Log of the run, with at least one sample.
        measures: Measures of this log.
        rules: Limits, drawn as dashed lines.
    """
    return [_shading(), *(_embedded(log, c) for c in _Course(log, measures, rules).charts())]


class _Chart(NamedTuple):
    """A chart: title, note, drawing function, and number of vertically stacked axes."""

    title: str
    note: str
    draw: Callable[[list[Axes]], None]
    rows: int = 1


class _Course:
    """Draws a log and its measures over time."""

    def __init__(self, log: RunLog, measures: Measures, rules: SuccessRules) -> None:
        self._log, self._measures, self._rules = log, measures, rules

    def charts(self) -> list[_Chart]:
        """Returns the charts in the order of the page."""
        charts = [
            _Chart(
                "Progress and distance by stage",
                "s is 0 at the hand, 1 at the elbow, 2 at the shoulder; a dot marks where the arm "
                "came to be inside the armhole for good.",
                self._progress,
                2,
            ),
            _Chart("Angle about the arm", "", self._angle),
            _Chart("Force of the garment on the grippers", "", self._gripper),
            _Chart(
                "Contact force between person and garment",
                "Magnitudes; the sum counts forces that cancel each other.",
                self._contact,
            ),
            _Chart("Strain and penetration", "", self._bounds, 2),
        ]
        if any(np.isfinite(self._log.solve_time(name)).any() for name in ("global", "local")):
            charts.append(_Chart("Solve times", "", self._solves))
        if self._log.forecast is not None:
            charts.append(
                _Chart(
                    "Forecast of the person",
                    f"Above: how far each hand was from where it had been foreseen "
                    f"{FORECAST_AHEAD:g} s before; thin: the radius that was to hold it nine times "
                    "in ten. Below: probability that the arm moves by the person's own will; thin: "
                    "whether it does. Grey strip: a linear predictor stood in for the network.",
                    self._forecast,
                    2,
                )
            )
        return charts

    def _progress(self, axes: list[Axes]) -> None:
        t, dressing = self._log.time, self._log.dressing
        for k, side in enumerate(SIDES):
            axes[0].plot(t, dressing[side][:, 0], color=_COLOR[side], label=side)
            i = self._measures.inserted_since(k)
            if i is not None:
                axes[0].plot(t[i], dressing[side][i, 0], "o", color=_COLOR[side], ms=6)
            axes[1].plot(t, 1e3 * dressing[side][:, 1], color=_COLOR[side], label=side)
        axes[0].axhline(self._rules.min_s, **_LIMIT)
        axes[0].set_ylim(-0.05, 2.1)
        axes[0].set_ylabel("progress s")
        axes[1].set_ylabel("distance l, mm")

    def _angle(self, axes: list[Axes]) -> None:
        for side in SIDES:
            theta = np.degrees(np.unwrap(np.nan_to_num(self._log.dressing[side][:, 2])))
            axes[0].plot(self._log.time, theta, color=_COLOR[side], label=side)
        axes[0].set_ylabel("angle θ, °")

    def _gripper(self, axes: list[Axes]) -> None:
        for k, side in enumerate(SIDES):
            force = self._measures.gripper_force[:, k]
            axes[0].plot(self._log.time, force, color=_COLOR[side], label=side)
        axes[0].axhline(self._rules.max_gripper_force, **_LIMIT)
        axes[0].set_ylim(bottom=0.0)
        axes[0].set_ylabel("gripper force, N")

    def _contact(self, axes: list[Axes]) -> None:
        t, m = self._log.time, self._measures
        axes[0].plot(t, m.total_contact_force, color="#37474f", label="sum of the nodes")
        axes[0].plot(t, m.node_contact_force, color="#c77f1a", label="largest at one node")
        axes[0].set_ylim(bottom=0.0)
        axes[0].set_ylabel("contact force, N")

    def _bounds(self, axes: list[Axes]) -> None:
        t, m, rules = self._log.time, self._measures, self._rules
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

    def _solves(self, axes: list[Axes]) -> None:
        for name, color in (("global", "#2f6fb3"), ("local", "#c77f1a")):
            solve = 1e3 * self._log.solve_time(name)
            if np.isfinite(solve).any():
                axes[0].plot(self._log.time, solve, ".", color=color, ms=4, label=name)
        axes[0].set_yscale("log")
        axes[0].set_ylabel("solve time, ms")

    def _forecast(self, axes: list[Axes]) -> None:
        log = self._log
        foreseen, t = log.forecast, log.time
        assert foreseen is not None
        later = t + FORECAST_AHEAD
        for k, side in enumerate(SIDES):
            hand = foreseen.joint_position[:, 3 * k + 2]
            true = np.stack(
                [np.interp(later, t, log.joint_position[:, 3 * k + 2, c]) for c in range(3)], 1
            )
            off = np.where(later <= t[-1], np.linalg.norm(hand - true, axis=1), np.nan)
            axes[0].plot(later, 1e3 * off, color=_COLOR[side], label=side)
            radius = 1e3 * foreseen.radius[:, 3 * k + 2]
            axes[0].plot(later, radius, color=_COLOR[side], lw=0.8, alpha=0.5)
            axes[1].plot(t, foreseen.intent[:, k], color=_COLOR[side])
            if log.intent is not None:
                axes[1].step(
                    t, log.intent[:, k], color=_COLOR[side], lw=0.8, alpha=0.5, where="post"
                )
        axes[0].set_ylim(bottom=0.0)
        axes[0].set_ylabel("hand off by, mm")
        axes[1].set_ylim(-0.05, 1.05)
        axes[1].set_ylabel("by own will")
        linear = foreseen.is_linear > 0
        axes[1].fill_between(t, -0.05, 0.0, where=linear, step="post", color="#66727f", lw=0)


def _embedded(log: RunLog, drawn: _Chart) -> str:
    """Returns a chart as an image embedded in the page."""
    figure, axes = chart(9.0, 2.5 * drawn.rows + 0.3, drawn.rows)
    drawn.draw(axes)
    _draw_stages(log, axes)
    if axes[0].get_legend_handles_labels()[0]:
        axes[0].legend(loc="upper left", frameon=False, fontsize=9, ncols=2)
    axes[-1].set_xlabel("time, s")
    return embedded(figure, drawn.title, drawn.note)


def _draw_stages(log: RunLog, axes: list[Axes]) -> None:
    """Shades axes by stage in two strips: left sleeve above, right sleeve below."""
    for ax in axes:
        for k in (0, 1):
            change = np.flatnonzero(np.diff(log.stage[:, k])) + 1
            bounds = [0, *change.tolist(), len(log) - 1]
            for i, j in itertools.pairwise(bounds):
                ax.axvspan(
                    log.time[i],
                    log.time[j],
                    ymin=0.5 * (1 - k),
                    ymax=0.5 * (2 - k),
                    color=_STAGE_SHADE[int(np.clip(log.stage[i, k], 0, len(_STAGE_SHADE) - 1))],
                    lw=0,
                    zorder=0,
                )
        if len(log) > 1:
            ax.set_xlim(log.time[0], log.time[-1])


def _shading() -> str:
    shades = ", ".join(
        f'<span class="key" style="background:{shade}"></span>{name}'
        for name, shade in zip(STAGE_NAMES, _STAGE_SHADE, strict=True)
    )
    return f'<p class="note">Shaded by stage: {shades}; upper half left, lower half right.</p>'
