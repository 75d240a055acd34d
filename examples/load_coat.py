"""Loads a garment from a file and lets it hang from two grippers: load_coat.py [jacket.obj]."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

from drake_dress import cloth


def write_jacket(path: Path) -> None:
    """Writes a jacket as tailoring software would: in cm, y up, front at +z."""
    jacket = cloth.make_coat(cloth.COATS["jacket"], spacing=0.03)
    x, y, z = 100.0 * jacket.rest_position.T
    mesh = trimesh.Trimesh(np.stack([y, z, x], axis=1), jacket.faces, process=False)
    mesh.export(path)


with TemporaryDirectory() as folder:
    path = Path(sys.argv[1] if sys.argv[1:] else f"{folder}/jacket.obj")
    if not path.exists():
        write_jacket(path)
    coat = cloth.load_garment(path, unit="cm", up="y", spacing=0.03)
for name, loop in coat.loops.items():
    ring = coat.rest_position[loop]
    girth = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).sum()
    print(f"{name}: {len(loop)} nodes, girth {100.0 * girth:.0f} cm")
elements = cloth.make_elements(coat.rest_position, coat.faces)
plant = cloth.ImplicitCloth(elements, cloth.Material(stretch_stiffness=1500.0), 0.01, coat.held)
state = cloth.ClothState.at_rest(coat.rest_position)
still = np.zeros((len(coat.held), 3))
for _ in range(50):
    state, info = plant.step(state, cloth.Obstacles.none(), still)
print(f"hem after 0.5 s: {coat.rest_position[:, 2].min() - state.x[:, 2].min():.3f} m lower")
