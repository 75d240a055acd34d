from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.cloth.contact.detection import find_proximity, out_of_reach
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles


@given(st.integers(0, 10_000), st.floats(0.0, 0.5))
@settings(max_examples=60, deadline=None)
def test_what_is_out_of_reach_is_as_far_as_asked(seed, distance):
    rng = np.random.default_rng(seed)
    x = rng.uniform(-0.3, 0.3, (20, 3)) + rng.uniform(-1.5, 1.5, 3)
    ends = rng.uniform(-0.5, 0.5, (2, 3, 3))
    bodies = Obstacles.resting(ends[0], ends[1], rng.uniform(0.02, 0.2, 3))
    plane = HalfSpaces.resting(rng.uniform(-2.0, 2.0, 3), rng.standard_normal(3))
    bodies = replace(bodies, half_spaces=plane)
    gap = find_proximity(x, bodies, 0.0).gap
    if out_of_reach(x, bodies, distance):
        assert gap.min() > distance
    if gap.min() <= distance:
        assert not out_of_reach(x, bodies, distance)
    assert out_of_reach(x, Obstacles.none(), distance)
