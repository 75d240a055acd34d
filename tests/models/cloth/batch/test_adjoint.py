"""The derivative of a batch's step against finite differences and against a garment alone."""

from collections.abc import Callable

import numpy as np
import pytest

from drake_dress.models.cloth.batch.cloth import BatchCloth, Fabric
from drake_dress.models.cloth.batch.tape import ContactTypes, Tape
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import FloatArray
from drake_dress.models.cloth.filtered_cg import FREE, SLIP, STICK
from tests.models.cloth.batch.scenes import (
    FABRICS,
    Batch,
    in_the_air,
    landing,
    relative,
)
from tests.models.cloth.sheets import NO_NODES, sheet_elements

FABRIC_FIELDS = ("stretch_stiffness", "bending_stiffness", "surface_density", "friction")


def _bars(scene: Batch) -> list[FloatArray]:
    rng = np.random.default_rng(7)
    sizes = ((scene.x, 1.0), (scene.v, scene.h), (scene.motion, 1e-3))
    return [scale * rng.normal(size=a.shape) for a, scale in sizes]


@pytest.mark.parametrize("h", [0.01, 0.1])
def test_derivative_of_a_contact_step_matches_finite_differences(h: float, device: str) -> None:
    """By state, motion of the grippers and fabric, contact types held."""
    scene = landing(h)
    rng = np.random.default_rng(5)
    cloth = scene.cloth(device, FABRICS)
    bars = _bars(scene)
    point = {"x": scene.x, "v": scene.v, "motion": scene.motion}
    for name in FABRIC_FIELDS:
        point[name] = np.array([getattr(m, name) for m in FABRICS])

    def step(at: dict[str, FloatArray], types: ContactTypes | None) -> tuple[FloatArray, Tape]:
        fabric = Fabric(*(at[name] for name in FABRIC_FIELDS))
        x, v, r, tape = cloth.step(at["x"], at["v"], at["motion"], scene.obstacles, types, fabric)
        outputs = (x, v, r[:, cloth.held])
        # per garment, so that one cannot hide behind another
        return sum(np.sum(b * y, axis=(1, 2)) for b, y in zip(bars, outputs, strict=True)), tape

    _, tape = step(point, None)
    types = tape.types
    for g in (0, 1):
        assert {FREE, STICK, SLIP} == set(types.mode[g][types.owner[g] >= 0])
    gradient = cloth.vector_jacobian_product(tape, *bars, by_fabric=True)
    slopes = {"x": gradient.x, "v": gradient.v, "motion": gradient.held_motion}
    slopes |= {name: getattr(gradient, name) for name in FABRIC_FIELDS}
    for name, slope in slopes.items():
        numeric, exact = [], []
        for _ in range(2 if slope.ndim == 3 else 1):
            d = rng.normal(size=slope.shape) if slope.ndim == 3 else point[name]
            small = 1e-8 if slope.ndim == 3 else 1e-5
            high, low = (
                step({**point, name: point[name] + s * small * d}, types)[0] for s in (1, -1)
            )
            numeric.append((high - low) / (2 * small))
            exact.append((slope * d).reshape(3, -1).sum(axis=1))
        a, b = np.array(numeric), np.array(exact)
        # the last garment touches nothing: its friction has no say
        for g in range(3 if name != "friction" else 2):
            assert relative(b[:, g], a[:, g]) < 1e-3, (name, g)
    assert gradient.friction[2] == 0.0


@pytest.mark.parametrize(("make", "h"), [(in_the_air, 0.02), (landing, 0.03)])
def test_derivative_is_that_of_the_garment_alone(
    make: Callable[[float], Batch], h: float, device: str
) -> None:
    scene = make(h)
    cloth, bars = scene.cloth(device, FABRICS), _bars(scene)
    *_, tape = cloth.step(scene.x, scene.v, scene.motion, scene.obstacles)
    gradient = cloth.vector_jacobian_product(tape, *bars, by_fabric=True)
    for g, fabric in enumerate(FABRICS):
        alone = scene.alone(fabric)
        *_, own = alone.step(scene.x[g], scene.v[g], scene.motion[g], scene.obstacles[g])
        own_bars = tuple(b[g] for b in bars)
        expected = alone.vector_jacobian_product(own, *own_bars, by_material=True)
        # A garment alone differences its stiffness along v on one side and over a shorter way.
        for name, bound in (("x", 1e-6), ("v", 1e-9), ("held_motion", 1e-9)):
            assert relative(getattr(gradient, name)[g], getattr(expected, name)) < bound, name
        for name in FABRIC_FIELDS:
            own_value = expected.material[name]
            assert getattr(gradient, name)[g] == pytest.approx(own_value, rel=1e-7), name


def test_fabric_does_not_matter_in_free_fall(device: str) -> None:
    rest, e = sheet_elements(8, 8, 0.03)
    x, v, nothing = np.stack([rest, rest]), np.zeros((2, 64, 3)), np.zeros((2, 0, 3))
    cloth = BatchCloth(e, FABRICS[0], 0.02, NO_NODES, 2, device)
    *_, tape = cloth.step(x, v, nothing, Obstacles.none())
    down = np.tile([0.0, 0.0, 1.0], (2, 64, 1))
    gradient = cloth.vector_jacobian_product(tape, down, down, nothing, by_fabric=True)
    np.testing.assert_allclose(gradient.v[..., 2].mean(axis=1), 1.02, rtol=1e-9)
    for name in FABRIC_FIELDS:
        np.testing.assert_allclose(getattr(gradient, name), 0.0, atol=1e-9)
