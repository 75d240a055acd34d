"""A plant's garment with layers, by either integrator."""

import numpy as np
import pytest

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit import ClothState, ImplicitCloth
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective_dynamics import ProjectiveDynamicsCloth
from tests.models.cloth.layers.scenes import two_sheets


@pytest.mark.parametrize("integrator", ["implicit", "projective"])
def test_a_sheet_that_falls_on_another_lies_on_it(integrator: str) -> None:
    x, e, rim, upper = two_sheets(9, 0.03, 0.012)
    material = Material(damping=0.01)
    plain = (
        ImplicitCloth(e, material, 0.01, rim)
        if integrator == "implicit"
        else ProjectiveDynamicsCloth(e, material, 0.01, rim, quasi_newton=True)
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
