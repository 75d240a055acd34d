"""Laws and derivatives of the controller's garment."""

import numpy as np
import pytest
import trimesh

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import FREE, SLIP
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles, Solid
from drake_dress.models.cloth.contact.solid import make_signed_distance_field
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.explicit.explicit_bias import (
    ExplicitBiasCloth,
    ExplicitSettings,
    Tape,
)
from drake_dress.models.cloth.material import Material
from tests.models.cloth.sheets import NO_NODES, sheet_elements

NOTHING = np.zeros((0, 3))


@pytest.mark.parametrize("h", [0.001, 0.01, 0.1, 1.0])
def test_free_fall_is_exact_at_every_step_size(h: float) -> None:
    x, e = sheet_elements(8, 8, 0.03)
    cloth = ExplicitBiasCloth(e, Material(), h, NO_NODES)
    v, start = np.zeros_like(x), x
    for _ in range(5):
        x, v, _, _ = cloth.step(x, v, NOTHING, Obstacles.none())
    np.testing.assert_allclose(
        x - start, np.tile([0, 0, -0.5 * 9.81 * (5 * h) ** 2], (64, 1)), rtol=1e-8, atol=1e-12
    )
    np.testing.assert_allclose(v[:, 2], -9.81 * 5 * h, rtol=1e-9)


@pytest.mark.parametrize("spring", [None, 200.0])
@pytest.mark.parametrize("h", [0.002, 0.02, 0.1])
def test_gripper_that_moves_steadily_feels_the_weight(h: float, spring: float | None) -> None:
    """Neither prescribed nodes nor springs report a force that is not there, whatever the step."""
    x, e = sheet_elements(12, 9, 0.03)
    start = np.column_stack([x[:, 1], np.zeros(len(x)), -x[:, 0]])
    held = np.arange(9, dtype=np.int32)
    cloth = ExplicitBiasCloth(
        e, Material(), h, held, settings=ExplicitSettings(attachment_stiffness=spring)
    )
    x, v = start, np.tile([0.15, 0.0, 0.0], (len(x), 1))
    forces = []
    for k in range(max(200, int(3.0 / h))):
        grippers = start[held] + [0.15 * h * (k + 1), 0.0, 0.0]
        x, v, r, _ = cloth.step(x, v, grippers - x[held], Obstacles.none())
        forces.append(r[held].sum(axis=0)[2])
    assert np.mean(forces[-50:]) == pytest.approx(cloth.mass.sum() * 9.81, rel=0.05)


def _in_contact(
    h: float,
) -> tuple[ExplicitBiasCloth, FloatArray, FloatArray, FloatArray, Obstacles]:
    x, e = sheet_elements(16, 18, 0.03)
    held = np.array([0, 1, 17, 16], dtype=np.int32)
    cloth = ExplicitBiasCloth(
        e, Material(friction=0.3), h, held, settings=ExplicitSettings(tolerance=1e-10)
    )
    limb = Obstacles(
        np.array([[0.1, 0.2, -0.06], [0.3, 0.1, -0.07]]),
        np.array([[0.4, 0.3, -0.06], [0.3, 0.1, -0.07]]),
        np.array([[0.05, 0.03], [0.05, 0.05]]),
        np.array([[0.0, 0.0, 0.05], [0.02, 0.0, 0.0]]),
        np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0]]),
    )
    v = np.zeros_like(x)
    motion = np.tile([0.05 * h, 0.02 * h, -0.1 * h], (4, 1))
    for _ in range(int(0.5 / h)):
        x, v, _, _ = cloth.step(x, v, motion, limb)
    return cloth, x, v, motion, limb


@pytest.mark.parametrize(("h", "spring"), [(0.005, None), (0.02, None), (0.1, None), (0.02, 150.0)])
def test_derivative_of_a_contact_step_matches_finite_differences(
    h: float, spring: float | None
) -> None:
    rng = np.random.default_rng(7)
    cloth, x, v, motion, limb = _in_contact(h)
    if spring is not None:
        cloth = ExplicitBiasCloth(
            cloth.elements,
            cloth.material,
            h,
            cloth.held,
            settings=ExplicitSettings(tolerance=1e-10, attachment_stiffness=spring),
        )
    weight_x, weight_v = rng.normal(size=x.shape), h * rng.normal(size=x.shape)
    weight_r = 1e-3 * rng.normal(size=motion.shape)

    def loss(x: FloatArray, v: FloatArray, motion: FloatArray) -> tuple[float, Tape]:
        x1, v1, r, tape = cloth.step(x, v, motion, limb, types)
        value = np.sum(weight_x * x1) + np.sum(weight_v * v1) + np.sum(weight_r * r[cloth.held])
        return float(value), tape

    types = None
    _, tape = loss(x, v, motion)
    types = tape.types
    assert np.any(types.mode == SLIP)
    _, tape = loss(x, v, motion)
    gradient = cloth.vector_jacobian_product(tape, weight_x, weight_v, weight_r)
    for name, point, slope in (
        ("x", x, gradient.x),
        ("v", v, gradient.v),
        ("motion", motion, gradient.held_motion),
    ):
        numeric, exact = [], []
        for _ in range(10):
            d = rng.normal(size=point.shape)
            step = 1e-7
            at = {"x": x, "v": v, "motion": motion}
            high = loss(**{**at, name: point + step * d})[0]
            low = loss(**{**at, name: point - step * d})[0]
            numeric.append((high - low) / (2 * step))
            exact.append(float(np.sum(slope * d)))
        a, b = np.array(numeric), np.array(exact)
        assert a @ b / np.linalg.norm(a) / np.linalg.norm(b) > 0.9999, name
        assert np.linalg.norm(a - b) < 1e-3 * np.linalg.norm(a), name


def test_frozen_contact_is_exact_without_contact_and_bounded_with_it() -> None:
    rng = np.random.default_rng(3)
    cloth, x, v, motion, limb = _in_contact(0.1)
    weight_x, weight_v = rng.normal(size=x.shape), 0.1 * rng.normal(size=x.shape)
    weight_r = 1e-3 * rng.normal(size=motion.shape)
    for bodies, equal in ((Obstacles.none(), True), (limb, False)):
        tape = cloth.step(x, v, motion, bodies)[3]
        exact, frozen = (
            cloth.vector_jacobian_product(tape, weight_x, weight_v, weight_r, frozen_contact=f)
            for f in (False, True)
        )
        assert np.allclose(exact.x, frozen.x) == equal
        assert np.allclose(exact.v, frozen.v) == equal
        assert np.linalg.norm(frozen.x) < 3.0 * np.linalg.norm(weight_x)
        # what slipping nodes take from friction alone is left out
        assert np.linalg.norm(frozen.held_motion - exact.held_motion) < 0.3 * np.linalg.norm(
            exact.held_motion
        )
        assert not frozen.origin.any()
    with pytest.raises(ValueError, match="frozen_contact"):
        cloth.vector_jacobian_product(
            tape, weight_x, weight_v, weight_r, by_material=True, frozen_contact=True
        )


SETTLING = 130


def _on_all_kinds(
    h: float, end_radius: float
) -> tuple[ExplicitBiasCloth, FloatArray, FloatArray, Obstacles]:
    """A sheet that lies on a floor that rises, a ball given as a mesh that turns, and a limb."""
    x, e = sheet_elements(16, 18, 0.03)
    cloth = ExplicitBiasCloth(
        e, Material(friction=0.3), h, NO_NODES, settings=ExplicitSettings(tolerance=1e-10)
    )
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.06)
    field = make_signed_distance_field(mesh.vertices, mesh.faces, 0.025)
    ball = Solid(
        field,
        position=np.array([0.15, 0.3, -0.06]),
        velocity=np.array([0.02, 0.0, 0.03]),
        angular_velocity=np.array([0.3, 0.2, 0.1]),
    )
    floor = HalfSpaces(
        np.array([[0.1, 0.0, -0.085]]),
        np.array([[0.0, 0.1, 1.0]]) / np.hypot(0.1, 1.0),
        np.array([[0.01, 0.0, 0.02]]),
        np.array([[0.1, 0.0, 0.0]]),
    )
    limb = Obstacles(
        np.array([[0.3, 0.1, -0.08]]),
        np.array([[0.4, 0.3, -0.06]]),
        np.array([[0.05, end_radius]]),
        np.array([[0.0, 0.0, 0.05]]),
        np.array([[0.1, 0.2, 0.3]]),
        floor,
        (ball,),
    )
    settling = ExplicitBiasCloth(e, Material(friction=0.3), 0.005, NO_NODES)
    v = np.zeros_like(x)
    for _ in range(SETTLING):
        x, v, _, _ = settling.step(x, v, NOTHING, limb)
    return cloth, x, v, limb


def _moved(o: Obstacles, owner: int, d: FloatArray) -> Obstacles:
    offset = np.zeros((o.count, 4, 3))
    offset[owner] = d
    return o.moved(offset)


@pytest.mark.parametrize(("h", "end_radius"), [(0.005, 0.05), (0.05, 0.05), (0.005, 0.03)])
def test_derivative_by_the_motion_of_bodies_matches_finite_differences(
    h: float, end_radius: float
) -> None:
    rng = np.random.default_rng(3)
    cloth, x, v, bodies = _on_all_kinds(h, end_radius)
    weight_x, weight_v = rng.normal(size=x.shape), h * rng.normal(size=x.shape)
    _, _, _, tape = cloth.step(x, v, NOTHING, bodies)
    types = tape.types
    assert set(types.owner[types.mode != FREE]) == {0, 1, 2}

    def loss(obstacles: Obstacles) -> float:
        x1, v1, _, _ = cloth.step(x, v, NOTHING, obstacles, types)
        return float(np.sum(weight_x * x1) + np.sum(weight_v * v1))

    _, _, _, tape = cloth.step(x, v, NOTHING, bodies, types)
    g = cloth.vector_jacobian_product(tape, weight_x, weight_v, NOTHING)
    slope = np.stack([g.origin, g.rotation, g.velocity, g.angular_velocity], axis=1)
    scale = np.array([1.0, 1.0, 1.0 / h, 1.0 / h])[:, None]
    for owner in (0, 1, 2):
        numeric, exact = [], []
        for _ in range(8):
            d = scale * rng.normal(size=(4, 3))
            step = 1e-7
            high, low = (loss(_moved(bodies, owner, e * step * d)) for e in (1.0, -1.0))
            numeric.append((high - low) / (2 * step))
            exact.append(float(np.sum(slope[owner] * d)))
        error = np.linalg.norm(np.subtract(numeric, exact))
        assert error < 1e-3 * np.linalg.norm(numeric), owner


@pytest.mark.parametrize("h", [0.005, 0.02, 0.1])
def test_slipping_nodes_feel_friction_of_their_own_normal_force(h: float) -> None:
    cloth, x, v, motion, limb = _in_contact(h)
    _, _, reaction, tape = cloth.step(x, v, motion, limb)
    slip = tape.friction.mode == SLIP
    n = tape.contacts.normal[slip]
    r = reaction[tape.contacts.nodes[slip]]
    pressure = np.einsum("ij,ij->i", r, n)
    tangential = r - pressure[:, None] * n
    np.testing.assert_allclose(
        np.linalg.norm(tangential, axis=1), 0.3 * np.abs(pressure), atol=1e-9
    )
    drawn = tape.contacts.gap[slip] > 1e-4
    assert np.all(pressure[drawn] >= 0.0)
    assert np.all(reaction[tape.mode == FREE] == 0.0)


def test_tight_sleeve_stays_bounded_at_large_steps() -> None:
    x, e = _tube(radius=0.045)
    cloth = ExplicitBiasCloth(e, Material(stretch_stiffness=100.0), 0.1, NO_NODES)
    arm = Obstacles.resting(
        np.array([[0.0, 0.0, -0.5]]), np.array([[0.0, 0.0, 0.5]]), np.array([0.05])
    )
    v = np.zeros_like(x)
    for _ in range(30):
        x, v, _, _ = cloth.step(x, v, NOTHING, arm)
    assert np.abs(v).max() < 3.0
    assert np.linalg.norm(x[:, :2], axis=1).max() < 0.1


def _tube(radius: float) -> tuple[FloatArray, Elements]:
    from drake_dress.models.cloth.elements import make_elements

    around, rows = 14, 8
    angle = np.arange(around) * 2 * np.pi / around
    x = np.concatenate(
        [
            np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(around, z)])
            for z in 0.02 * np.arange(rows)
        ]
    )
    faces = []
    for i in range(rows - 1):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            faces += [[a, b, a + around], [b, b + around, a + around]]
    return x, make_elements(x, np.array(faces, dtype=np.int32))


def _two_layers(h: float) -> tuple[ExplicitBiasCloth, FloatArray, FloatArray]:
    """A sheet that has fallen onto another one, held at two sides."""
    from drake_dress.models.cloth.elements import make_elements
    from tests.models.cloth.sheets import sheet

    lower, faces = sheet(12, 12, 0.03)
    upper = 0.6 * lower + np.array([0.07, 0.06, 0.006])
    x = np.concatenate([lower, upper])
    e = make_elements(x, np.concatenate([faces, faces + len(lower)]))
    held = np.flatnonzero((lower[:, 0] < 1e-9) | (lower[:, 0] > 0.329)).astype(np.int32)
    settle = ExplicitBiasCloth(
        e, Material(), 0.01, held, settings=ExplicitSettings(self_collision=2e-3)
    )
    v = np.zeros_like(x)
    for _ in range(12):
        x, v, _, _ = settle.step(x, v, np.zeros((len(held), 3)), Obstacles.none())
    return (
        ExplicitBiasCloth(e, Material(), h, held, settings=ExplicitSettings(self_collision=2e-3)),
        x,
        v,
    )


def test_a_layer_that_falls_onto_another_stays_above_it() -> None:
    cloth, x, v = _two_layers(0.01)
    still = np.zeros((len(cloth.held), 3))
    for _ in range(60):
        x, v, _, tape = cloth.step(x, v, still, Obstacles.none())
        assert tape.separation is not None
        assert tape.separation.crossing == 0
    below, above = x[:144], x[144:]
    inner = above[np.abs(above[:, :2] - above[:, :2].mean(axis=0)).max(axis=1) < 0.05]
    nearest = np.argmin(np.linalg.norm(inner[:, None, :2] - below[None, :, :2], axis=2), axis=1)
    assert np.all(inner[:, 2] > below[nearest, 2] - 0.01)
    assert np.abs(v).max() < 0.5


def test_derivative_with_layers_in_contact_matches_finite_differences() -> None:
    """Pairs and their directions are held: a step that moves velocities alone keeps them nearly."""
    rng = np.random.default_rng(2)
    cloth, x, v = _two_layers(0.005)
    still = np.zeros((len(cloth.held), 3))
    _, _, _, tape = cloth.step(x, v, still, Obstacles.none())
    assert tape.separation is not None
    assert tape.separation.impulse_count > 0
    weight_x, weight_v = rng.normal(size=x.shape), 0.005 * rng.normal(size=x.shape)
    g = cloth.vector_jacobian_product(tape, weight_x, weight_v, still)
    numeric, exact = [], []
    for _ in range(12):
        d, step = rng.normal(size=v.shape), 1e-7
        values = []
        for s in (1.0, -1.0):
            x1, v1, _, _ = cloth.step(x, v + s * step * d, still, Obstacles.none())
            values.append(float(np.sum(weight_x * x1) + np.sum(weight_v * v1)))
        numeric.append((values[0] - values[1]) / (2 * step))
        exact.append(float(np.sum(g.v * d)))
    a, b = np.array(numeric), np.array(exact)
    assert a @ b / np.linalg.norm(a) / np.linalg.norm(b) > 0.99
