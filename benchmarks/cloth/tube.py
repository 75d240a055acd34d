"""A cloth tube pulled along a limb: sliding contact all around, as in a sleeve."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.cloth import garments
from benchmarks.cloth.comparison import (
    Result,
    against_peers,
    over_steps,
    peers_table,
    steps_panels,
    steps_table,
)
from benchmarks.cloth.figures import write_figure
from benchmarks.cloth.measure import Session
from benchmarks.cloth.motions import pulled
from benchmarks.cloth.scene import QUICK_STEPS, SOFT, STIFF, TIME_STEPS, Scene
from benchmarks.cloth.table import Table
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.material import Material

# 36 · 50 = 1,800 nodes, spacing about a centimetre.
_AROUND, _ALONG = 36, 50
_RADIUS, _LENGTH = 0.05, 0.5
# With the contact margin, the gap between limb and tube is 2 mm.
_LIMB_RADIUS, _LIMB_LENGTH = 0.045, 0.7
# Initial distance of the held ring along the limb, and distance that it is pulled, m.
_ON, _WAY = 0.2, 0.35
DURATION = 1.5
_PEER_STEP = 0.01


def tube_scene(around: int, along: int, material: Material, duration: float, name: str) -> Scene:
    """Returns the scene: the tube's first ring is pulled along −x over a capsule.

    Part of the tube is on the limb at the start; the rest hangs in front of its end and follows.

    Args:
        around: Number of nodes in a ring.
        along: Number of rings.
        material: Material of the tube.
        duration: Duration of the pull, s.
        name: Name for tables.
    """
    x, faces = garments.tube(around, along, _RADIUS, _LENGTH)
    x = x + np.array([-_ON, 0.0, 0.0])
    held = np.arange(around, dtype=np.int32)
    limb = Obstacles.resting(
        np.array([[0.0, 0.0, 0.0]]), np.array([[-_LIMB_LENGTH, 0.0, 0.0]]), np.array([_LIMB_RADIUS])
    )
    motion = pulled(x[held], np.array([-_WAY, 0.0, 0.0]), duration)
    return Scene(name, x, faces, held, material, motion, duration, limb)


def measure(session: Session) -> Result:
    """Returns cost and accuracy over time steps, and the comparison with peers on stiff fabric."""
    around, along = (14, 20) if session.quick else (_AROUND, _ALONG)
    steps = QUICK_STEPS if session.quick else TIME_STEPS
    duration = 0.4 if session.quick else DURATION
    soft = tube_scene(around, along, SOFT, duration, "tube")
    stiff = tube_scene(around, along, STIFF, duration, "tube-stiff")
    return {
        "over_steps": over_steps(session, soft, steps),
        "peers": against_peers(session, stiff, _PEER_STEP, min(1.0, duration)),
    }


def tables(result: Result) -> list[Table]:
    """Returns both tables."""
    return [steps_table(result["over_steps"]), peers_table(result["peers"])]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes the pair of plots as in the paper; returns the files."""
    file = folder / "cloth_tube.png"
    write_figure(file, steps_panels(result["over_steps"]))
    return [file]
