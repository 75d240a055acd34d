"""Matplotlib, for pictures in files alone: no setting of the user's changes or fails them.

Its import fails if `MPLBACKEND` names a window or notebook that is not installed, as in each
command of a notebook; settings in a `matplotlibrc` may ask for LaTeX. Neither is of use here:
figures are drawn on a canvas of their own.
"""

from __future__ import annotations

import importlib
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def load_matplotlib() -> None:
    """Imports Matplotlib whatever `MPLBACKEND` says, which holds for others if it can."""
    if "matplotlib" in sys.modules:
        return
    backend = os.environ.pop("MPLBACKEND", None)
    try:
        matplotlib = importlib.import_module("matplotlib")
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend:
        # As Matplotlib does at its import, where it fails for a backend that is not installed.
        with suppress(Exception):
            matplotlib.rcParams["backend"] = backend


@contextmanager
def plain_settings() -> Iterator[None]:
    """Has Matplotlib's own settings hold, not the user's; files are the same each time."""
    load_matplotlib()
    import matplotlib

    settings = {k: v for k, v in matplotlib.rcParamsDefault.items() if "backend" not in k}
    # Names inside a file are drawn by chance otherwise.
    with matplotlib.rc_context(settings | {"svg.hashsalt": "drake_dress"}):
        yield


def new_figure(width: float, height: float, **options: Any) -> Figure:
    """Returns an empty figure of so many inches, on a canvas of pixels."""
    load_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), **options)
    FigureCanvasAgg(figure)
    return figure


def as_svg(figure: Figure) -> bytes:
    """Returns a figure as a file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def pixels(figure: Figure) -> npt.NDArray[np.uint8]:
    """Returns (height, width, 4) RGBA of a figure."""
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())  # type: ignore[attr-defined]  # of Agg


def as_png(picture: npt.NDArray[np.uint8]) -> bytes:
    """Returns a picture (height, width, 3 or 4) as a file."""
    load_matplotlib()
    from matplotlib import image

    buffer = io.BytesIO()
    image.imsave(buffer, picture, format="png")
    return buffer.getvalue()
