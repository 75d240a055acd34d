"""Laws of motion of the plant's garment."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import STICK
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.sheets import NO_NODES, sheet_elements

H = 0.004
NOTHING = np.zeros((0, 3))


def incline(angle: float) -> Obstacles:
    """A half-space through the origin, inclined about y by `angle`."""
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    return replace(Obstacles.none(), half_spaces=HalfSpaces.resting(np.zeros(3), normal))


def test_free_fall_is_exact() -> None:
    x, e = sheet_elements(8, 8, 0.02)
    cloth = ImplicitCloth(e, Material(), H, NO_NODES)
    state = ClothState.at_rest(x)
    for _ in range(50):
        state, _ = cloth.step(state, Obstacles.none(), NOTHING)
    np.testing.assert_allclose(state.v[:, 2], -9.81 * 50 * H, rtol=1e-9)
    np.testing.assert_allclose(state.v[:, :2], 0.0, atol=1e-12)


def test_momentum_changes_by_gravity_and_contact_alone() -> None:
    x, e = sheet_elements(14, 14, 0.02)
    held = np.array([0, 1], dtype=np.int32)
    cloth = ImplicitCloth(
        e, Material(stretch_stiffness=200.0), H, held, settings=ImplicitSettings(tolerance=1e-8)
    )
    ball = Obstacles.resting(
        np.array([[0.13, 0.05, -0.06]]), np.array([[0.13, 0.2, -0.06]]), np.array([0.05])
    )
    state = ClothState.at_rest(x)
    touched = False
    for _ in range(120):
        before = (cloth.mass[:, None] * state.v).sum(axis=0)
        state, _ = cloth.step(state, ball, np.tile([0.02, 0.0, 0.1], (2, 1)))
        after = (cloth.mass[:, None] * state.v).sum(axis=0)
        touched |= bool(np.any(state.mode == STICK))
        weight = cloth.mass.sum() * cloth.gravity
        np.testing.assert_allclose(
            after - before, H * (weight + state.reaction.sum(axis=0)), atol=1e-6
        )
    assert touched


def test_gripper_at_rest_feels_the_weight() -> None:
    x, e = sheet_elements(10, 10, 0.02)
    held = np.arange(10, dtype=np.int32)
    cloth = ImplicitCloth(e, Material(damping=0.02), H, held)
    state = ClothState.at_rest(np.column_stack([x[:, 1], np.zeros(len(x)), -x[:, 0]]))
    for _ in range(400):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((10, 3)))
    assert state.reaction[held].sum(axis=0)[2] == pytest.approx(cloth.mass.sum() * 9.81, rel=0.01)


def _slide(angle: float, friction: float, steps: int) -> tuple[FloatArray, ClothState]:
    x, e = sheet_elements(9, 9, 0.02)
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    normal = turn @ np.array([0.0, 0.0, 1.0])
    start = (x - x.mean(axis=0)) @ turn.T + 0.003 * normal
    material = Material(friction=friction, stretch_stiffness=300.0)
    cloth = ImplicitCloth(e, material, H, NO_NODES)
    state = ClothState.at_rest(start)
    for _ in range(steps):
        state, _ = cloth.step(state, incline(angle), NOTHING)
    return start, state


def test_cloth_on_a_gentle_incline_sticks() -> None:
    friction = 0.4
    start, state = _slide(np.arctan(friction) - 0.08, friction, 150)
    assert np.abs(state.x - start).max() < 2e-4
    assert np.abs(state.v).max() < 1e-3


def test_cloth_on_a_steep_incline_slides_with_coulomb_acceleration() -> None:
    friction = 0.3
    angle = np.arctan(friction) + 0.3
    steps = 100
    _, state = _slide(angle, friction, steps)
    downhill = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    expected = 9.81 * (np.sin(angle) - friction * np.cos(angle)) * steps * H
    assert (state.v @ downhill).mean() == pytest.approx(expected, rel=0.03)


def test_friction_stays_in_its_cone() -> None:
    friction = 0.3
    angle = np.arctan(friction) + 0.3
    _, state = _slide(angle, friction, 80)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    pressure = state.reaction @ normal
    tangential = np.linalg.norm(state.reaction - pressure[:, None] * normal, axis=1)
    total = pressure.sum()
    assert pressure.min() > -1e-3 * total
    assert tangential.sum() <= 1.02 * friction * total


def test_sticking_node_follows_a_moving_limb() -> None:
    x, e = sheet_elements(6, 6, 0.02)
    start = x - x.mean(axis=0)
    start[:, 2] = 0.053
    cloth = ImplicitCloth(e, Material(friction=5.0), H, NO_NODES)
    state = ClothState.at_rest(start)
    velocity = np.array([[0.1, 0.05, 0.0]])
    a, b = np.array([[-0.2, 0.0, 0.0]]), np.array([[0.2, 0.0, 0.0]])
    for k in range(200):
        limb = Obstacles(
            a + k * H * velocity,
            b + k * H * velocity,
            np.array([0.05]),
            velocity,
            np.zeros((1, 3)),
        )
        state, _ = cloth.step(state, limb, NOTHING)
    sticking = state.mode == STICK
    assert sticking.sum() >= 6
    np.testing.assert_allclose(state.v[sticking].mean(axis=0)[:2], velocity[0, :2], atol=2e-3)


def test_landing_does_not_bounce() -> None:
    x, e = sheet_elements(8, 8, 0.02)
    start = x - x.mean(axis=0)
    start[:, 2] = 0.01
    cloth = ImplicitCloth(e, Material(), H, NO_NODES)
    state = ClothState(
        start,
        np.tile([0.0, 0.0, -1.0], (64, 1)),
        np.zeros(64, dtype=np.int32),
        np.zeros((64, 3)),
        np.full(64, -1, dtype=np.int32),
    )
    for _ in range(20):
        state, _ = cloth.step(state, incline(0.0), NOTHING)
    assert np.abs(state.v).max() < 0.05
    assert state.x[:, 2].min() > 0.0


def test_thin_finger_does_not_slip_between_nodes() -> None:
    """A finger thinner than half the spacing is stopped by edges and faces."""
    x, e = sheet_elements(9, 9, 0.02)
    start = x - x.mean(axis=0)
    held = np.flatnonzero(np.abs(start[:, :2]).max(axis=1) > 0.079).astype(np.int32)
    cloth = ImplicitCloth(e, Material(stretch_stiffness=400.0), H, held)
    state = ClothState.at_rest(start)
    tip, speed = np.array([0.0105, 0.007, -0.012]), 0.05
    for k in range(200):
        p = (tip + np.array([0.0, 0.0, speed * k * H]))[None]
        finger = Obstacles(
            p,
            p - np.array([[0.0, 0.0, 0.2]]),
            np.array([0.006]),
            np.array([[0.0, 0.0, speed]]),
            np.zeros((1, 3)),
        )
        state, _ = cloth.step(state, finger, np.zeros((len(held), 3)))
    near = np.linalg.norm(state.x[:, :2] - tip[:2], axis=1) < 0.02
    assert state.x[near, 2].min() > p[0, 2] - 0.004


@pytest.mark.parametrize("name", ["position", "velocity"])
def test_input_that_is_not_finite_names_its_node_and_changes_nothing(name: str) -> None:
    x, e = sheet_elements(6, 6, 0.02)
    held = np.array([0, 5], dtype=np.int32)
    cloth = ImplicitCloth(e, Material(), H, held)
    state = ClothState.at_rest(x)
    (state.x if name == "position" else state.v)[17, 2] = np.nan
    kept = state.x.copy(), state.v.copy()
    with pytest.raises(ValueError, match=f"{name} node 17 is"):
        cloth.step(state, Obstacles.none(), np.zeros((2, 3)))
    np.testing.assert_array_equal(state.x, kept[0])
    np.testing.assert_array_equal(state.v, kept[1])
    good, _ = cloth.step(ClothState.at_rest(x), Obstacles.none(), np.zeros((2, 3)))
    assert np.isfinite(good.x).all()


def test_motion_of_held_nodes_that_is_not_finite_is_told() -> None:
    x, e = sheet_elements(6, 6, 0.02)
    cloth = ImplicitCloth(e, Material(), H, np.array([0, 5], dtype=np.int32))
    motion = np.zeros((2, 3))
    motion[1, 0] = np.nan
    with pytest.raises(ValueError, match="held"):
        cloth.step(ClothState.at_rest(x), Obstacles.none(), motion)


def _vibrated(implicitness: float, time_step: float, duration: float = 0.24) -> FloatArray:
    """Returns a strip (n,3) that was pulled by 0.3 %, held at one end and let go."""
    x, e = sheet_elements(3, 9, 0.03)
    held = np.flatnonzero(x[:, 1] == 0.0).astype(np.int32)
    cloth = ImplicitCloth(
        e,
        Material(stretch_stiffness=5.0, bending_stiffness=0.0),
        time_step,
        held,
        np.zeros(3),
        settings=ImplicitSettings(tolerance=1e-10, max_iterations=500, implicitness=implicitness),
    )
    shape = x[:, 1] / x[:, 1].max()
    state = ClothState.at_rest(x + np.outer(0.003 * 0.24 * np.sin(0.5 * np.pi * shape), [0, 1, 0]))
    for _ in range(round(duration / time_step)):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((len(held), 3)))
    return state.x


def test_error_of_implicit_euler_is_of_first_order_and_falls_with_its_share() -> None:
    """The error's leading term is (θ − 1/2) h."""
    exact = _vibrated(0.6, 0.00025)
    off = [np.abs(_vibrated(1.0, h) - exact).max() for h in (0.004, 0.002)]
    assert off[0] / off[1] == pytest.approx(2.0, rel=0.35)
    less = np.abs(_vibrated(0.7, 0.004) - exact).max()
    assert less / off[0] == pytest.approx(0.4, rel=0.35)


def test_steps_twice_as_long_are_nearer_the_truth_at_0_7_than_implicit_euler_s() -> None:
    exact = _vibrated(0.6, 0.00025)
    off = {w: np.abs(_vibrated(*w) - exact).max() for w in ((0.7, 0.008), (1.0, 0.004))}
    assert off[0.7, 0.008] < off[1.0, 0.004]


@pytest.mark.parametrize("implicitness", [1.0, 0.7])
def test_what_lands_is_at_rest_on_the_floor_and_carries_its_weight(implicitness: float) -> None:
    x, e = sheet_elements(8, 8, 0.02)
    start = x - x.mean(axis=0)
    start[:, 2] = 0.01
    cloth = ImplicitCloth(
        e, Material(), 0.008, NO_NODES, settings=ImplicitSettings(implicitness=implicitness)
    )
    state = replace(ClothState.at_rest(start), v=np.tile([0.0, 0.0, -1.0], (64, 1)))
    for _ in range(60):
        state, _ = cloth.step(state, incline(0.0), NOTHING)
    assert np.abs(state.v).max() < 0.02
    assert state.x[:, 2].min() > 0.0
    assert state.reaction[:, 2].sum() == pytest.approx(cloth.mass.sum() * 9.81, rel=0.02)


def test_a_displacement_that_does_not_stretch_is_made_whole() -> None:
    x, e = sheet_elements(10, 10, 0.03)
    cloth = ImplicitCloth(e, Material(), 1.0 / 30.0, NO_NODES)
    d = np.cross([0.0, 0.2, 0.1], x - x.mean(axis=0)) + [0.02, -0.01, 0.03]
    moved = cloth.displaced(ClothState.at_rest(x), d, Obstacles.none())
    np.testing.assert_allclose(moved, x + d, atol=2e-4)


def test_a_displacement_that_stretches_is_hardly_made() -> None:
    x, e = sheet_elements(10, 10, 0.03)
    cloth = ImplicitCloth(e, Material(stretch_stiffness=800.0), 1.0 / 30.0, NO_NODES)
    d = 0.1 * (x - x.mean(axis=0))
    moved = cloth.displaced(ClothState.at_rest(x), d, Obstacles.none())
    assert np.linalg.norm(moved - x) < 0.02 * np.linalg.norm(d)


def test_a_displacement_keeps_held_nodes_and_does_not_enter_bodies() -> None:
    x, e = sheet_elements(10, 10, 0.03)
    held = np.array([0, 9], dtype=np.int32)
    cloth = ImplicitCloth(e, Material(stretch_stiffness=800.0), 1.0 / 30.0, held)
    below = Obstacles.floor(-0.02)
    d = np.zeros_like(x)
    d[:, 2] = -0.06
    moved = cloth.displaced(ClothState.at_rest(x), d, below)
    np.testing.assert_allclose(moved[held], x[held], atol=1e-12)
    assert moved[:, 2].min() > -0.02 - 1e-3
    assert moved[:, 2].min() < -0.01
