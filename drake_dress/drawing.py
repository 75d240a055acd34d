"""Matplotlib for image files only, independent of the user's settings.

Importing Matplotlib fails if `MPLBACKEND` names a GUI or notebook backend that is not installed, as
in commands run from a notebook. A `matplotlibrc` may require LaTeX. Neither is needed here: figures
are drawn on their own canvas.
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
    """Imports Matplotlib whatever `MPLBACKEND` says; then sets that backend if it is available."""
    if "matplotlib" in sys.modules:
        return
    backend = os.environ.pop("MPLBACKEND", None)
    try:
        matplotlib = importlib.import_module("matplotlib")
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend:
        # Matplotlib does this at import, which fails for a backend that is not installed.
        with suppress(Exception):
            matplotlib.rcParams["backend"] = backend


@contextmanager
def plain_settings() -> Iterator[None]:
    """Uses Matplotlib's default settings, not the user's, so that files are reproducible."""
    load_matplotlib()
    import matplotlib

    settings = {k: v for k, v in matplotlib.rcParamsDefault.items() if "backend" not in k}
    # Without a salt, identifiers in an SVG are random.
    with matplotlib.rc_context(settings | {"svg.hashsalt": "drake_dress"}):
        yield


def new_figure(width: float, height: float, **options: Any) -> Figure:
    """Returns an empty figure on a raster canvas, size in inches."""
    load_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), **options)
    FigureCanvasAgg(figure)
    return figure


def as_svg(figure: Figure) -> bytes:
    """Returns a figure encoded as SVG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def pixels(figure: Figure) -> npt.NDArray[np.uint8]:
    """Returns the RGBA pixels (height, width, 4) of a figure."""
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())  # type: ignore[attr-defined]  # of Agg


def as_png(picture: npt.NDArray[np.uint8]) -> bytes:
    """Returns an image (height, width, 3 or 4) encoded as PNG."""
    load_matplotlib()
    from matplotlib import image

    buffer = io.BytesIO()
    image.imsave(buffer, picture, format="png")
    return buffer.getvalue()
