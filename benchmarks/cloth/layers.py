"""Cost of self-collision: time of a step with it, divided by the time without.

The scenes are a hanging coat, a coat that falls in a heap, and two sheets at rest on each other,
which touch with all of their nodes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.cloth.comparison import Result
from benchmarks.cloth.draping import draping_scene
from benchmarks.cloth.engines import explicit_bias
from benchmarks.cloth.garments import PAPER_SPACING, QUICK_SPACING, jacket, sheet
from benchmarks.cloth.measure import Session, race, ratio
from benchmarks.cloth.motions import at_rest
from benchmarks.cloth.scene import SOFT, Scene
from benchmarks.cloth.table import Table, milliseconds
from drake_dress.models.cloth.contact.obstacles import Obstacles

_THICKNESS = 2e-3
_STEP = 0.01
_TIME, _QUICK_TIME = 1.0, 0.3
# Initial height of the heap above the floor, and initial distance of the sheets, m.
_ABOVE, _APART = 0.02, 4e-3
_COLUMNS, _SPACING = 55, 0.014
_NONE = np.zeros(0, dtype=np.int32)


def measure(session: Session) -> Result:
    """Returns times with and without self-collision."""
    rows = []
    for scene in _scenes(session.quick):
        if session.stop.is_set():
            break
        session.say(f"layers, {scene.name}: {len(scene.position)} nodes")
        runs = race(session, scene, [explicit_bias(1), explicit_bias(1, _THICKNESS)], _STEP)
        if len(runs) < 2:
            continue
        plain, apart = runs
        rows.append(
            {
                "scene": scene.name,
                "nodes": len(scene.position),
                "step_s": plain.median(),
                "step_apart_s": apart.median(),
                "ratio": ratio(apart, plain),
                "ratio_end": ratio(apart, plain, last=3),
            }
        )
    return {"thickness_m": _THICKNESS, "time_step_s": _STEP, "runs": rows}


def _scenes(quick: bool) -> list[Scene]:
    spacing = QUICK_SPACING if quick else PAPER_SPACING
    time = _QUICK_TIME if quick else _TIME
    coat = jacket(spacing)
    x, faces = coat.rest_position, coat.faces
    low = Obstacles.floor(float(x[:, 2].min()) - _ABOVE)
    flat, pieces = sheet(12 if quick else _COLUMNS, _SPACING)
    two = np.vstack([flat, flat + np.array([0.3 * _SPACING, 0.3 * _SPACING, _APART])])
    both = np.vstack([pieces, pieces + len(flat)]).astype(np.int32)
    floor = Obstacles.floor(-SOFT.margin)
    nothing = at_rest(np.zeros((0, 3)))
    return [
        draping_scene(spacing, SOFT, time, "a coat that hangs"),
        Scene("a coat that falls in a heap", x, faces, _NONE, SOFT, nothing, time, low),
        Scene("two sheets at rest", two, both, _NONE, SOFT, nothing, time, floor),
    ]


def tables(result: Result) -> list[Table]:
    """Returns the table over scenes."""
    rows = [
        [
            run["scene"],
            run["nodes"],
            milliseconds(run["step_s"]),
            milliseconds(run["step_apart_s"]),
            run["ratio"],
            run["ratio_end"],
        ]
        for run in result["runs"]
    ]
    header = ["scene", "nodes", "step ms", "apart ms", "ratio", "ratio, last 0.3 s"]
    title = f"layers kept {1e3 * _THICKNESS:g} mm apart, h = {1e3 * _STEP:g} ms, one iteration"
    return [Table(title, header, rows)]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes nothing; the table is sufficient."""
    return []
