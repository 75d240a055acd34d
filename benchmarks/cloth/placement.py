"""A hanging coat is laid on a table and folded over: the paper's placement.

A coat is not flat: when laid down it keeps hollows, and some nodes never touch the table. The cost
of a step with every node in contact is measured on a flat sheet that is lowered onto the table by
one edge.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cloth import garments
from benchmarks.cloth.comparison import (
    Result,
    against_peers,
    over_steps,
    own_recipes,
    peers_table,
    steps_panels,
    steps_table,
)
from benchmarks.cloth.engines import explicit_bias
from benchmarks.cloth.figures import write_figure
from benchmarks.cloth.garments import PAPER_SPACING, QUICK_SPACING, grasp, jacket
from benchmarks.cloth.measure import Session, race
from benchmarks.cloth.motions import laid_down, pulled
from benchmarks.cloth.scene import QUICK_STEPS, SOFT, STIFF, TIME_STEPS, Scene
from benchmarks.cloth.table import Table
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.material import Material

# Initial height of the hem above the table, m.
_CLEARANCE = 0.05
# Durations of laying down, folding over and settling, s.
_TIMES = (1.2, 0.8, 0.4)
_QUICK_TIMES = (0.5, 0.3, 0.2)
_PEER_STEP = 0.01
# 78² = 6,084 nodes, spacing a centimetre.
_SHEET_COLUMNS, _SHEET_SPACING = 78, 0.01
_SHEET_SLOPE = 0.35  # rad
_SHEET_CLEARANCE = 0.005
_SHEET_TIME, _SHEET_REST = 0.8, 0.3


def placement_scene(
    spacing: float, material: Material, times: tuple[float, float, float], name: str
) -> Scene:
    """Returns the scene with the jacket at a spacing, m.

    Args:
        spacing: Spacing, m.
        material: Material of the jacket.
        times: Durations of laying down, folding over and settling, s.
        name: Name for tables.
    """
    mesh = jacket(spacing)
    held = grasp(mesh)
    x = mesh.rest_position
    table = float(x[:, 2].min()) - _CLEARANCE - material.margin
    # the hem stays where it touched, the shoulders come to lie a coat's length in front of it
    length = -float(x[:, 2].min())
    motion = laid_down(x[held], table + material.margin, length, *times[:2])
    return Scene(name, x, mesh.faces, held, material, motion, sum(times), Obstacles.floor(table))


def sheet_scene(columns: int, spacing: float, name: str) -> Scene:
    """Returns a sheet that slopes up from its free edge and is lowered by the other edge.

    Args:
        columns: Number of nodes along a side.
        spacing: Spacing, m.
        name: Name for tables.
    """
    flat, faces = garments.sheet(columns, spacing)
    side = spacing * (columns - 1)
    x = np.column_stack(
        [
            flat[:, 0] * np.cos(_SHEET_SLOPE),
            flat[:, 1],
            flat[:, 0] * np.sin(_SHEET_SLOPE) + _SHEET_CLEARANCE,
        ]
    )
    held = np.arange(columns * (columns - 1), columns**2, dtype=np.int32)
    table = -SOFT.margin
    # forward to the edge's position when the sheet is flat, and slightly beyond, so that it is taut
    way = np.array([1.01 * side - side * np.cos(_SHEET_SLOPE), 0.0, -float(x[held[0], 2])])
    motion = pulled(x[held], way, _SHEET_TIME)
    duration = _SHEET_TIME + _SHEET_REST
    return Scene(name, x, faces, held, SOFT, motion, duration, Obstacles.floor(table))


def measure(session: Session) -> Result:
    """Returns cost and accuracy over time steps, and the comparison with peers on stiff fabric."""
    spacing = QUICK_SPACING if session.quick else PAPER_SPACING
    steps = QUICK_STEPS if session.quick else TIME_STEPS
    times = _QUICK_TIMES if session.quick else _TIMES
    soft = placement_scene(spacing, SOFT, times, "placement")
    stiff = placement_scene(spacing, STIFF, times, "placement-stiff")
    sheet = sheet_scene(20 if session.quick else _SHEET_COLUMNS, _SHEET_SPACING, "laid sheet")
    # Warm up: kernels are loaded at first use, which must not count as the worst step.
    silent = replace(session, say=lambda _: None)
    race(silent, sheet_scene(12, 0.03, "warm-up"), own_recipes(), _PEER_STEP)
    return {
        "over_steps": over_steps(session, soft, steps),
        "peers": against_peers(session, stiff, _PEER_STEP, 1.0),
        "sheet_over_steps": over_steps(session, sheet, steps, [explicit_bias(1)], accuracy=False),
        "sheet_peers": against_peers(session, sheet, _PEER_STEP, 1.0, accuracy=False),
    }


def tables(result: Result) -> list[Table]:
    """Returns the tables of the coat and of the sheet."""
    return [
        steps_table(result["over_steps"]),
        peers_table(result["peers"]),
        steps_table(result["sheet_over_steps"]),
        peers_table(result["sheet_peers"]),
    ]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes the pair of plots as in the paper; returns the files."""
    file = folder / "cloth_placement.png"
    write_figure(file, steps_panels(result["over_steps"]))
    return [file]
