"""Arranges the blend shapes by the corners of the macro parameters that they belong to.

MakeHuman's shapes are multilinear: the weight of a shape is the product of one hat function for
each parameter in its name. Parameters that the package leaves at their mean are summed up here.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from drake_dress.learning.body.source import Source
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.skin.macro import AGES, MUSCLES, SEXES, WEIGHTS

_ORIGINS = ("african", "asian", "caucasian")
_BREAST = "averagecup-averagefirmness"


def corner_shapes(source: Source) -> dict[str, FloatArray]:
    """Returns `base`, `height` and `proportions`, each (2,4,3,3,n+B,3), m.

    Their first axes are sex, age, muscle and weight. `base` is the displacement at mean height and
    proportions; `height` is that from the smallest to the greatest height; `proportions` is that
    from ideal to uncommon ones.
    """
    shapes = dict(zip(source.labels, source.shapes, strict=True))
    counts = (len(SEXES), len(AGES), len(MUSCLES), len(WEIGHTS))
    arrays = {
        name: np.zeros((*counts, *source.position.shape))
        for name in ("base", "height", "proportions")
    }
    for index in product(*map(range, counts)):
        sex, age = SEXES[index[0]], AGES[index[1]]
        muscle, weight = MUSCLES[index[2]], WEIGHTS[index[3]]
        corner = f"{sex}-{age}-{muscle}-{weight}"
        arrays["base"][index] = shapes[f"universal:{corner}"]
        for origin in _ORIGINS:
            arrays["base"][index] += shapes[f"race:{origin}-{sex}-{age}"] / len(_ORIGINS)
        arrays["base"][index] += shapes.get(f"breast:{corner}-{_BREAST}", 0.0)
        for name, words in (
            ("height", ("minheight", "maxheight")),
            ("proportions", ("idealproportions", "uncommonproportions")),
        ):
            middle, difference = _pair(shapes, [f"{name}:{corner}-{word}" for word in words])
            arrays["base"][index] += middle
            arrays[name][index] = difference
    return arrays


def _pair(
    shapes: Mapping[str, FloatArray], labels: list[str]
) -> tuple[FloatArray | float, FloatArray | float]:
    """Returns mean and difference of two shapes; zero if there are none (babies)."""
    if labels[0] not in shapes:
        return 0.0, 0.0
    low, high = (shapes[label] for label in labels)
    return 0.5 * (low + high), high - low
