"""A piece of cloth that effects act on."""

from collections.abc import Sequence

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray, IntArray
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.scheme import Scheme
from drake_dress.models.effects.composition import GarmentWithEffects
from drake_dress.models.effects.effect import Effect, Sheet

STEP = 0.002
MATERIAL = Material(0.3, 600.0, 3e-3, 0.003, 0.3, 0.003)


def sheet_mesh(
    columns: int = 6, rows: int = 8, spacing: float = 0.04
) -> tuple[FloatArray, IntArray]:
    """Returns (n,3) a vertical sheet in the plane y = 0, top at z = 0, and its faces."""
    i, k = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    x = np.stack([i * spacing, np.zeros_like(i, dtype=float), -k * spacing], axis=2)
    a = (i[:-1, :-1] * rows + k[:-1, :-1]).ravel()
    faces = np.concatenate(
        [np.stack([a, a + rows, a + 1], 1), np.stack([a + rows, a + rows + 1, a + 1], 1)]
    )
    return x.reshape(-1, 3), faces


def sheet() -> Sheet:
    x, faces = sheet_mesh()
    warp = np.tile([0.0, 0.0, -1.0], (len(faces), 1))
    return Sheet(make_elements(x, faces), x, warp)


def cloth(
    effects: Sequence[Effect],
    held: Sequence[int] | IndexArray = (),
    step: float = STEP,
    material: Material = MATERIAL,
    mesh: tuple[FloatArray, IntArray] | None = None,
) -> GarmentWithEffects:
    """Returns a garment with effects, of a sheet held at nodes."""
    x, faces = mesh or sheet_mesh()
    scheme = Scheme(np.asarray(held, dtype=np.int32), step, ImplicitSettings(1e-8, 300))

    warp = np.tile([0.0, 0.0, -1.0], (len(faces), 1))
    return GarmentWithEffects(x, faces, warp, material, effects, scheme)
