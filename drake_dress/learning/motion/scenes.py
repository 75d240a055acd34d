"""The sequence of a kind that a seed draws."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.dressed_scene import DressedScene
from drake_dress.learning.motion.free_scene import FreeScene
from drake_dress.learning.motion.sequence import KINDS, Kind, Sequence


def make_sequence(kind: Kind, seed: int, number: int) -> Sequence:
    """Returns sequence `number` of a kind, of the data that `seed` draws."""
    rng = np.random.default_rng((seed, KINDS.index(kind), number))
    if kind == "free":
        return FreeScene(rng).run()
    return DressedScene(kind == "active", rng).run()
