"""Drawn coats and robots differ."""

import numpy as np

from drake_dress.learning.motion.garment_draw import GarmentDraw
from drake_dress.models.garment.geodesics import Reach

REACH = Reach(0.45, (0.5, 0.5), (0.12, 0.12), 0.5)


def test_drawn_garments_differ_within_their_ranges() -> None:
    drawn = [GarmentDraw.drawn(np.random.default_rng(s), REACH) for s in range(30)]
    assert len({g.max_speed for g in drawn}) == 30
    assert all(0.05 <= g.max_speed <= 0.35 and 0.8 <= g.share <= 1.0 for g in drawn)
