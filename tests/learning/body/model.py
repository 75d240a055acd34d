"""A body model of a few vertices that has the labels and bones of the real one."""

from itertools import product

import numpy as np

from drake_dress.learning.body.source import Source
from drake_dress.models.human.skin.macro import AGES, MUSCLES, SEXES, WEIGHTS

BONES = (
    "root", "spine01", "neck01", "head", "jaw", "upperarm01.L", "lowerarm01.L", "wrist.L",
    "finger1-2.L", "finger2-1.L", "finger3-1.L", "finger5-1.L", "upperleg01.L", "lowerleg01.L",
    "foot.L", "upperarm01.R",
)  # fmt: skip


def labels() -> list[str]:
    """Returns the labels of all blend shapes of the real model, newborns left out."""
    names = []
    for sex, age, muscle, weight in product(SEXES, AGES, MUSCLES, WEIGHTS):
        corner = f"{sex}-{age}-{muscle}-{weight}"
        names.append(f"universal:{corner}")
        names += [f"height:{corner}-{word}height" for word in ("min", "max")]
        if age != "baby":
            names += [f"proportions:{corner}-{w}proportions" for w in ("ideal", "uncommon")]
        if age != "baby" and sex == "female":
            names.append(f"breast:{corner}-averagecup-averagefirmness")
    for origin, sex, age in product(("african", "asian", "caucasian"), SEXES, AGES):
        names.append(f"race:{origin}-{sex}-{age}")
    return names


def small_model() -> Source:
    """Returns an octahedron with these bones: three vertices of four are on y = 0."""
    rng = np.random.default_rng(0)
    vertices = np.array(
        [[1, 0, 0], [0, 0, 1], [-1, 0, 0], [0, 0, -1], [0, 1, 0], [0, -1, 0]], dtype=float
    )
    half = [[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]]
    faces = np.array(half + [[a, c, 5] for a, _, c in half])
    heads = rng.normal(size=(len(BONES), 3))
    names = labels()
    shapes = 0.01 * rng.normal(size=(len(names), len(vertices) + len(heads), 3))
    shapes[:, :4, 1] = 0.0
    shapes[:, 5] = shapes[:, 4] * [1.0, -1.0, 1.0]
    weights = np.zeros((6, len(BONES)))
    for vertex, bone in enumerate(("jaw", "head", "spine01", "foot.L", "wrist.L", "upperarm01.R")):
        weights[vertex, BONES.index(bone)] = 1.0
    return Source(np.vstack([vertices, heads]), shapes, tuple(names), faces, BONES, weights)
