"""Cloth that arrives at a body stops at its surface, and nothing acts on cloth that does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.mujoco_cloth import MujocoCloth
from drake_dress.models.cloth.state import GRAVITY, ClothState
from tests.models.cloth.mujoco.test_mujoco_cloth import NOTHING, H, capsule, points_of
from tests.models.cloth.sheets import NO_NODES, sheet_elements

FABRIC = Material(stretch_stiffness=1500.0, damping=0.003)
X, ELEMENTS = sheet_elements(8, 8, 0.03)


def above(gap: float, speed: float) -> ClothState:
    """Returns a sheet with its middle at a distance from the capsule, m, that falls at a speed."""
    x = X - X.mean(axis=0) + [0.0, 0.0, 0.1 + gap]
    return replace(ClothState.at_rest(x), v=np.tile([0.0, 0.0, -speed], (len(x), 1)))


@pytest.mark.parametrize("speed", [0.3, 0.6, 1.0])
def test_cloth_that_arrives_stops_at_the_margin(speed: float) -> None:
    cloth, state = MujocoCloth(ELEMENTS, FABRIC, H, NO_NODES), above(0.0171, speed)
    gaps = []
    for _ in range(25):
        state, _ = cloth.step(state, capsule(), NOTHING)
        gaps.append(find_proximity(points_of(cloth, state.x), capsule(), 0.0).gap.min())
    assert state.reaction.any()
    assert min(gaps) > FABRIC.margin - 1e-3


def test_nothing_acts_on_cloth_that_will_not_arrive() -> None:
    """6 mm above the margin at 0.5 m/s, it does not arrive within the step."""
    cloth = MujocoCloth(ELEMENTS, FABRIC, H, NO_NODES, np.zeros(3))
    state, info = cloth.step(above(FABRIC.margin + 0.006, 0.5), capsule(), NOTHING)
    assert info.contacts, "they are foreseen"
    assert not state.reaction.any()
    np.testing.assert_allclose(state.v, np.tile([0.0, 0.0, -0.5], (len(X), 1)), atol=1e-9)


def test_cloth_at_rest_stays_at_rest() -> None:
    """Once it lies, contact takes as much speed from its nodes in a step as gravity gives them."""
    cloth, state = MujocoCloth(ELEMENTS, FABRIC, H, NO_NODES), above(0.01, 0.0)
    for _ in range(100):
        before, (state, _) = state, cloth.step(state, capsule(), NOTHING)
    assert np.abs(state.v - before.v).max() < -GRAVITY[2] * H
