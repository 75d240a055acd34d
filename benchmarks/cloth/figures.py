"""Line plots of the results; they need no display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy.typing as npt

from drake_dress.drawing import new_figure, plain_settings


@dataclass(frozen=True)
class Line:
    """A curve with its label; line style, marker and colour as in Matplotlib."""

    x: npt.ArrayLike
    y: npt.ArrayLike
    label: str
    line_style: str = "-"
    marker: str = ""
    color: str | tuple[float, ...] | None = None


@dataclass(frozen=True)
class Panel:
    """One pair of axes."""

    title: str
    x_label: str
    y_label: str
    lines: Sequence[Line]
    log: bool = False
    equal: bool = False


@plain_settings()
def write_figure(file: Path, panels: Sequence[Panel]) -> None:
    """Writes panels side by side as a PNG."""
    figure = new_figure(5.6 * len(panels), 4.2)
    axes = figure.subplots(1, len(panels), squeeze=False)
    for axis, panel in zip(axes[0], panels, strict=True):
        for line in panel.lines:
            axis.plot(
                line.x,
                line.y,
                label=line.label,
                linestyle=line.line_style,
                marker=line.marker,
                color=line.color,
                linewidth=1.4,
                markersize=4,
            )
        if panel.log:
            axis.set_xscale("log")
            axis.set_yscale("log")
        if panel.equal:
            axis.set_aspect("equal", adjustable="datalim")
        axis.set(title=panel.title, xlabel=panel.x_label, ylabel=panel.y_label)
        axis.grid(alpha=0.3)
        if panel.lines:
            axis.legend(fontsize=7)
    figure.tight_layout()
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=130)
