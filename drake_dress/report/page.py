"""A self-contained HTML page: its style and embedded charts."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drake_dress.drawing import as_svg, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def html_page(title: str, parts: Sequence[str]) -> str:
    """Returns an HTML page composed of parts."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{STYLE}</style></head><body><main>"
        + "\n".join(parts)
        + "</main></body></html>\n"
    )


def chart(
    width: float, height: float, rows: int = 1, columns: int = 1
) -> tuple[Figure, list[Axes]]:
    """Returns an empty chart, size in inches; axes in one column share their x axis."""
    figure = new_figure(width, height, layout="constrained")
    axes = list(np.ravel(figure.subplots(rows, columns, sharex=columns == 1)))
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=9)
    return figure, axes


def embedded(figure: Figure, title: str, note: str = "") -> str:
    """Returns a chart as an image embedded in the page."""
    # As a separate image: identifiers of several inline SVGs would clash.
    data = base64.b64encode(as_svg(figure)).decode("ascii")
    return f'<figure><h3>{title}</h3><img alt="{title}" src="data:image/svg+xml;base64,{data}">' + (
        f"<figcaption>{note}</figcaption></figure>" if note else "</figure>"
    )


STYLE = """
:root { --ink: #26303b; --soft: #66727f; --line: #dfe4ea; }
body { margin: 0; background: #f3f5f7; color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", sans-serif; }
main { max-width: 960px; margin: 0 auto; padding: 24px 20px 60px; }
header { border-radius: 12px; padding: 18px 24px; margin-bottom: 8px; }
header.good { background: #dff1e4; border-left: 8px solid #2b8a57; }
header.bad { background: #fbe4e1; border-left: 8px solid #b8453b; }
h1 { margin: 0; font-size: 28px; } header p { margin: 4px 0 0; font-size: 18px; }
h2 { margin: 34px 0 10px; font-size: 20px; } h3 { margin: 0 0 6px; font-size: 16px; }
table { border-collapse: collapse; background: #fff; border-radius: 10px; overflow: hidden;
  box-shadow: 0 1px 4px rgba(30,45,60,.08); min-width: min(100%, 620px);
  font-variant-numeric: tabular-nums; }
td, th { text-align: left; padding: 7px 16px; border-bottom: 1px solid var(--line); }
th { color: var(--soft); font-weight: 500; font-size: 14px; }
tr:last-child td { border-bottom: 0; }
.yes { color: #1f7a4a; } .no { color: #b03228; font-weight: 600; }
figure { margin: 0 0 18px; background: #fff; border-radius: 10px; padding: 14px 16px;
  box-shadow: 0 1px 4px rgba(30,45,60,.08); }
figure img { display: block; width: 100%; height: auto; }
figcaption, .note { color: var(--soft); font-size: 14px; margin-top: 6px; }
.pictures { display: grid; gap: 14px;
  grid-template-columns: repeat(auto-fill, minmax(min(100%, 380px), 1fr)); }
.pictures figure { margin: 0; padding: 0 0 10px; overflow: hidden; }
.pictures figcaption { padding: 0 12px; }
.key { display: inline-block; width: 14px; height: 12px; border: 1px solid #c4ccd4;
  margin: 0 4px 0 8px; vertical-align: -1px; }
pre { overflow: auto; background: #fff; padding: 12px; border-radius: 10px; font-size: 13px; }
"""
