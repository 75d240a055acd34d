"""Each effect does what physics says."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.effects.air import AIR_DENSITY, PLATE_DRAG, AirDrag, Wind
from drake_dress.models.effects.composition import GarmentWithEffects, largest_strain, world_points
from drake_dress.models.effects.contact import (
    Adhesion,
    AnisotropicFriction,
    Friction,
    VelocityDependentFriction,
)
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.fabric import (
    AnisotropicStiffness,
    BendingStiffness,
    InternalDamping,
    RestSize,
    StrainStiffening,
    StretchStiffness,
)
from drake_dress.models.effects.grip import GripperCompliance, GripperLatency, GripperSlip
from drake_dress.models.effects.mass import GravityTilt, LocalMass, SurfaceDensity
from drake_dress.models.effects.mounts import GRIPPER_TIME, Mounts, MountState
from drake_dress.models.effects.person import LimbCompliance, LimbRadius
from drake_dress.models.effects.sensing import CameraRotation, CameraTranslation, TimeOffset
from drake_dress.models.human.body import BodyMeasures
from tests.models.effects.scene import MATERIAL, STEP, cloth, sheet_mesh
from tests.present import present

G = 9.81
NONE = np.zeros((0, 3))


def flat_mesh(
    columns: int = 6, rows: int = 6, spacing: float = 0.04
) -> tuple[FloatArray, IntArray]:
    """Returns a horizontal sheet; its warp is along −z, so give it another where that matters."""
    x, faces = sheet_mesh(columns, rows, spacing)
    return np.stack([x[:, 0], -x[:, 2], np.zeros(len(x))], axis=1), faces[:, ::-1]


def fall(
    garment: GarmentWithEffects,
    x: FloatArray,
    steps: int,
    v: FloatArray | None = None,
    obstacles: Obstacles | None = None,
) -> ClothState:
    state = ClothState.at_rest(x)
    if v is not None:
        state = dataclasses.replace(state, v=np.array(v))
    still = np.zeros((len(garment.held), 3))
    for _ in range(steps):
        state, _ = garment.step(state, obstacles or Obstacles.none(), still)
    return state


def hung(
    effects: Sequence[Effect], seconds: float = 1.2, damping: float = 0.05, **options: Any
) -> tuple[ClothState, GarmentWithEffects]:
    """Returns a sheet at rest that hangs from its top row, and its garment."""
    x, _ = sheet_mesh()
    top = np.flatnonzero(x[:, 2] == 0.0)
    material = dataclasses.replace(options.pop("material", MATERIAL), damping=damping)
    garment = cloth(effects, top, step=0.005, material=material, **options)
    return fall(garment, x, round(seconds / 0.005)), garment


def test_a_flat_sheet_falls_at_the_terminal_speed_of_a_plate() -> None:
    x, faces = flat_mesh()
    drag = AirDrag(coefficient=4.0)
    terminal = np.sqrt(2.0 * MATERIAL.surface_density * G / (AIR_DENSITY * drag.coefficient))
    v = np.tile([0.0, 0.0, -terminal], (len(x), 1))
    garment = cloth([drag], mesh=(x, faces))
    after = fall(garment, x, 5, v)
    mean = garment.mass @ after.v / garment.mass.sum()
    np.testing.assert_allclose(mean, [0.0, 0.0, -terminal], rtol=2e-3, atol=1e-6)


def test_a_sheet_that_moves_in_its_own_plane_feels_no_air() -> None:
    x, faces = flat_mesh()
    garment = cloth([AirDrag(coefficient=4.0)], mesh=(x, faces))
    after = fall(garment, x, 1, np.tile([2.0, 0.0, 0.0], (len(x), 1)))
    np.testing.assert_allclose(after.v[:, :2], np.tile([2.0, 0.0], (len(x), 1)), atol=1e-9)


def test_wind_pushes_a_resting_plate_with_its_stagnation_pressure() -> None:
    x, faces = sheet_mesh()
    garment = cloth([Wind(y=2.0)], mesh=(x, faces))
    after = fall(garment, x, 1)
    pressure = 0.5 * AIR_DENSITY * PLATE_DRAG * 2.0**2
    mean = garment.mass @ after.v / garment.mass.sum()
    assert mean[1] == pytest.approx(STEP * pressure / MATERIAL.surface_density, rel=1e-3)


def test_density_adds_weight_to_the_grippers_and_no_stretch_law() -> None:
    added = 0.1
    state, garment = hung([SurfaceDensity(added=added)])
    area = garment.elements.triangle_area.sum()
    weight = state.reaction[garment.held].sum(axis=0)
    assert weight[2] == pytest.approx((MATERIAL.surface_density + added) * area * G, rel=2e-3)


def test_a_local_mass_pulls_with_its_weight_where_it_sits() -> None:
    x, _ = sheet_mesh()
    place = x[10]
    mass = LocalMass(mass=0.05, x=place[0], y=place[1], z=place[2])
    state, garment = hung([mass])
    plain, _ = hung([])
    more = (state.reaction - plain.reaction)[garment.held].sum(axis=0)
    assert more[2] == pytest.approx(0.05 * G, rel=5e-3)
    added = garment.mass - cloth([]).mass
    assert added.sum() == pytest.approx(0.05)
    assert np.linalg.norm(added @ x / added.sum() - place) < 0.04


def test_stretch_halves_where_stiffness_doubles() -> None:
    soft, _garment = hung([])
    hard, _ = hung([StretchStiffness(added=MATERIAL.stretch_stiffness)])
    x, _ = sheet_mesh()
    drop = x[:, 2].min() - soft.x[:, 2].min(), x[:, 2].min() - hard.x[:, 2].min()
    assert drop[0] / drop[1] == pytest.approx(2.0, rel=0.02)


def test_warp_stiffness_adds_along_the_warp_only() -> None:
    """Down the warp k + k_a bears the load, across it k alone."""
    plain, _garment = hung([])
    warp, stiff = hung([AnisotropicStiffness(warp=MATERIAL.stretch_stiffness)])
    x, _ = sheet_mesh()
    drop = x[:, 2].min() - plain.x[:, 2].min(), x[:, 2].min() - warp.x[:, 2].min()
    assert drop[0] / drop[1] == pytest.approx(2.0, rel=0.05)
    # a sheet of fibres stretched across them feels nothing of them
    assert isinstance(stiff._inner, ImplicitCloth)
    fibres = present(stiff._inner.additions.fibres)
    force = np.zeros_like(x)
    fibres.add_force(x * np.array([1.1, 1.0, 1.0]), force)
    np.testing.assert_allclose(force, 0.0, atol=1e-10)


def test_stiffening_takes_the_secant_stiffness_of_its_strain() -> None:
    """A strip under the tension t is strained by ε with k ε (1 + c ε) = t."""
    rate = 20.0
    soft = dataclasses.replace(MATERIAL, stretch_stiffness=40.0)
    plain, garment = hung([], material=soft)
    stiff, _ = hung([StrainStiffening(rate=rate)], material=soft)
    columns, rows, spacing = 6, 8, 0.04
    height = (rows - 1) * spacing
    # tension at depth s below the top: ρ g (height − s)
    s = (np.arange(2000) + 0.5) / 2000 * height
    tension = soft.surface_density * G * (height - s)
    k = soft.stretch_stiffness
    strain = (-1.0 + np.sqrt(1.0 + 4.0 * rate * tension / k)) / (2.0 * rate)
    expected = height * strain.mean()
    middle = np.arange(columns * rows).reshape(columns, rows)[2:4, -1]
    x, _ = sheet_mesh()
    assert np.mean(x[middle, 2] - stiff.x[middle, 2]) == pytest.approx(expected, rel=0.05)
    assert np.mean(x[middle, 2] - plain.x[middle, 2]) > 1.15 * expected
    assert largest_strain(garment.elements, x).max() < 1e-12


def test_bending_stiffness_scales_the_couple_of_a_bent_strip() -> None:
    from drake_dress.models.cloth.forces import internal_force

    x, _ = sheet_mesh()
    bent = x.copy()
    angle = x[:, 2] / 0.3
    bent[:, 1], bent[:, 2] = 0.3 * (1.0 - np.cos(angle)), 0.3 * np.sin(angle)
    forces = []
    for effects in ([], [BendingStiffness(added=MATERIAL.bending_stiffness)]):
        garment = cloth(effects)
        m = garment.material
        forces.append(internal_force(garment.elements, 0.0, m.bending_stiffness, bent))
    np.testing.assert_allclose(forces[1], 2.0 * forces[0], rtol=1e-12, atol=1e-15)


def test_internal_damping_takes_energy_from_deformation_and_none_from_rigid_motion() -> None:
    x, _ = sheet_mesh()
    rng = np.random.default_rng(0)
    wave = 0.3 * np.sin(25.0 * x[:, 2:]) * np.array([0.0, 1.0, 0.0])
    energies = []
    for added in (0.0, 0.02):
        garment = cloth([InternalDamping(added=added)])
        after = fall(garment, x, 10, wave + G * 5 * STEP * np.array([0.0, 0.0, 1.0]))
        relative = after.v - garment.mass @ after.v / garment.mass.sum()
        energies.append(float(garment.mass @ np.sum(relative**2, axis=1)))
    assert energies[1] < 0.9 * energies[0]
    velocity = rng.standard_normal(3)
    garment = cloth([InternalDamping(added=0.05)])
    after = fall(garment, x, 5, np.tile(velocity, (len(x), 1)))
    np.testing.assert_allclose(
        after.v, np.tile(velocity - [0.0, 0.0, G * 5 * STEP], (len(x), 1)), atol=1e-8
    )


def test_a_shrunken_garment_keeps_its_mass() -> None:
    plain, small = cloth([]), cloth([RestSize(strain=-0.05)])
    assert small.mass.sum() == pytest.approx(plain.mass.sum())
    np.testing.assert_allclose(
        small.elements.edge_rest_length, 0.95 * plain.elements.edge_rest_length
    )


def slide(
    effects: Sequence[Effect],
    tilt: float,
    steps: int = 250,
    direction: Sequence[float] = (1.0, 0.0),
    speed: float = 0.0,
) -> tuple[float, GarmentWithEffects]:
    """Returns mean velocity along a slope after `steps`, of a sheet that lies on it."""
    x, faces = flat_mesh(4, 4)
    x = x + [0.0, 0.0, MATERIAL.margin]
    down = np.array([direction[0], direction[1], 0.0])
    # the slope is level here, gravity leans
    garment = cloth(
        [
            GravityTilt(
                about_x=float(np.arctan(tilt) * direction[1]),
                about_y=float(-np.arctan(tilt) * direction[0]),
            ),
            *effects,
        ],
        mesh=(x, faces),
    )
    state = fall(garment, x, steps, np.tile(speed * down, (len(x), 1)), Obstacles.floor())
    return float(np.mean(state.v @ down)), garment


@pytest.mark.parametrize("added", [-0.15, 0.0, 0.2])
def test_a_sheet_slides_where_the_slope_is_steeper_than_friction(added: float) -> None:
    mu = MATERIAL.friction + added
    held, _ = slide([Friction(added=added)], 0.85 * mu)
    moving, _ = slide([Friction(added=added)], 1.2 * mu)
    angle = np.arctan(1.2 * mu)
    assert abs(held) < 1e-3
    expected = 250 * STEP * G * (np.sin(angle) - mu * np.cos(angle))
    assert moving == pytest.approx(expected, rel=0.05)


def test_viscous_friction_leaves_the_speed_at_which_it_bears_the_slope() -> None:
    rate = 2.0
    tilt = MATERIAL.friction + 0.2
    speed, _ = slide([VelocityDependentFriction(rate=rate)], tilt, steps=1500)
    assert speed == pytest.approx(0.2 / rate, rel=0.05)


def test_friction_across_and_along_the_warp_differ_as_the_contrast_says() -> None:
    """The warp of a flat sheet whose rest frame has it along −z is projected: along y here."""
    x, faces = flat_mesh(4, 4)
    from drake_dress.models.cloth.scheme import Scheme
    from drake_dress.models.effects.composition import GarmentWithEffects

    x = x + [0.0, 0.0, MATERIAL.margin]
    speeds = []
    for direction in ((1.0, 0.0), (0.0, 1.0)):
        tilt = GravityTilt(
            about_x=float(np.arctan(0.3) * direction[1]),
            about_y=float(-np.arctan(0.3) * direction[0]),
        )
        garment = GarmentWithEffects(
            x,
            faces,
            np.tile([1.0, 0.0, 0.0], (len(faces), 1)),
            MATERIAL,
            [tilt, AnisotropicFriction(contrast=0.5)],
            Scheme(np.zeros(0, dtype=np.int32), STEP, ImplicitSettings(1e-8, 300)),
        )
        down = np.array([*direction, 0.0])
        start = np.tile(0.05 * down, (len(x), 1))
        state = fall(garment, x, 200, start, Obstacles.floor())
        speeds.append(float(np.mean(state.v @ down)))
    # along the warp μ = 0.45 stops it on a slope of 0.3, across it μ = 0.15 does not
    assert abs(speeds[0]) < 1e-3
    angle = np.arctan(0.3)
    expected = 0.05 + 200 * STEP * G * (np.sin(angle) - 0.15 * np.cos(angle))
    assert speeds[1] == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(("strength", "stays"), [(1.2, True), (0.8, False)])
def test_cloth_hangs_from_a_ceiling_it_clings_to(strength: float, stays: bool) -> None:
    from drake_dress.models.cloth.contact.obstacles import HalfSpaces

    x, faces = flat_mesh(4, 4)
    ceiling = dataclasses.replace(
        Obstacles.none(),
        half_spaces=HalfSpaces.resting(np.zeros(3), np.array([0.0, 0.0, -1.0])),
    )
    x = x - [0.0, 0.0, MATERIAL.margin]
    weight = MATERIAL.surface_density * G
    garment = cloth([Adhesion(strength=strength * weight)], mesh=(x, faces))
    # pressed on for one step, as adhesion needs contact to begin with
    up = np.tile([0.0, 0.0, 0.02], (len(x), 1))
    state = fall(garment, x, 60, up, ceiling)
    assert (abs(state.x[:, 2].mean() - x[0, 2]) < 1e-3) == stays


def test_limbs_grow_and_the_trunk_does_not() -> None:
    before = BodyMeasures()
    after = LimbRadius(added=0.01).apply(before)
    assert after.forearm_radius == pytest.approx(before.forearm_radius + 0.01)
    assert after.chest_width == before.chest_width


@pytest.mark.parametrize(
    ("kind", "name"), [(GripperCompliance, "gripper"), (LimbCompliance, "limb")]
)
def test_a_compliant_mount_comes_to_rest_at_compliance_times_force(
    kind: type[GripperCompliance] | type[LimbCompliance], name: str
) -> None:
    force = np.array([[1.0, 0.0, -3.0], [0.0, 2.0, 0.0]])
    limbs = np.vstack([force, force])
    mounts = Mounts([kind(compliance=0.01)])
    state, passed = MountState.at_rest(4), 0.0
    for _ in range(400):
        state = mounts.step(state, force, limbs, 0.002)
        passed = max(passed, float(np.abs(getattr(state, name)[0, 2])))
    expected = 0.01 * (force if name == "gripper" else limbs)
    np.testing.assert_allclose(getattr(state, name), expected, atol=1e-6)
    # critically damped: it never swings past
    assert passed <= 0.03 + 1e-6
    assert not np.any(MountState.of(state.flat()).flat() - state.flat())


@pytest.mark.parametrize("h", [0.001, 0.004, 0.01])
@pytest.mark.parametrize("share", [1.0, 2.0])
def test_a_compliant_gripper_that_is_lighter_than_its_load_comes_to_rest(
    h: float, share: float
) -> None:
    """With the load's force a step late; what it moves is known, or taken for too much."""
    load, compliance, weight = 0.3, 0.02, np.array([0.0, 0.0, -9.81])
    assert load > 5.0 * GRIPPER_TIME**2 / compliance
    mounts = Mounts([GripperCompliance(compliance=compliance)])
    state, path = MountState.at_rest(4), []
    for _ in range(round(4.0 / h)):
        force = load * (weight - state.gripper_change / h)
        moved = np.full(2, share * load)
        state = mounts.step(state, force, np.zeros((4, 3)), h, moved)
        path.append(state.gripper[0, 2])
    rest = compliance * load * weight[2]
    assert path[-1] == pytest.approx(rest, rel=0.01)
    # mount and load together swing with damping: (τ² + c m) u'' + 2 τ u' + u = c m g
    inertia = GRIPPER_TIME**2 + compliance * load
    decay = GRIPPER_TIME / inertia
    most = rest * (1.0 + np.exp(-np.pi * decay / np.sqrt(1.0 / inertia - decay**2)))
    assert min(path) == pytest.approx(most, rel=0.1)


def test_a_gripper_moves_more_of_a_garment_in_a_longer_step_and_never_more_than_all() -> None:
    x, _ = sheet_mesh()
    top = np.flatnonzero(x[:, 2] == 0.0)
    mounts, moved = Mounts([GripperCompliance(compliance=0.01)]), []
    for h in (0.001, 0.01, 0.1, 1.0):
        garment = cloth([], top, step=h)
        moved.append(mounts.moved_mass(garment, np.zeros(len(top), dtype=np.int32))[0])
    assert garment.mass[top].sum() < moved[0] < moved[1] < moved[2] < moved[3]
    assert moved[3] == pytest.approx(garment.mass.sum(), rel=0.01)
    assert moved[3] <= garment.mass.sum()
    assert not Mounts([]).moved_mass(garment, np.zeros(len(top), dtype=np.int32)).any()


def test_cloth_creeps_out_of_a_gripper_along_the_pull_beyond_the_threshold() -> None:
    mounts = Mounts([GripperSlip(rate=0.01, threshold=1.0)])
    force = np.array([[0.0, 0.0, -3.0], [0.5, 0.0, 0.0]])
    state = MountState.at_rest(4)
    for _ in range(100):
        state = mounts.step(state, force, np.zeros((4, 3)), 0.01)
    np.testing.assert_allclose(state.slip, [[0.0, 0.0, -0.02], [0.0, 0.0, 0.0]], atol=1e-12)


def test_clocks_let_things_have_happened_earlier() -> None:
    t = np.linspace(0.0, 1.0, 3)
    np.testing.assert_allclose(GripperLatency(delay=0.1).apply(t), t - 0.1)
    np.testing.assert_allclose(TimeOffset(offset=-0.2).apply(t), t + 0.2)


def test_cameras_move_points_rigidly_and_back() -> None:
    points = np.random.default_rng(1).standard_normal((7, 3))
    effects = [CameraTranslation(x=0.1, z=-0.2), CameraRotation(x=0.1, y=-0.2, z=0.3)]
    seen = points
    for effect in effects:
        seen = effect.apply(seen)
    distance = np.linalg.norm(points[1:] - points[:-1], axis=1)
    np.testing.assert_allclose(np.linalg.norm(seen[1:] - seen[:-1], axis=1), distance)
    np.testing.assert_allclose(world_points(seen, effects), points, atol=1e-12)


def test_tilted_gravity_keeps_its_size_and_leans_as_the_angle_says() -> None:
    g = GravityTilt(about_y=0.1).apply(np.array([0.0, 0.0, -G]))
    assert np.linalg.norm(g) == pytest.approx(G)
    assert g[0] == pytest.approx(-G * np.sin(0.1))
