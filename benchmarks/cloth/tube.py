"""A cloth tube is pulled along a limb: contact all round, sliding, as in a sleeve."""

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

# 36 · 50 = 1,800 nodes at about a centimetre.
_AROUND, _ALONG = 36, 50
_RADIUS, _LENGTH = 0.05, 0.5
# With the margin of contact there are 2 mm of air between limb and tube.
_LIMB_RADIUS, _LIMB_LENGTH = 0.045, 0.7
# How far the held ring is on the limb at the start, and how far it is pulled, m.
_ON, _WAY = 0.2, 0.35
DURATION = 1.5
_PEER_STEP = 0.01


def tube_scene(around: int, along: int, material: Material, duration: float, name: str) -> Scene:
    """Returns the scene: the tube's first ring is led along −x over a capsule.

    Part of the tube is on the limb from the start, the rest hangs before its end and follows.

    Args:
        around: nodes of a ring.
        along: rings.
        material: of the tube.
        duration: of the pull, s.
        name: for tables.
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
    """Returns cost and accuracy over time steps, and peers on a stiff fabric."""
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
    """Writes the paper's pair of plots; returns the files."""
    file = folder / "cloth_tube.png"
    write_figure(file, steps_panels(result["over_steps"]))
    return [file]
