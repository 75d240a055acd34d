"""Bodies that tests of the skin share."""

from functools import lru_cache

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin
from drake_dress.models.human.skin.skin import Skin

# The means of ANSUR II, an old woman, and a child.
MAN = Phenotype("male", 30, 1.756, 85.5)
WOMAN = Phenotype("female", 29, 1.629, 67.8)
OLD_WOMAN = Phenotype("female", 80, 1.58, 55)
BOY = Phenotype("male", 8, 1.28, 26)
PERSONS = (MAN, WOMAN, OLD_WOMAN, BOY)


@lru_cache
def skin_of(person: Phenotype) -> Skin:
    """Returns a person's skin, made once."""
    return phenotype_skin(person)


def tube(radii: FloatArray, places: FloatArray, corners: int = 48) -> tuple[FloatArray, IndexArray]:
    """Returns vertices and faces of a closed tube along z with given radii at given heights."""
    angle = 2.0 * np.pi * np.arange(corners) / corners
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.vstack(
        [
            np.column_stack([r * ring, np.full(corners, z)])
            for r, z in zip(radii, places, strict=True)
        ]
        + [[[0.0, 0.0, places[0]], [0.0, 0.0, places[-1]]]]
    )
    faces, last = [], len(vertices)
    for i in range(corners):
        j = (i + 1) % corners
        faces += [[last - 2, j, i]]
        for k in range(len(places) - 1):
            a, b, c, d = (k * corners + x for x in (i, j, corners + i, corners + j))
            faces += [[a, b, d], [a, d, c]]
        top = (len(places) - 1) * corners
        faces += [[top + i, top + j, last - 1]]
    return vertices, np.array(faces)
