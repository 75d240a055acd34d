"""A plant's garment with layers, by either integrator."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.layers.scenes import two_sheets


@pytest.mark.parametrize("integrator", ["implicit", "projective"])
def test_a_sheet_that_falls_on_another_lies_on_it(integrator: str) -> None:
    x, e, rim, _ = two_sheets(9, 0.03, 0.012)
    material = Material(damping=0.01)
    plain = (
        ImplicitCloth(e, material, 0.01, rim)
        if integrator == "implicit"
        else ProjectiveDynamicsCloth(
            e, material, 0.01, rim, settings=ProjectiveSettings(quasi_newton=True)
        )
    )
    still = np.zeros((len(rim), 3))
    through = []
    for cloth in (LayeredCloth(plain), plain):
        state = ClothState.at_rest(x)
        crossed = 0
        for _ in range(30):
            state, _ = cloth.step(state, Obstacles.none(), still)
            crossed = max(crossed, len(piercing_edges(state.x, e)))
        through.append(crossed)
        assert np.isfinite(state.x).all()
    layered, without = through
    assert without > 0
    assert layered == 0


def test_what_is_pinched_makes_room_for_itself() -> None:
    # as an armpit: two bodies close until they overlap by 2 mm, with two sheets between them
    x, e, rim, _ = two_sheets(9, 0.03, 0.012)
    h, closing = 0.01, 0.1
    nothing, still = np.zeros(0, dtype=rim.dtype), np.zeros((0, 3))
    cloth = LayeredCloth(ImplicitCloth(e, Material(damping=0.01), h, nothing))
    state = ClothState.at_rest(x)
    height = float(x[:, 2].mean()) + np.array([-0.02, 0.02])
    normal = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    while height[1] - height[0] > -2e-3:
        point, velocity = np.zeros((2, 2, 3))
        point[:, 2], velocity[:, 2] = height, [closing, -closing]
        jaws = HalfSpaces(point, normal, velocity, np.zeros((2, 3)))
        bodies = replace(Obstacles.none(), half_spaces=jaws)
        state, _ = cloth.step(state, bodies, still)
        height += h * velocity[:, 2]
        assert len(piercing_edges(state.x, e)) == 0
        # no deeper than the bodies overlap and two layers are thick
        assert max(height[0] - state.x[:, 2].min(), state.x[:, 2].max() - height[1]) < 4e-3
