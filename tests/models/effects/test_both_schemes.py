"""Effects act alike in the two schemes that simulate a plant."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitSettings
from drake_dress.models.cloth.projective.projective_dynamics import ProjectiveSettings
from drake_dress.models.cloth.scheme import Scheme
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.effects.air import AirDrag
from drake_dress.models.effects.composition import GarmentWithEffects
from drake_dress.models.effects.contact import Adhesion, VelocityDependentFriction
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.fabric import (
    AnisotropicStiffness,
    InternalDamping,
    StrainStiffening,
)
from drake_dress.models.effects.mass import GravityTilt, LocalMass
from tests.models.effects.scene import MATERIAL, sheet_mesh

SCHEMES = ("implicit", "projective")
SOFT = replace(MATERIAL, stretch_stiffness=60.0)


def swung(
    effects: Sequence[Effect], scheme: str, duration: float = 0.3, step: float = 1e-3
) -> FloatArray:
    """Returns a sheet that hangs from its top row, after the row has been drawn aside."""
    x, faces = sheet_mesh()
    top = np.flatnonzero(x[:, 2] == 0.0).astype(np.int32)

    settings: ImplicitSettings | ProjectiveSettings = ImplicitSettings(1e-6, 200)
    if scheme == "projective":
        settings = ProjectiveSettings(1e-7, quasi_newton=True, predicted=True)
    make = Scheme(top, step, settings)
    warp = np.tile([0.0, 0.0, -1.0], (len(faces), 1))
    garment = GarmentWithEffects(x, faces, warp, SOFT, effects, make)
    state = ClothState.at_rest(x)
    for k in range(round(duration / step)):
        speed = 0.8 * np.sin(np.pi * (k * step / duration)) ** 2
        motion = np.tile([0.0, speed, 0.3 * speed], (len(top), 1))
        state, _ = garment.step(state, Obstacles.none(), motion)
    return state.x


@pytest.mark.parametrize(
    "effects",
    [
        [AirDrag(coefficient=5.0)],
        [AnisotropicStiffness(warp=100.0)],
        [StrainStiffening(rate=100.0)],
        [InternalDamping(added=0.02)],
        [GravityTilt(about_x=0.2)],
        [LocalMass(mass=0.1, x=0.1, z=-0.25)],
    ],
    ids=lambda e: e[0].NAME,
)
def test_an_effect_moves_a_swung_sheet_alike(effects: Sequence[Effect]) -> None:
    changes = [swung(effects, scheme) - swung([], scheme) for scheme in SCHEMES]
    size = np.abs(changes[0]).max()
    assert size > 5e-4
    assert np.abs(changes[0] - changes[1]).max() < 0.15 * size


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    "effect", [Adhesion(strength=10.0), VelocityDependentFriction(rate=5.0)], ids=lambda e: e.NAME
)
def test_contact_effects_slow_a_sheet_that_slides(
    scheme: str, effect: Adhesion | VelocityDependentFriction
) -> None:
    x, faces = sheet_mesh(4, 4)
    x = np.stack([x[:, 0], -x[:, 2], np.full(len(x), MATERIAL.margin)], axis=1)
    none = np.zeros(0, dtype=np.int32)
    step = 2e-3

    settings: ImplicitSettings | ProjectiveSettings = ImplicitSettings(1e-8)
    if scheme == "projective":
        settings = ProjectiveSettings(1e-7, quasi_newton=True)
    make = Scheme(none, step, settings)
    warp = np.tile([0.0, 1.0, 0.0], (len(faces), 1))
    garment = GarmentWithEffects(x, faces[:, ::-1], warp, MATERIAL, [effect], make)
    v = np.tile([0.5, 0.0, 0.0], (len(x), 1))
    state = ClothState(
        x, v, *(getattr(ClothState.at_rest(x), n) for n in ("mode", "reaction", "owner"))
    )
    speeds = [0.5]
    for _ in range(20):
        state, _ = garment.step(state, Obstacles.floor(), np.zeros((0, 3)))
        speeds.append(float(state.v[:, 0].mean()))
    g, rho, t = 9.81, MATERIAL.surface_density, 20 * step
    mu = MATERIAL.friction
    if isinstance(effect, Adhesion):
        expected = 0.5 - mu * (g + effect.strength / rho) * t
    else:
        # dv/dt = −g (μ + c v)
        c = effect.rate
        expected = (0.5 + mu / c) * np.exp(-g * c * t) - mu / c
    assert speeds[-1] == pytest.approx(max(expected, 0.0), abs=0.03)
    assert all(b <= a + 1e-9 for a, b in itertools.pairwise(speeds))
