"""A coat held at its shoulders is released from its rest shape: the paper's draping."""

from __future__ import annotations

from pathlib import Path

from benchmarks.cloth.comparison import (
    Result,
    against_peers,
    over_steps,
    peers_table,
    steps_panels,
    steps_table,
)
from benchmarks.cloth.figures import write_figure
from benchmarks.cloth.garments import PAPER_SPACING, QUICK_SPACING, grasp, jacket
from benchmarks.cloth.measure import Session
from benchmarks.cloth.motions import at_rest
from benchmarks.cloth.scene import QUICK_STEPS, SOFT, STIFF, TIME_STEPS, Scene
from benchmarks.cloth.table import Table
from drake_dress.models.cloth.material import Material

DURATION = 3.0
# Long enough to report the height after 1 s.
_PEER_DURATION = 1.0
_PEER_STEP = 0.01


def draping_scene(spacing: float, material: Material, duration: float, name: str) -> Scene:
    """Returns the scene with the jacket at a spacing, m."""
    mesh = jacket(spacing)
    held = grasp(mesh)
    x = mesh.rest_position
    return Scene(name, x, mesh.faces, held, material, at_rest(x[held]), duration)


def measure(session: Session) -> Result:
    """Returns cost and accuracy over time steps, and the comparison with peers on stiff fabric."""
    spacing = QUICK_SPACING if session.quick else PAPER_SPACING
    steps = QUICK_STEPS if session.quick else TIME_STEPS
    duration = 0.5 if session.quick else DURATION
    peers = 0.2 if session.quick else _PEER_DURATION
    return {
        "over_steps": over_steps(session, draping_scene(spacing, SOFT, duration, "draping"), steps),
        "peers": against_peers(
            session, draping_scene(spacing, STIFF, peers, "draping-stiff"), _PEER_STEP, peers
        ),
    }


def tables(result: Result) -> list[Table]:
    """Returns both tables."""
    return [steps_table(result["over_steps"]), peers_table(result["peers"])]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes the pair of plots as in the paper; returns the files."""
    file = folder / "cloth_draping.png"
    write_figure(file, steps_panels(result["over_steps"]))
    return [file]
