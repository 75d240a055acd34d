"""Compares where a coat may be held: how much of its armhole is seen from in front of it.

    python -m benchmarks.hold

Coats of the parametric cuts hang from two grippers at rest, held beside the shoulder tips or at the
edges of their opening, which are spread. From a grid of points in front of the left armhole, where
a hand comes from, the share that sees most of the opening is told (models/dressing/sight.py).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

from benchmarks.cloth.table import Table
from drake_dress.diagrams.scenario.coat import coat_parameters
from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.dressing.sight import free_sight
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.geodesics import reach
from drake_dress.models.garment.hold import held_at_edges
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES

# Edge length of the meshes, m, fabric, time step, s, and steps until the coat hangs still.
_SPACING = 0.035
_FABRIC = Material(surface_density=0.3, stretch_stiffness=1000.0, bending_stiffness=1.5e-3)
_STEP, _STEPS = 0.05, 100
_SOLVE = ExplicitSettings(tolerance=1e-2, iterations=12)
# Distance of the grippers that hold the edges, as a share of the way over the cloth.
_SPREAD = 0.9
# Points before the armhole's centre, m: forward, inward and up.
_FORWARD, _INWARD = np.arange(0.2, 0.55, 0.05), np.arange(-0.2, 0.5, 0.05)
_UP = (-0.06, 0.0, 0.06)
# Share of the opening that counts as seen.
_SEEN = 0.8
DEPTHS = (0.2, 0.4, 0.6, 0.8)


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="XL", help="of the coats; XL")
    parser.add_argument("--size-table", default="women", help="of the coats; women")
    options = parser.parse_args(arguments)
    cuts = [name for name, cut in COATS.items() if cut.opens == "front"]
    header = ["cut", "shoulders", *(f"edges, {depth:g} deep" for depth in DEPTHS)]
    rows = []
    for name in cuts:
        coat = Coat(preset=name, size=options.size, size_table=options.size_table)
        mesh = make_coat(coat_parameters(coat), _SPACING)
        held = [mesh, *(held_at_edges(mesh, depth, "bench") for depth in DEPTHS)]
        rows.append([name, *(seen_from(each) for each in held)])
        print(f"{len(rows)}/{len(cuts)} {name}", file=sys.stderr, flush=True)
    title = "Share of points in front that see the armhole"
    print(Table(title, header, rows).text())
    return 0


def seen_from(mesh: GarmentMesh) -> float:
    """Returns the share of the points in front from which most of the left armhole is seen."""
    x, loop = hung(mesh), np.asarray(mesh.loops["left_armhole"])
    center = x[loop].mean(axis=0)
    seen = [
        max(
            free_sight(x, mesh.faces, loop, center + np.array([forward, -inward, up])) for up in _UP
        )
        for forward in _FORWARD
        for inward in _INWARD
    ]
    return float(np.mean(np.array(seen) > _SEEN))


def hung(mesh: GarmentMesh) -> FloatArray:
    """Returns the nodes (n,3), m, of a garment that hangs from two grippers, spread by its hold."""
    x = mesh.rest_position.copy()
    left, right = (x[mesh.grasp[side]].mean(axis=0) for side in SIDES)
    apart = float(np.linalg.norm(left - right))
    further = 0.0
    if mesh.hold == "edges":
        further = max(0.0, _SPREAD * reach(mesh).between_grippers - apart)
    cloth = ExplicitBiasCloth(
        make_elements(x, mesh.faces), _FABRIC, _STEP, mesh.held, settings=_SOLVE
    )
    way = 0.5 * further * (left - right) / (apart * _STEPS)
    counts = [len(mesh.grasp[side]) for side in SIDES]
    motion = np.repeat(np.stack([way, -way]), counts, axis=0)
    v = np.zeros_like(x)
    for moves in (motion, 0.0 * motion):
        for _ in range(_STEPS):
            x, v, _, _ = cloth.step(x, v, moves, Obstacles.none())
    return x


if __name__ == "__main__":
    sys.exit(main())
