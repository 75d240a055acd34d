"""Growth of the cost of a step with the number of nodes: draping, one iteration."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from benchmarks.cloth.comparison import Result
from benchmarks.cloth.engines import ExplicitBiasEngine
from benchmarks.cloth.figures import Line, Panel, write_figure
from benchmarks.cloth.garments import GROWTH_SPACINGS, grasp, overcoat
from benchmarks.cloth.measure import Session
from benchmarks.cloth.motions import at_rest
from benchmarks.cloth.scene import SOFT, Scene
from benchmarks.cloth.table import Table, milliseconds

_STEP = 0.01
_STEPS = 15
_REPEATS = 4


def measure(session: Session) -> Result:
    """Returns the cost of a step for each size, and the exponent of a fit.

    Sizes are timed in several alternating rounds.
    """
    spacings = (0.06, 0.045, 0.035) if session.quick else GROWTH_SPACINGS
    session.say(f"growth: {len(spacings)} sizes of the overcoat")
    sizes: list[Result] = []
    engines: list[ExplicitBiasEngine] = []
    ExplicitBiasEngine(_scene(spacings[0]), _STEP)  # compile before timing set-ups
    for spacing in spacings:
        scene = _scene(spacing)
        begin = time.perf_counter()
        engine = ExplicitBiasEngine(scene, _STEP)
        setup = time.perf_counter() - begin
        sizes.append({"nodes": len(scene.position), "setup_s": setup})
        engine.step(scene.motion(_STEP))
        engines.append(engine)
    rounds: list[list[float]] = [[] for _ in engines]
    for _ in range(_REPEATS):
        for engine, kept in zip(engines, rounds, strict=True):
            if session.stop.is_set():
                break
            held_now = engine.x[engine.cloth.held]
            taken = []
            for _ in range(_STEPS):
                begin = time.perf_counter()
                engine.step(held_now)
                taken.append(time.perf_counter() - begin)
            kept.append(float(np.median(taken)))
    for size, kept in zip(sizes, rounds, strict=True):
        size["step_median_s"] = float(np.median(kept)) if kept else None
        size["step_rounds_s"] = kept
    done = [size for size in sizes if size["step_median_s"]]
    exponent = None
    if len(done) > 1:
        n = np.log([size["nodes"] for size in done])
        cost = np.log([size["step_median_s"] for size in done])
        exponent = float(np.polyfit(n, cost, 1)[0])
    session.say(f"  exponent {exponent if exponent is None else round(exponent, 2)}")
    return {"time_step_s": _STEP, "sizes": sizes, "exponent": exponent}


def _scene(spacing: float) -> Scene:
    mesh = overcoat(spacing)
    held, x = grasp(mesh), mesh.rest_position
    return Scene("growth", x, mesh.faces, held, SOFT, at_rest(x[held]), 1.0)


def tables(result: Result) -> list[Table]:
    """Returns the table of sizes."""
    exponent = result["exponent"]
    fit = "" if exponent is None else f", cost ~ n^{exponent:.2f}"
    rows = [
        [
            size["nodes"],
            milliseconds(size["step_median_s"]),
            1e6 * size["step_median_s"] / size["nodes"] if size["step_median_s"] else None,
            milliseconds(size["setup_s"]),
        ]
        for size in result["sizes"]
    ]
    return [
        Table(
            f"growth: draping, one iteration{fit}",
            ["nodes", "step ms", "µs a node", "setup ms"],
            [[str(row[0]), *row[1:]] for row in rows],
        )
    ]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes a plot of cost over size; returns the files."""
    done = [size for size in result["sizes"] if size["step_median_s"]]
    line = Line(
        [size["nodes"] for size in done],
        [1e3 * size["step_median_s"] for size in done],
        "one iteration",
        marker="o",
    )
    file = folder / "cloth_growth.png"
    write_figure(file, [Panel("cost of a step", "nodes", "ms", [line], log=True)])
    return [file]
