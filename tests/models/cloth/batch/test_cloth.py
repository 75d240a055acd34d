"""A batch against its garments one by one, and what must hold for batches alone."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.cloth.batch.cloth import BatchCloth
from drake_dress.models.cloth.batch.tape import ContactTypes
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles, Solid
from drake_dress.models.cloth.contact.signed_distance import SignedDistanceField
from drake_dress.models.cloth.filtered_cg import FREE, SLIP, STICK
from drake_dress.models.cloth.material import Material
from tests.models.cloth.batch.scenes import (
    FABRICS,
    HELD,
    Batch,
    in_the_air,
    landing,
    on_limbs,
    relative,
)
from tests.models.cloth.sheets import NO_NODES, sheet_elements


@pytest.mark.parametrize("h", [0.001, 1.0])
def test_free_fall_is_exact_at_every_step_size(h: float, device: str) -> None:
    rest, e = sheet_elements(8, 8, 0.03)
    cloth = BatchCloth(e, Material(), h, NO_NODES, 2, device)
    x = start = np.stack([rest, rest + 0.3])
    v, nothing = np.zeros_like(x), np.zeros((2, 0, 3))
    for _ in range(5):
        x, v, _, _ = cloth.step(x, v, nothing, Obstacles.none())
    fall = np.broadcast_to([0.0, 0.0, -0.5 * 9.81 * (5 * h) ** 2], x.shape)
    np.testing.assert_allclose(x - start, fall, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(v[..., 2], -9.81 * 5 * h, rtol=1e-9)


@pytest.mark.parametrize("fabrics", [(FABRICS[0],) * 3, FABRICS], ids=["one", "three"])
def test_garment_in_the_air_moves_as_it_does_alone(
    fabrics: tuple[Material, ...], device: str
) -> None:
    scene = in_the_air(0.02)
    x, v = scene.x, scene.v
    cloth = scene.cloth(device, fabrics if len(set(fabrics)) > 1 else fabrics[0])
    for _ in range(3):
        outcome = cloth.step(x, v, scene.motion, scene.obstacles)
        for g, fabric in enumerate(fabrics):
            _is_as_alone(scene, outcome, (x, v), g, fabric, bound=1e-10)
        x, v = outcome[:2]


@pytest.mark.parametrize(
    ("make", "h"),
    [(on_limbs, 0.01), (landing, 0.01), (landing, 0.03), (landing, 0.1), (landing, 1.0)],
)
def test_garment_in_contact_moves_as_it_does_alone(
    make: Callable[[float], Batch], h: float, device: str
) -> None:
    scene = make(h)
    outcome = scene.cloth(device, FABRICS).step(scene.x, scene.v, scene.motion, scene.obstacles)
    types = outcome[3].types
    for g, fabric in enumerate(FABRICS):
        _is_as_alone(scene, outcome, (scene.x, scene.v), g, fabric, bound=1e-6)
    for g in (0, 1):
        assert {FREE, STICK, SLIP} == set(types.mode[g][types.owner[g] >= 0])
    assert np.all(types.owner[2] == -1)


def test_node_meets_what_is_first_on_its_way(device: str) -> None:
    """A sheet below a limb is thrown to the floor: the limb is nearest at first."""
    rest, e = sheet_elements(16, 18, 0.03)
    limb = np.array([[0.0, 0.2, 0.05], [0.5, 0.3, 0.05]])
    obstacles = replace(
        Obstacles.floor(-0.07), a=limb[:1], b=limb[1:], radius=np.array([0.02]), **_at_rest(1)
    )
    thrown = np.tile([1.0, 0.5, -6.0], (2, len(rest), 1))
    motion = np.tile(0.02 * thrown[0, 0], (2, len(HELD), 1))
    scene = Batch(e, 0.02, np.stack([rest, rest + 0.01]), thrown, motion, (obstacles,) * 2)
    outcome = scene.cloth(device).step(scene.x, scene.v, scene.motion, scene.obstacles)
    for g in range(2):
        _is_as_alone(scene, outcome, (scene.x, scene.v), g, FABRICS[0], bound=1e-6)
        nearest = find_proximity(scene.x[g], obstacles, 0.0).owner
        assert np.sum((nearest == 0) & (outcome[3].types.owner[g] == 1)) > 50


def _at_rest(limbs: int) -> dict[str, np.ndarray]:
    return {"velocity": np.zeros((limbs, 3)), "angular_velocity": np.zeros((limbs, 3))}


def _is_as_alone(
    scene: Batch,
    outcome: tuple,
    state: tuple[np.ndarray, np.ndarray],
    g: int,
    fabric: Material,
    bound: float,
) -> None:
    (x, v), (x1, v1, r1, tape) = state, outcome
    *expected, own = scene.alone(fabric).step(x[g], v[g], scene.motion[g], scene.obstacles[g])
    owner, mode, velocity_mode = np.full(len(x[g]), -1), own.mode, np.zeros(len(x[g]))
    owner[own.contacts.nodes] = own.contacts.owner
    velocity_mode[own.contacts.nodes] = own.friction.velocity_mode
    np.testing.assert_array_equal(tape.types.owner[g], owner)
    np.testing.assert_array_equal(tape.mode[g], mode)
    np.testing.assert_array_equal(tape.types.velocity_mode[g], velocity_mode)
    assert relative(x1[g] - x[g], expected[0] - x[g]) < bound
    assert relative(v1[g], expected[1]) < bound
    assert relative(r1[g], expected[2]) < bound


@pytest.mark.parametrize("h", [0.01, 1.0])
def test_step_with_its_contact_held_is_the_same_step(h: float, device: str) -> None:
    """Also where the corrections of types come to their limit, as they do at 1 s."""
    scene = landing(h)
    cloth = scene.cloth(device, FABRICS)
    found = cloth.step(scene.x, scene.v, scene.motion, scene.obstacles)
    held = cloth.step(scene.x, scene.v, scene.motion, scene.obstacles, found[3].types)
    for a, b in zip(found[:3], held[:3], strict=True):
        assert relative(a, b) < 1e-9


def test_sliding_that_friction_ends_within_a_step_ends_in_rest(device: str) -> None:
    scene = landing(0.01)
    _, v, _, tape = scene.cloth(device, FABRICS).step(
        scene.x, scene.v, scene.motion, scene.obstacles
    )
    types = tape.types
    stopped = (types.mode == SLIP) & (types.velocity_mode == STICK)
    assert np.any(stopped)
    for g in range(3):
        o, owner = scene.obstacles[g], types.owner[g][stopped[g]]
        u, w = (a[owner] for a in o.twists())
        surface = u + np.cross(w, scene.x[g][stopped[g]] - o.origins()[owner])
        np.testing.assert_allclose(v[g][stopped[g]], surface, atol=1e-12)


def test_one_set_of_obstacles_serves_all_garments(device: str) -> None:
    scene = on_limbs(0.01)
    cloth = scene.cloth(device)
    shared = cloth.step(scene.x, scene.v, scene.motion, scene.obstacles[1])
    each = cloth.step(scene.x, scene.v, scene.motion, (scene.obstacles[1],) * 3)
    for a, b in zip(shared[:3], each[:3], strict=True):
        np.testing.assert_array_equal(a, b)


def test_garment_does_not_depend_on_its_batch_nor_on_the_run(device: str) -> None:
    """Bit for bit, forward and adjoint, for batches that share threads and one that does not."""
    scene = landing(0.01, batch=5)
    rng = np.random.default_rng(4)
    bars = [rng.normal(size=a.shape) for a in (scene.x, scene.v, scene.motion)]

    def outcome(garments: list[int]) -> list[np.ndarray]:
        part = scene.part(garments)
        cloth = part.cloth(device, tolerance=1e-4)
        *state, tape = cloth.step(part.x, part.v, part.motion, part.obstacles)
        g = cloth.vector_jacobian_product(tape, *(b[garments] for b in bars), by_fabric=True)
        return [*state, g.x, g.v, g.held_motion, g.stretch_stiffness, g.friction]

    together = outcome(list(range(5)))
    for a, b in zip(together, outcome(list(range(5))), strict=True):
        np.testing.assert_array_equal(a, b)
    for garments in ([0], [4], [1, 3], [0, 2, 3, 4]):
        for a, b in zip(together, outcome(garments), strict=True):
            np.testing.assert_array_equal(a[garments], b)


def test_finer_tolerance_comes_closer() -> None:
    scene = on_limbs(0.01)
    exact = scene.cloth(tolerance=1e-12).step(scene.x, scene.v, scene.motion, scene.obstacles)[0]
    errors = []
    for tolerance in (1e-2, 1e-4, 1e-6):
        cloth = scene.cloth(tolerance=tolerance)
        x = cloth.step(scene.x, scene.v, scene.motion, scene.obstacles)[0]
        errors.append(np.abs(x - exact).max())
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 1e-5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": np.zeros((3, 5, 3))}, r"x has shape \(3, 5, 3\), expected \(3, 288, 3\)"),
        ({"held_motion": np.zeros((4, 3))}, r"held_motion has shape"),
        ({"types": ContactTypes(*(np.zeros((3, 7)),) * 3)}, r"types.owner has shape \(3, 7\)"),
        (
            {"types": ContactTypes(*(np.zeros((3, 288)),) * 3)},
            r"names body 0, expected less than 0",
        ),
        ({"obstacles": (Obstacles.none(),) * 2}, r"2 sets, expected 1 or 3"),
        ({"obstacles": (Obstacles.none(),) * 2 + (Obstacles.floor(),)}, r"expected one"),
    ],
)
def test_input_that_does_not_fit_is_refused(change: dict, message: str) -> None:
    scene = in_the_air(0.01)
    inputs = {
        "x": scene.x,
        "v": scene.v,
        "held_motion": scene.motion,
        "obstacles": scene.obstacles,
    }
    with pytest.raises(ValueError, match=message):
        scene.cloth().step(**{**inputs, **change})


def test_closed_meshes_are_refused() -> None:
    field = SignedDistanceField(np.zeros(3), 0.1, np.zeros((4, 4, 4)))
    scene = in_the_air(0.01)
    with pytest.raises(ValueError, match="closed meshes"):
        scene.cloth().bodies(replace(Obstacles.none(), solids=(Solid(field),)))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"batch": 0}, "batch is 0"),
        ({"material": FABRICS[:2]}, "material has 2 entries, expected 1 or 3"),
        ({"iterations": 5}, "iterations is 5, expected 1"),
    ],
)
def test_batch_that_cannot_be_made_is_refused(arguments: dict, message: str) -> None:
    scene = in_the_air(0.01)
    standard = {"material": Material(), "batch": 3}
    with pytest.raises(ValueError, match=message):
        BatchCloth(scene.elements, time_step=0.01, held=HELD, **{**standard, **arguments})
