"""Laws of the garment in MuJoCo: fall, weight, momentum, contact, friction and determinism."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.modes import HELD, SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.contact.wrenches import body_wrenches
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.fibres import Fibres
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.mujoco_cloth import MujocoCloth
from drake_dress.models.cloth.mujoco.settings import MujocoSettings
from drake_dress.models.cloth.state import GRAVITY, Additions, ClothState
from tests.models.cloth.sheets import NO_NODES, sheet, sheet_elements

pytest.importorskip("mujoco", reason="needs MuJoCo: pip install -e '.[mujoco]'")

H = 0.01
NOTHING = np.zeros((0, 3))
SOFT = Material(stretch_stiffness=300.0, bending_stiffness=1e-4, damping=0.01)


def capsule(x: float = 0.0, speed: FloatArray | None = None, spin: float = 0.0) -> Obstacles:
    """Returns a thick, long capsule along y through (x, 0, 0), radius 0.1 m."""
    v = np.zeros(3) if speed is None else speed
    return Obstacles(
        np.array([[x, -0.6, 0.0]]),
        np.array([[x, 0.6, 0.0]]),
        np.array([0.1]),
        v[None],
        np.array([[0.0, spin, 0.0]]),
    )


def lying(cloth: MujocoCloth, x: FloatArray, steps: int = 60) -> ClothState:
    """Returns a sheet that has been laid on the resting capsule."""
    state = ClothState.at_rest(x - x.mean(axis=0) + [0.0, 0.0, 0.105])
    for _ in range(steps):
        state, _ = cloth.step(state, capsule(), NOTHING)
    return state


def tube(girth: float, length: float, spacing: float) -> tuple[FloatArray, IntArray]:
    """Returns a tube about x: (n,3) positions, m, and faces."""
    around, along = round(girth / spacing), round(length / spacing)
    radius, faces = girth / (2.0 * np.pi), []
    angle = 2.0 * np.pi * np.arange(around) / around
    ring = radius * np.stack([0.0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    x = np.concatenate([ring + [spacing * k, 0.0, 0.0] for k in range(along + 1)])
    for k in range(along):
        for i in range(around):
            a, b = k * around + i, k * around + (i + 1) % around
            c, d = a + around, b + around
            faces += [[a, b, d], [a, d, c]]
    return x, np.array(faces, dtype=np.int32)


def test_free_fall_is_exact() -> None:
    x, e = sheet_elements(8, 9, 0.03)
    cloth, state = MujocoCloth(e, SOFT, H, NO_NODES), ClothState.at_rest(x)
    for _ in range(20):
        state, _ = cloth.step(state, Obstacles.none(), NOTHING)
    np.testing.assert_allclose(state.v, np.tile(20 * H * GRAVITY, (len(x), 1)), atol=1e-9)


def test_momentum_is_conserved_without_outer_forces() -> None:
    x, e = sheet_elements(8, 9, 0.03)
    cloth = MujocoCloth(e, SOFT, H, NO_NODES, np.zeros(3))
    v = np.random.default_rng(1).normal(size=x.shape)
    state, mass = replace(ClothState.at_rest(x), v=v), cloth.mass[:, None]
    before = (mass * v).sum(axis=0)
    for _ in range(30):
        state, _ = cloth.step(state, Obstacles.none(), NOTHING)
    assert np.abs(state.v).max() < 0.5 * np.abs(v).max(), "waves have been damped"
    np.testing.assert_allclose((mass * state.v).sum(axis=0), before, atol=1e-9)


def test_hanging_strip_stretches_by_its_weight() -> None:
    """δ = ρ g L² / (2 k)."""
    x, e = sheet_elements(4, 26, 0.02)
    held = np.flatnonzero(x[:, 1] == 0.0).astype(np.int32)
    m = Material(surface_density=0.3, stretch_stiffness=100.0, damping=0.05)
    cloth = MujocoCloth(e, m, H, held)
    state = ClothState.at_rest(np.column_stack([x[:, 0], np.zeros(len(x)), -x[:, 1]]))
    for _ in range(500):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((len(held), 3)))
    sag = -state.x[:, 2].min() - 0.5
    assert sag == pytest.approx(0.3 * 9.81 * 0.5**2 / (2 * 100.0), rel=0.03)


@pytest.mark.parametrize("lift", [0.0, 0.3])
def test_grippers_bear_the_weight_and_what_accelerates_it(lift: float) -> None:
    """Σ reaction = Σ m (a − g), at rest and while the grippers speed up at `lift` m/s²."""
    x, e = sheet_elements(8, 9, 0.03)
    held = np.array([0, 63], dtype=np.int32)
    cloth = MujocoCloth(e, replace(SOFT, damping=0.05), H, held)
    state = ClothState.at_rest(np.column_stack([x[:, 0], np.zeros(len(x)), x[:, 1]]))
    for _ in range(300):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((2, 3)))
    forces = []
    for k in range(1, 31):
        before = state.v
        motion = np.tile([0.0, 0.0, k * H * lift], (2, 1))
        state, _ = cloth.step(state, Obstacles.none(), motion)
        change = cloth.mass @ (state.v - before) / H
        forces.append(state.reaction[held].sum(axis=0) - change)
        assert (state.mode[held] == HELD).all()
        np.testing.assert_array_equal(state.v[held], motion)
    weight = -cloth.mass.sum() * GRAVITY
    np.testing.assert_allclose(forces, np.tile(weight, (30, 1)), atol=0.02 * weight[2])


def test_what_acts_on_a_lying_sheet_is_what_moves_it() -> None:
    """Σ reaction + m g = d(m v)/dt: contact between layers and elasticity add nothing."""
    x, e = sheet_elements(14, 10, 0.03)
    exact = MujocoSettings(tolerance=1e-11, iterations=2000)
    cloth = MujocoCloth(e, SOFT, H, NO_NODES, settings=exact)
    state, weight = lying(cloth, x), -cloth.mass.sum() * GRAVITY
    missing = []
    for k in range(40):
        before = state.v
        state, _ = cloth.step(state, capsule(0.1 * k * H, np.array([0.1, 0.0, 0.0])), NOTHING)
        missing.append(cloth.mass @ (state.v - before) / H + weight - state.reaction.sum(axis=0))
    assert np.linalg.norm(missing, axis=1).max() < 0.005 * weight[2]
    # the wrench on the body is what it gives to the nodes, about its origin
    origin = np.array([[0.3, 0.2, -0.1]])
    owner = np.zeros(1, dtype=np.int32)
    wrench = body_wrenches(owner, origin, state.x, state.owner, state.reaction)[0]
    np.testing.assert_allclose(wrench[3:], -state.reaction.sum(axis=0), atol=1e-9)
    moment = -np.cross(state.x - origin[0], state.reaction).sum(axis=0)
    np.testing.assert_allclose(wrench[:3], moment, atol=1e-9)


@pytest.mark.parametrize("spin", [0.0, 0.5])
def test_friction_carries_a_sheet_with_a_moving_body(spin: float) -> None:
    """A sheet on a body follows its surface, also of one that turns about its axis.

    The surface speeds up at 0.5 m/s² at most, a tenth of what friction bears.
    """
    x, e = sheet_elements(8, 10, 0.03)
    cloth = MujocoCloth(e, replace(SOFT, friction=0.5), H, NO_NODES)
    state, at = lying(cloth, x), 0.0
    speed = 0.0
    for k in range(30):
        speed = 0.0 if spin else min(0.1, 0.5 * H * (k + 1))
        turn = min(1.0, (k + 1) / 20) * spin
        state, _ = cloth.step(state, capsule(at, np.array([speed, 0.0, 0.0]), turn), NOTHING)
        at += H * speed
    touched = (state.mode == STICK) | (state.mode == SLIP)
    assert touched.sum() > 10
    off = state.x[touched] - [at, 0.0, 0.0]
    surface = np.cross([0.0, spin, 0.0], off) + [speed, 0.0, 0.0]
    error = np.linalg.norm(state.v[touched] - surface, axis=1).mean()
    assert error < 0.2 * np.linalg.norm(surface, axis=1).mean()


def test_a_sheet_slips_at_the_coefficient_of_friction() -> None:
    """On a body that is drawn away under it, friction is μ times the normal force."""
    x, e = sheet_elements(8, 10, 0.03)
    for mu in (0.1, 0.3):
        cloth = MujocoCloth(e, replace(SOFT, friction=mu), H, NO_NODES)
        state = lying(cloth, x)
        # along the capsule, so that the ground stays the same
        away = capsule(0.0, np.array([0.0, 1.0, 0.0]))
        for _ in range(4):
            state, _ = cloth.step(state, away, NOTHING)
        assert (state.mode[state.owner >= 0] == SLIP).all()
        normal = find_proximity(state.x, away, 0.0).normal
        pressed = np.einsum("ij,ij->i", state.reaction, normal).sum()
        assert state.reaction[:, 1].sum() == pytest.approx(mu * pressed, rel=0.1)


def test_a_sleeve_is_drawn_over_a_limb_that_moves_and_does_not_enter_it() -> None:
    x, faces = tube(0.36, 0.45, 0.03)
    held = np.flatnonzero(x[:, 0] > 0.44).astype(np.int32)
    cloth = MujocoCloth(
        make_elements(x, faces), Material(stretch_stiffness=1500.0, damping=0.003), H, held
    )
    state, arm, deepest = ClothState.at_rest(x), -0.05, 0.0
    for k in range(250):
        speed = np.array([[0.12, 0.0, 0.16 * np.cos(4.0 * k * H)]])
        z = 0.16 / 4.0 * np.sin(4.0 * k * H)
        limb = Obstacles(
            np.array([[arm - 0.5, 0.0, z]]),
            np.array([[arm, 0.0, z]]),
            np.array([0.04]),
            speed,
            np.zeros((1, 3)),
        )
        state, _ = cloth.step(state, limb, np.zeros((len(held), 3)))
        arm += H * speed[0, 0]
        free = np.setdiff1d(np.arange(len(x)), held)
        deepest = max(deepest, -find_proximity(state.x[free], limb, 0.0).gap.min())
    assert arm > 0.2
    assert (state.owner == 0).any()
    assert deepest < 3e-3
    assert np.linalg.norm(state.x[:, 1:], axis=1).max() < 0.09, "the limb is inside"


def points_of(cloth: MujocoCloth, x: FloatArray) -> FloatArray:
    """Returns nodes, midpoints of edges and centroids: those that a run's summary looks at."""
    e = cloth.elements
    return np.concatenate([x, x[e.edge].mean(axis=1), x[e.triangle].mean(axis=1)])


@pytest.mark.parametrize("ends", [(0.04, 0.04), (0.05, 0.03)], ids=["capsule", "tapered"])
@pytest.mark.parametrize("spacing", [0.03, 0.04])
def test_a_taut_band_does_not_sink_into_a_limb(spacing: float, ends: tuple[float, float]) -> None:
    """The tension of both ends, T, presses 2 T on the limb, tens of times the band's weight.

    Its edges across the limb bear on it between their nodes.
    """
    x, e = sheet_elements(round(0.40 / spacing) + 1, 4, spacing)
    x = x - x.mean(axis=0) + [0.0, 0.0, 0.043]
    half = np.abs(x[:, 0]).max()
    held = np.flatnonzero(np.abs(x[:, 0]) > half - 1e-6).astype(np.int32)
    cloth = MujocoCloth(e, Material(stretch_stiffness=1500.0, damping=0.01), H, held)
    limb = Obstacles.resting(
        np.array([[0.0, -0.6, 0.0]]), np.array([[0.0, 0.6, 0.0]]), np.array([ends])
    )
    motion = np.tile([0.0, 0.0, -0.1], (len(held), 1))
    motion[:, 0] = -0.05 * np.sign(x[held, 0])
    state, pulls, presses = ClothState.at_rest(x), [], []
    for k in range(220):
        state, _ = cloth.step(state, limb, motion if k < 170 else 0.0 * motion)
        if k >= 180:
            pulls.append(-state.reaction[held, 2].sum())
            presses.append(np.delete(state.reaction, held, axis=0)[:, 2].sum())
    assert np.mean(pulls) > 10.0
    assert np.mean(presses) == pytest.approx(np.mean(pulls), rel=0.05)
    assert find_proximity(points_of(cloth, state.x), limb, 0.0).gap.min() > -1e-3


def test_layers_do_not_pass_through_each_other() -> None:
    """A sheet falls on a larger one that is held at its rim, at 0.4 m/s."""
    x, faces = sheet(11, 11, 0.03)
    small, others = sheet(5, 5, 0.03)
    n = len(x)
    both = np.concatenate([x, small + [0.09, 0.08, 0.01]])
    rim = np.flatnonzero((x[:, :2].min(axis=1) < 1e-9) | (x[:, :2].max(axis=1) > 0.299))
    e = make_elements(both, np.concatenate([faces, others + n]))
    lowest = {}
    for collide in (True, False):
        cloth = MujocoCloth(
            e, SOFT, H, rim.astype(np.int32), settings=MujocoSettings(self_collision=collide)
        )
        state = ClothState.at_rest(both)
        for _ in range(60):
            state, _ = cloth.step(state, Obstacles.none(), np.zeros((len(rim), 3)))
        lowest[collide] = state.x[n:, 2].min() - state.x[:n, 2].min()
    assert lowest[True] > -1e-3
    assert lowest[False] < -0.05


def test_a_step_depends_on_its_arguments_alone() -> None:
    """An integrator that has simulated something else, and a new one, do the same to the bit."""
    x, e = sheet_elements(8, 10, 0.03)
    used = MujocoCloth(e, SOFT, H, NO_NODES)
    state = lying(used, x, 30)
    body = capsule(0.01, np.array([0.1, 0.0, 0.0]))
    one, _ = used.step(state, body, NOTHING)
    two, _ = MujocoCloth(e, SOFT, H, NO_NODES).step(state, body, NOTHING)
    for name, value in vars(one).items():
        np.testing.assert_array_equal(value, getattr(two, name))
    assert one.reaction.any()


def test_forces_of_effects_act_on_the_nodes() -> None:
    x, e = sheet_elements(6, 6, 0.03)
    held = np.array([0], dtype=np.int32)
    cloth = MujocoCloth(e, SOFT, H, held, np.zeros(3))
    force = np.tile([0.0, 0.01, 0.0], (len(x), 1))
    state = ClothState.at_rest(x)
    for _ in range(5):
        before = state.v
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((1, 3)), Influences(force=force))
        change = cloth.mass @ (state.v - before) / H
        np.testing.assert_allclose(
            change, force.sum(axis=0) + state.reaction[held].sum(axis=0), atol=1e-4
        )


def test_what_mujoco_does_not_have_is_refused() -> None:
    x, e = sheet_elements(4, 4, 0.03)
    cloth, state = MujocoCloth(e, SOFT, H, NO_NODES), ClothState.at_rest(x)
    rough = Influences(friction=np.full(len(x), 0.2))
    with pytest.raises(ValueError, match="no friction that differs"):
        cloth.step(state, Obstacles.none(), NOTHING, rough)
    with pytest.raises(ValueError, match="limbs only"):
        cloth.step(state, Obstacles.floor(), NOTHING)
    with pytest.raises(ValueError, match="position node 3 is"):
        cloth.step(
            replace(state, x=np.where(np.arange(len(x))[:, None] == 3, np.nan, x)),
            Obstacles.none(),
            NOTHING,
        )
    fibres = Fibres.along(e, x, np.tile([1.0, 0.0, 0.0], (len(e.triangle), 1)), 10.0)
    with pytest.raises(ValueError, match="isotropic"):
        MujocoCloth(e, SOFT, H, NO_NODES, additions=Additions(fibres))


def test_a_diverged_garment_is_not_put_back_to_its_rest_shape() -> None:
    """MuJoCo resets simulations with velocities above 1e10, unless that is switched off."""
    x, e = sheet_elements(4, 4, 0.03)
    fast = replace(ClothState.at_rest(x), v=np.full_like(x, 1e12))
    state, _ = MujocoCloth(e, SOFT, H, NO_NODES).step(fast, Obstacles.none(), NOTHING)
    assert np.abs(state.x).min() > 1e9
