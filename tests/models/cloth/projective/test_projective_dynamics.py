"""Laws of Projective Dynamics: what a step minimises, when it stops, how it touches."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
import trimesh

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles, Solid
from drake_dress.models.cloth.contact.solid import make_signed_distance_field
from drake_dress.models.cloth.elastic_energy import elastic_energy
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.forces import internal_force
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import bending_matrix, lumped_mass, stretch_matrix
from drake_dress.models.cloth.projective.iterated_contact import advanced
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.sheets import NO_NODES, sheet, sheet_elements

NOTHING = np.zeros((0, 3))
BOTH = pytest.mark.parametrize("quasi_newton", [False, True], ids=["plain", "quasi-newton"])
STILL = np.zeros(3)


def crumpled(columns: int, size: float, seed: int = 0) -> tuple[FloatArray, Elements]:
    """A sheet whose rest shape is curved, and positions well away from it."""
    x, faces = sheet(columns, columns, 0.02)
    rest = x + np.column_stack([np.zeros((len(x), 2)), 0.02 * np.sin(40.0 * x[:, 0])])
    noise = np.random.default_rng(seed).normal(size=x.shape)
    return rest + size * noise, make_elements(rest, faces)


def moving(x: FloatArray, v: FloatArray) -> ClothState:
    """A garment at `x` with the velocities `v`, (3,) or (n,3)."""
    return replace(ClothState.at_rest(x), v=np.zeros_like(x) + v)


def energy(cloth: ProjectiveDynamicsCloth, state: ClothState) -> float:
    """Kinetic and potential energy, J."""
    m = cloth.material
    kinetic = 0.5 * float((cloth.mass[:, None] * state.v**2).sum())
    weight = -float((cloth.mass[:, None] * state.x * cloth.gravity).sum())
    elastic = elastic_energy(cloth.elements, m.stretch_stiffness, m.bending_stiffness, state.x)
    return kinetic + weight + elastic


def incline(angle: float) -> Obstacles:
    """A half-space through the origin, inclined about y by `angle`."""
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    return replace(Obstacles.none(), half_spaces=HalfSpaces.resting(np.zeros(3), normal))


def capsule(radius: float) -> Obstacles:
    """A resting capsule along x through the origin."""
    return Obstacles.resting(
        np.array([[-0.3, 0.0, 0.0]]), np.array([[0.3, 0.0, 0.0]]), np.array([radius])
    )


def pressure_and_friction(
    state: ClothState, obstacles: Obstacles, margin: float
) -> tuple[FloatArray, FloatArray]:
    """Normal and tangential size of the reaction, (n,) each, N."""
    normal = find_proximity(state.x, obstacles, margin).normal
    pressure = np.einsum("ij,ij->i", state.reaction, normal)
    return pressure, np.linalg.norm(state.reaction - pressure[:, None] * normal, axis=1)


def test_energy_is_what_the_internal_force_derives_from() -> None:
    # 12 mm of noise bends hinges of 20 mm to below a tenth of their rest curvature, too
    x, e = crumpled(7, 0.012)
    curvature = np.linalg.norm(np.einsum("hi,hij->hj", e.hinge_coefficient, x[e.hinge]), axis=1)
    x_flat, _ = sheet(7, 7, 0.02)
    for position in (x, x_flat + 1e-4 * (x - x_flat)):
        force = internal_force(e, 100.0, 1e-3, position)
        direction = np.random.default_rng(1).normal(size=x.shape)
        step = 1e-7
        difference = elastic_energy(e, 100.0, 1e-3, position + step * direction)
        difference -= elastic_energy(e, 100.0, 1e-3, position - step * direction)
        slope = -float((force * direction).sum())
        assert difference / (2.0 * step) == pytest.approx(slope, rel=1e-6)
    assert curvature.min() > 0.0


def test_iteration_is_the_local_and_the_global_step() -> None:
    """Projections of all elements, then the constant system, as Bouaziz et al. 2014 have it."""
    x, e = crumpled(6, 0.004)
    m, h = Material(stretch_stiffness=80.0, bending_stiffness=2e-3), 0.02
    cloth = ProjectiveDynamicsCloth(
        e, m, h, NO_NODES, gravity=STILL, settings=ProjectiveSettings(max_iterations=1)
    )
    after, info = cloth.step(ClothState.at_rest(x), Obstacles.none(), NOTHING)
    assert not info.converged

    mass = lumped_mass(e, m)
    rhs = mass[:, None] * x
    for nodes, g, area in zip(e.triangle, e.triangle_gradient, e.triangle_area, strict=True):
        u, _, vt = np.linalg.svd(x[nodes].T @ g, full_matrices=False)
        rhs[nodes] += h**2 * m.stretch_stiffness * area * g @ (u @ vt).T
    hinges = zip(e.hinge, e.hinge_coefficient, e.hinge_weight, e.hinge_rest, strict=True)
    for nodes, c, weight, rest in hinges:
        s = c @ x[nodes]
        projection = s * rest / np.linalg.norm(s)
        rhs[nodes] += h**2 * m.bending_stiffness * weight * np.outer(c, projection)
    p = sp.diags(mass) + h**2 * (stretch_matrix(e, m) + bending_matrix(e, m))
    np.testing.assert_allclose(after.x, spla.spsolve(sp.csc_matrix(p), rhs), atol=1e-12)
    assert np.abs(after.x - x).max() > 1e-3


@BOTH
def test_step_ends_where_the_equations_of_implicit_euler_hold(quasi_newton: bool) -> None:
    x, e = crumpled(8, 0.002)
    m, h = Material(), 0.01
    cloth = ProjectiveDynamicsCloth(
        e, m, h, NO_NODES, settings=ProjectiveSettings(tolerance=1e-9, quasi_newton=quasi_newton)
    )
    before = moving(x, np.array([0.2, 0.0, 0.1]))
    after, info = cloth.step(before, Obstacles.none(), NOTHING)
    assert info.converged
    force = internal_force(e, m.stretch_stiffness, m.bending_stiffness, after.x)
    acceleration = force / cloth.mass[:, None] + cloth.gravity
    np.testing.assert_allclose((after.v - before.v) / h, acceleration, atol=1e-2)
    assert np.abs(acceleration).max() > 40.0


@BOTH
def test_free_fall_is_implicit_euler(quasi_newton: bool) -> None:
    x, e = sheet_elements(8, 8, 0.02)
    for h in (0.004, 0.1):
        cloth = ProjectiveDynamicsCloth(
            e, Material(), h, NO_NODES, settings=ProjectiveSettings(quasi_newton=quasi_newton)
        )
        state = ClothState.at_rest(x)
        for _ in range(10):
            state, info = cloth.step(state, Obstacles.none(), NOTHING)
            assert info.converged
        np.testing.assert_allclose(state.v - [0.0, 0.0, -98.1 * h], 0.0, atol=1e-9)
        np.testing.assert_allclose(state.x - x - [0.0, 0.0, -9.81 * 55.0 * h**2], 0.0, atol=1e-9)


@BOTH
def test_momentum_is_conserved_without_gravity(quasi_newton: bool) -> None:
    x, e = crumpled(8, 0.002)
    cloth = ProjectiveDynamicsCloth(
        e,
        Material(),
        0.01,
        NO_NODES,
        gravity=STILL,
        settings=ProjectiveSettings(tolerance=1e-8, quasi_newton=quasi_newton),
    )
    state = moving(x, np.array([0.5, -0.2, 0.1]))
    momentum = (cloth.mass[:, None] * state.v).sum(axis=0)
    for _ in range(5):
        state, _ = cloth.step(state, Obstacles.none(), NOTHING)
    np.testing.assert_allclose(
        (cloth.mass[:, None] * state.v).sum(axis=0), momentum, atol=1e-9 * cloth.mass.sum() + 1e-12
    )


def test_momentum_changes_by_gravity_grippers_and_contact_alone() -> None:
    x, e = sheet_elements(12, 12, 0.02)
    held = np.array([0, 1], dtype=np.int32)
    h = 0.01
    cloth = ProjectiveDynamicsCloth(
        e, Material(), h, held, settings=ProjectiveSettings(tolerance=1e-9, quasi_newton=True)
    )
    state = ClothState.at_rest(x - [0.11, 0.05, -0.06])
    touched = False
    for _ in range(25):
        before = (cloth.mass[:, None] * state.v).sum(axis=0)
        state, _ = cloth.step(state, capsule(0.05), np.tile([0.02, 0.0, 0.1], (2, 1)))
        change = (cloth.mass[:, None] * state.v).sum(axis=0) - before
        touched |= bool(np.any(state.owner == 0))
        weight = cloth.mass.sum() * cloth.gravity
        np.testing.assert_allclose(change / h, weight + state.reaction.sum(axis=0), atol=1e-5)
    assert touched


def _true_distances(h: float, quasi_newton: bool) -> list[float]:
    x, e = sheet_elements(14, 14, 0.02)
    held = np.array([0, 13], dtype=np.int32)
    cloth = ProjectiveDynamicsCloth(
        e, Material(), h, held, settings=ProjectiveSettings(quasi_newton=quasi_newton)
    )
    fine = ProjectiveDynamicsCloth(
        e,
        Material(),
        h,
        held,
        settings=ProjectiveSettings(tolerance=1e-10, max_iterations=20000, quasi_newton=True),
    )
    state = moving(x, 0.05 * np.random.default_rng(0).normal(size=x.shape))
    pull = np.tile([0.1, 0.0, 0.0], (2, 1))
    distance = []
    for _ in range(3):
        truth, fine_info = fine.step(state, Obstacles.none(), pull)
        state, info = cloth.step(state, Obstacles.none(), pull)
        assert fine_info.converged
        assert info.converged
        assert info.remaining <= 1e-5
        distance.append(float(np.linalg.norm(state.x - truth.x, axis=1).max()))
    return distance


@BOTH
@pytest.mark.parametrize("h", [0.001, 0.004, 0.02, 0.1])
def test_what_is_left_when_a_step_stops_is_what_was_estimated(h: float, quasi_newton: bool) -> None:
    """The true distance to the fixed point, known from a run to 1e-10 m, is at most twice 1e-5 m.

    The motion has no buckle: see the class of the stopping rule for what it cannot see.
    """
    assert max(_true_distances(h, quasi_newton)) <= 2e-5


def test_a_step_that_is_cut_short_says_so() -> None:
    x, e = crumpled(8, 0.003)
    cloth = ProjectiveDynamicsCloth(
        e, Material(), 0.05, NO_NODES, settings=ProjectiveSettings(max_iterations=7)
    )
    _, info = cloth.step(ClothState.at_rest(x), Obstacles.none(), NOTHING)
    assert info.iterations == 7
    assert not info.converged
    assert info.remaining > 1e-5


@pytest.mark.parametrize("h", [0.005, 0.05])
def test_quasi_newton_reaches_the_same_fixed_point_in_fewer_iterations(h: float) -> None:
    x, e = sheet_elements(12, 12, 0.02)
    held = np.array([0, 11], dtype=np.int32)
    state = moving(x, 0.05 * np.random.default_rng(3).normal(size=x.shape))
    steps = []
    for quasi_newton in (False, True):
        cloth = ProjectiveDynamicsCloth(
            e,
            Material(),
            h,
            held,
            settings=ProjectiveSettings(tolerance=1e-8, quasi_newton=quasi_newton),
        )
        steps.append(cloth.step(state, Obstacles.none(), np.zeros((2, 3))))
    (plain, slow), (quick, fast) = steps
    assert np.abs(plain.x - quick.x).max() < 5e-8
    assert fast.iterations < 0.6 * slow.iterations


def test_hanging_sheet_is_at_the_implicit_schemes_equilibrium() -> None:
    x, e = sheet_elements(10, 10, 0.02)
    # unequal heights: the sheet hangs askew, with folds, but has one way to do so
    held = np.arange(10, dtype=np.int32)
    start = np.column_stack([x[:, 1], 0.1 * x[:, 0], -x[:, 0]])
    start[held, 2] += 0.1 * start[held, 0]
    material = Material(stretch_stiffness=50.0, bending_stiffness=5e-4)
    steady = np.zeros((10, 3))
    pd = ProjectiveDynamicsCloth(
        e, material, 0.05, held, settings=ProjectiveSettings(tolerance=1e-6, quasi_newton=True)
    )
    other = ImplicitCloth(
        e, replace(material, damping=0.02), 0.01, held, settings=ImplicitSettings(tolerance=1e-4)
    )
    a = b = ClothState.at_rest(start)
    for _ in range(60):
        a, _ = pd.step(a, Obstacles.none(), steady)
    for _ in range(400):
        b, _ = other.step(b, Obstacles.none(), steady)
    assert np.abs(a.v).max() < 1e-3
    assert np.abs(b.v).max() < 1e-3
    assert np.linalg.norm(a.x - b.x, axis=1).max() < 5e-4
    weight = pd.mass.sum() * 9.81
    assert a.reaction[held].sum(axis=0)[2] == pytest.approx(weight, rel=1e-3)


@BOTH
def test_energy_is_not_created_by_swinging_and_landing(quasi_newton: bool) -> None:
    x, e = sheet_elements(11, 11, 0.02)
    held = np.array([0, 10], dtype=np.int32)
    h = 0.01
    cloth = ProjectiveDynamicsCloth(
        e, Material(), h, held, settings=ProjectiveSettings(quasi_newton=quasi_newton)
    )
    state = ClothState.at_rest(x - [0.0, 0.1, -0.06])
    last = energy(cloth, state)
    contacts = 0
    for _ in range(30):
        state, _ = cloth.step(state, capsule(0.03), np.zeros((2, 3)))
        now = energy(cloth, state)
        assert now <= last + 1e-9
        last = now
        contacts = max(contacts, int(np.count_nonzero(state.owner >= 0)))
    assert contacts > 5


@pytest.mark.parametrize("h", [0.005, 0.1])
def test_tilted_sheet_comes_to_rest_on_the_floor(h: float) -> None:
    x, e = sheet_elements(10, 10, 0.02)
    c, s = np.cos(0.3), np.sin(0.3)
    start = (x - x.mean(axis=0)) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T + [0, 0, 0.08]
    cloth = ProjectiveDynamicsCloth(
        e, Material(), h, NO_NODES, settings=ProjectiveSettings(quasi_newton=True)
    )
    state = ClothState.at_rest(start)
    for _ in range(round(0.8 / h)):
        state, info = cloth.step(state, Obstacles.floor(), NOTHING)
        assert info.converged
        assert state.x[:, 2].min() >= cloth.material.margin - 1e-5
    assert np.abs(state.v).max() < 1e-4
    weight = cloth.mass.sum() * 9.81
    np.testing.assert_allclose(state.reaction.sum(axis=0), [0.0, 0.0, weight], atol=1e-3 * weight)


@pytest.mark.parametrize("h", [0.01, 0.1])
def test_sheet_comes_to_rest_on_a_capsule(h: float) -> None:
    x, e = sheet_elements(11, 11, 0.02)
    material = Material(friction=0.8)
    cloth = ProjectiveDynamicsCloth(
        e, material, h, NO_NODES, settings=ProjectiveSettings(quasi_newton=True)
    )
    state = ClothState.at_rest(x - x.mean(axis=0) + [0.0, 0.003, 0.1])
    for _ in range(round(1.5 / h)):
        state, info = cloth.step(state, capsule(0.06), NOTHING)
        assert info.converged
        assert find_proximity(state.x, capsule(0.06), material.margin).gap.min() >= -1e-5
    # the flaps still sway
    assert np.sqrt((state.v**2).sum(axis=1).mean()) < 0.05
    assert np.abs(state.x.mean(axis=0)[:2]).max() < 0.01
    weight = cloth.mass.sum() * 9.81
    assert state.reaction.sum(axis=0)[2] == pytest.approx(weight, rel=0.1)


@pytest.mark.parametrize("speed", [1.0, 2.0, 5.0])
def test_nothing_is_leapt_over_in_a_large_step(speed: float) -> None:
    """At 5 m/s and h = 0.1 s a node would pass a capsule of 8 cm six times over."""
    x, e = sheet_elements(13, 13, 0.02)
    cloth = ProjectiveDynamicsCloth(
        e, Material(), 0.1, NO_NODES, settings=ProjectiveSettings(quasi_newton=True)
    )
    state = moving(x - x.mean(axis=0) + [0.0, 0.0, 0.3], np.array([0.0, 0.0, -speed]))
    for _ in range(3):
        state, info = cloth.step(state, capsule(0.04), NOTHING)
        assert info.converged
        assert find_proximity(state.x, capsule(0.04), cloth.material.margin).gap.min() >= -1e-5
    over = np.abs(state.x[:, 1]) < 0.02
    assert over.sum() > 10
    assert state.x[over, 2].min() > 0.03


@pytest.mark.parametrize("h", [0.01, 0.1])
def test_a_limb_sweeps_a_hanging_sheet_along(h: float) -> None:
    """The limb moves by 15 cm in the large step: it must not be found behind the sheet."""
    x, e = sheet_elements(11, 11, 0.02)
    held = np.arange(11, dtype=np.int32)
    start = np.column_stack([x[:, 1] - 0.1, np.zeros(len(x)), -x[:, 0]])
    cloth = ProjectiveDynamicsCloth(
        e, Material(), h, held, settings=ProjectiveSettings(quasi_newton=True)
    )
    state = ClothState.at_rest(start)
    limb = replace(capsule(0.03), velocity=np.array([[0.0, 1.5, 0.0]]))
    for k in range(round(0.2 / h)):
        shift = np.array([[0.0, -0.1 + 1.5 * k * h, -0.08]])
        now = replace(limb, a=limb.a + shift, b=limb.b + shift)
        state, _ = cloth.step(state, now, np.zeros((11, 3)))
        later, _ = advanced(now, h)
        assert find_proximity(state.x, later, cloth.material.margin).gap.min() >= -1e-5
        touching = state.owner >= 0
        assert np.all(state.x[touching, 1] > later.a[0, 1] - 0.033)
        front = np.abs(state.x[:, 2] - later.a[0, 2]) < 0.01
        assert np.all(state.x[front, 1] > later.a[0, 1])
    assert state.x[:, 1].max() > 0.1


def _slide(
    angle: float, friction: float, h: float, quasi_newton: bool
) -> tuple[FloatArray, ClothState]:
    x, e = sheet_elements(9, 9, 0.02)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    start = (x - x.mean(axis=0)) @ turn.T + 0.003 * turn[:, 2]
    material = Material(friction=friction, stretch_stiffness=300.0)
    cloth = ProjectiveDynamicsCloth(
        e, material, h, NO_NODES, settings=ProjectiveSettings(quasi_newton=quasi_newton)
    )
    state = ClothState.at_rest(start)
    for _ in range(round(0.4 / h)):
        state, info = cloth.step(state, incline(angle), NOTHING)
        assert info.converged
    return start, state


@BOTH
@pytest.mark.parametrize("h", [0.004, 0.1])
def test_cloth_on_a_gentle_incline_sticks(h: float, quasi_newton: bool) -> None:
    friction = 0.4
    start, state = _slide(np.arctan(friction) - 0.03, friction, h, quasi_newton)
    assert np.abs(state.x - start).max() < 1e-9


@BOTH
@pytest.mark.parametrize("h", [0.004, 0.1])
def test_cloth_on_a_steep_incline_slides_with_coulomb_acceleration(
    h: float, quasi_newton: bool
) -> None:
    friction = 0.3
    angle = np.arctan(friction) + 0.1
    _, state = _slide(angle, friction, h, quasi_newton)
    downhill = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    expected = 9.81 * (np.sin(angle) - friction * np.cos(angle)) * 0.4
    np.testing.assert_allclose(state.v @ downhill, expected, rtol=0.01)
    pressure, tangential = pressure_and_friction(state, incline(angle), 0.003)
    np.testing.assert_allclose(tangential, friction * pressure, rtol=1e-6)


@BOTH
def test_friction_stays_in_its_cone_and_nothing_adheres(quasi_newton: bool) -> None:
    x, e = sheet_elements(11, 11, 0.02)
    cloth = ProjectiveDynamicsCloth(
        e, Material(), 0.01, NO_NODES, settings=ProjectiveSettings(quasi_newton=quasi_newton)
    )
    state = ClothState.at_rest(x - x.mean(axis=0) + [0.0, 0.01, 0.07])
    weight = cloth.mass.sum() * 9.81
    modes = set()
    for _ in range(25):
        state, _ = cloth.step(state, capsule(0.06), NOTHING)
        pressure, tangential = pressure_and_friction(state, capsule(0.06), 0.003)
        assert pressure.min() > -1e-3 * weight
        excess = tangential - cloth.material.friction * np.maximum(pressure, 0.0)
        assert excess.max() < 1e-3 * weight
        modes |= set(state.mode.tolist())
    assert modes == {0, 1, 2}


@pytest.mark.parametrize("h", [0.004, 0.1])
def test_landing_does_not_bounce(h: float) -> None:
    x, e = sheet_elements(8, 8, 0.02)
    cloth = ProjectiveDynamicsCloth(e, Material(), h, NO_NODES)
    state = moving(x + [0.0, 0.0, 0.01], np.array([0.0, 0.0, -1.0]))
    for _ in range(round(0.4 / h)):
        state, _ = cloth.step(state, Obstacles.floor(), NOTHING)
        assert state.v[:, 2].max() < 1e-6
    assert np.abs(state.v).max() < 1e-6
    np.testing.assert_allclose(state.x[:, 2], cloth.material.margin, atol=1e-6)


@pytest.mark.parametrize("h", [0.01, 0.1])
def test_sticking_cloth_turns_with_its_table(h: float) -> None:
    """A rigid rotation of 0.2 rad a step is followed exactly, not along its tangent."""
    x, e = sheet_elements(7, 7, 0.02)
    start = x - x.mean(axis=0) + [0.03, 0.0, 0.003]
    cloth = ProjectiveDynamicsCloth(e, Material(friction=50.0), h, NO_NODES)
    state = ClothState.at_rest(start)
    plane = replace(
        HalfSpaces.resting(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        angular_velocity=np.array([[0.0, 0.0, 2.0]]),
    )
    for _ in range(round(0.4 / h)):
        state, _ = cloth.step(state, replace(Obstacles.none(), half_spaces=plane), NOTHING)
    c, s = np.cos(0.8), np.sin(0.8)
    turned = start @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    np.testing.assert_allclose(state.x, turned, atol=2e-5)


@pytest.mark.parametrize("h", [0.01, 0.1])
def test_sheet_on_a_closed_mesh_that_rises_rests_on_its_top(h: float) -> None:
    x, e = sheet_elements(5, 5, 0.02)
    box = trimesh.creation.box((0.2, 0.2, 0.1))
    field = make_signed_distance_field(box.vertices, box.faces, 0.02)
    cloth = ProjectiveDynamicsCloth(
        e, Material(), h, NO_NODES, settings=ProjectiveSettings(quasi_newton=True)
    )
    tilt = np.array([[0.98, 0.0, 0.2], [0.0, 1.0, 0.0], [-0.2, 0.0, 0.98]])
    state = ClothState.at_rest((x - x.mean(axis=0)) @ tilt.T + [0.01, 0.0, 0.08])
    rise = np.array([0.0, 0.0, 0.1])
    for k in range(round(0.5 / h)):
        now = Solid(field, position=k * h * rise, velocity=rise)
        obstacles = replace(Obstacles.none(), solids=(now,))
        state, info = cloth.step(state, obstacles, NOTHING)
        assert info.converged
        gap = find_proximity(state.x, advanced(obstacles, h)[0], cloth.material.margin).gap
        assert gap.min() >= -1e-5
    np.testing.assert_allclose(state.v, np.tile(rise, (25, 1)), atol=2e-3)
    weight = cloth.mass.sum() * 9.81
    assert state.reaction.sum(axis=0)[2] == pytest.approx(weight, rel=0.02)


@pytest.mark.parametrize("name", ["position", "velocity"])
def test_input_that_is_not_finite_names_its_node_and_changes_nothing(name: str) -> None:
    x, e = sheet_elements(6, 6, 0.02)
    cloth = ProjectiveDynamicsCloth(e, Material(), 0.01, np.array([0, 5], dtype=np.int32))
    state = ClothState.at_rest(x)
    (state.x if name == "position" else state.v)[17, 2] = np.nan
    kept = state.x.copy(), state.v.copy()
    with pytest.raises(ValueError, match=f"{name} node 17 is"):
        cloth.step(state, Obstacles.none(), np.zeros((2, 3)))
    np.testing.assert_array_equal(state.x, kept[0])
    np.testing.assert_array_equal(state.v, kept[1])


def test_a_thin_rod_does_not_slip_between_nodes_where_elements_are_sampled() -> None:
    x, e = sheet_elements(9, 9, 0.06)
    material = Material(friction=0.3)
    rod = capsule(0.01)
    highest = {}
    for sampled in (False, True):
        cloth = ProjectiveDynamicsCloth(
            e,
            material,
            0.005,
            NO_NODES,
            settings=ProjectiveSettings(quasi_newton=True, sample_elements=sampled),
        )
        # the rod lies between two rows of nodes
        state = ClothState.at_rest(x - x.mean(axis=0) + [0.0, 0.03, 0.03])
        for _ in range(40):
            state, _ = cloth.step(state, rod, NOTHING)
        highest[sampled] = state.x[:, 2].max()
    assert highest[False] < -0.05
    assert highest[True] > 0.0
