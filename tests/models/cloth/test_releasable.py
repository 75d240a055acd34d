"""A garment that is let go."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.releasable import ReleasableCloth
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.sheets import sheet

X, FACES = sheet(6, 6, 0.05)
ELEMENTS = make_elements(X, FACES)
H, HELD = 0.01, np.array([0, 5], dtype=np.int32)
STILL = np.zeros((2, 3))
WEIGHT = 0.3 * 0.25**2 * 9.81  # N


def holding(held: IntArray) -> ImplicitCloth:
    return ImplicitCloth(ELEMENTS, Material(), H, held)


def test_while_it_is_held_it_steps_as_ever() -> None:
    alone, both = holding(HELD), ReleasableCloth(holding, HELD)
    a = b = ClothState.at_rest(X)
    for _ in range(20):
        a, _ = alone.step(a, Obstacles.none(), STILL)
        b, _ = both.step(b, Obstacles.none(), STILL)
    for name, value in vars(a).items():
        np.testing.assert_array_equal(getattr(b, name), value)


def test_let_go_it_falls_freely() -> None:
    cloth = ReleasableCloth(holding, HELD)
    state = ClothState.at_rest(X)
    for _ in range(100):
        state, _ = cloth.step(state, Obstacles.none(), STILL)
    momentum = cloth.mass @ state.v
    for k in range(1, 30):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((0, 3)))
        expected = momentum + k * H * cloth.mass.sum() * cloth.gravity
        # the first step still has the factor without the held nodes, so its end is less exact
        np.testing.assert_allclose(cloth.mass @ state.v, expected, atol=2e-3 * WEIGHT * H)
        assert not state.reaction.any()
