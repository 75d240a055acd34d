"""Laws that all schemes of the garment hold, each against its analytic value."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.contact.wrenches import body_wrenches
from drake_dress.models.cloth.elastic_energy import elastic_energy
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import GRAVITY, ClothState
from tests.models.cloth.sheets import NO_NODES, sheet, sheet_elements

NOTHING = np.zeros((0, 3))
WEIGHTLESS = np.zeros(3)
SCHEMES = ("one_step", "conjugate_gradients", "implicit", "second_order", "projective")
SETTINGS: dict[str, Any] = {
    "one_step": ExplicitSettings(iterations=1),
    "conjugate_gradients": ExplicitSettings(iterations=30),
    "implicit": ImplicitSettings(tolerance=1e-6, max_iterations=300, max_passes=6),
    "second_order": ImplicitSettings(
        tolerance=1e-6, max_iterations=300, max_passes=6, implicitness=0.7
    ),
    "projective": ProjectiveSettings(tolerance=1e-7, quasi_newton=True),
}


class Run:
    """Steps any scheme the same way: `advance` takes velocities of the held nodes, m/s."""

    def __init__(
        self,
        scheme: str,
        elements: Elements,
        material: Material,
        h: float,
        held: IntArray,
        x: FloatArray,
        v: FloatArray | None = None,
        gravity: FloatArray = GRAVITY,
    ) -> None:
        self.h, settings = h, SETTINGS[scheme]
        self._state = replace(ClothState.at_rest(x), v=np.zeros_like(x) if v is None else v.copy())
        self._explicit: ExplicitBiasCloth | None = None
        given = (elements, material, h, held, gravity)
        if isinstance(settings, ExplicitSettings):
            self._explicit = ExplicitBiasCloth(*given, settings)
            self.mass = self._explicit.mass
            return
        kind = ImplicitCloth if isinstance(settings, ImplicitSettings) else ProjectiveDynamicsCloth
        self._cloth: Any = kind(*given, settings=settings)
        self.mass = self._cloth.mass

    @property
    def x(self) -> FloatArray:
        """(n,3) m."""
        return self._state.x

    @property
    def v(self) -> FloatArray:
        """(n,3) m/s."""
        return self._state.v

    @property
    def reaction(self) -> FloatArray:
        """(n,3) N."""
        return self._state.reaction

    def advance(self, held_velocity: FloatArray, obstacles: Obstacles) -> None:
        if self._explicit is None:
            self._state, _ = self._cloth.step(self._state, obstacles, held_velocity)
            return
        x, v, reaction, _ = self._explicit.step(self.x, self.v, self.h * held_velocity, obstacles)
        self._state = replace(self._state, x=x, v=v, reaction=reaction)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_momentum_is_conserved_without_outer_forces(scheme: str) -> None:
    x, e = sheet_elements(10, 12, 0.03)
    rng = np.random.default_rng(1)
    run = Run(scheme, e, Material(), 0.01, NO_NODES, x, rng.normal(size=x.shape), WEIGHTLESS)
    mass = run.mass[:, None]
    before = (mass * run.v).sum(axis=0)
    for _ in range(50):
        run.advance(NOTHING, Obstacles.none())
    np.testing.assert_allclose((mass * run.v).sum(axis=0), before, atol=1e-6 * np.abs(before).max())


@pytest.mark.parametrize("scheme", SCHEMES)
def test_hanging_strip_stretches_by_its_weight(scheme: str) -> None:
    """δ = ρ g L² / (2 k)."""
    rows = 26
    x, e = sheet_elements(4, rows, 0.02)
    start = np.column_stack([x[:, 0], np.zeros(len(x)), -x[:, 1]])
    held = np.flatnonzero(x[:, 1] == 0.0).astype(np.int32)
    m = Material(surface_density=0.3, stretch_stiffness=100.0, damping=0.05)
    run = Run(scheme, e, m, 0.01, held, start)
    for _ in range(600):
        run.advance(np.zeros((len(held), 3)), Obstacles.none())
    length = 0.02 * (rows - 1)
    sag = -run.x[:, 2].min() - length
    assert sag == pytest.approx(0.3 * 9.81 * length**2 / (2 * 100.0), rel=0.02)


def _lattice(columns: int, rows: int, spacing: float) -> tuple[FloatArray, IntArray]:
    """Returns a sheet of equilateral triangles: positions (n,3) and faces."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    height = 0.5 * np.sqrt(3.0) * spacing
    x = np.stack([spacing * (i + 0.5 * (j % 2)), height * j, 0.0 * i], axis=-1).reshape(-1, 3)
    faces = []
    for k in range(columns - 1):
        for r in range(rows - 1):
            a, b, c, d = k * rows + r, (k + 1) * rows + r, k * rows + r + 1, (k + 1) * rows + r + 1
            faces += [[a, b, d], [a, d, c]] if r % 2 else [[a, b, c], [b, d, c]]
    return x, np.array(faces, dtype=np.int32)


@pytest.mark.parametrize("across", [False, True])
def test_clamped_strip_droops_by_its_bending_length(across: bool) -> None:
    """Peirce: a strip that hangs over by l = 2 (B / ρg)^⅓ droops by 41.5°.

    Along a line of the lattice of equilateral triangles, and across one.
    """
    m = Material(surface_density=0.3, stretch_stiffness=2000.0, bending_stiffness=5e-4, damping=0.1)
    overhang = 2.0 * (m.bending_stiffness / (m.surface_density * 9.81)) ** (1 / 3)
    count = 31
    row = overhang / (count - 1.5)
    if across:
        x, faces = _lattice(7, count, row / (0.5 * np.sqrt(3.0)))
        x, faces = x[:, [1, 0, 2]], faces[:, ::-1]
        clamped, edge = 1.01 * row, 0.5 * row
    else:
        x, faces = _lattice(count, 7, row)
        clamped, edge = 1.51 * row, 0.75 * row
    # Hinges bend over the row beside them: the clamp ends halfway between its last two rows.
    held = np.flatnonzero(x[:, 0] < clamped).astype(np.int32)
    run = Run("implicit", make_elements(x, np.ascontiguousarray(faces)), m, 0.01, held, x)
    for _ in range(400):
        run.advance(np.zeros((len(held), 3)), Obstacles.none())
    assert np.abs(run.v).max() < 1e-3
    tip = run.x[x[:, 0] > x[:, 0].max() - 0.1 * row].mean(axis=0)
    droop = np.degrees(np.arctan2(-tip[2], tip[0] - edge))
    assert droop == pytest.approx(41.5, abs=2.0)


def _capstan(scheme: str, mu: float, h: float, speed: float) -> float:
    """Returns the ratio of the tensions of a strip that slides over half a cylinder."""
    radius, spacing, straight = 0.06, 0.006, 0.06
    along = round((2 * straight + np.pi * radius) / spacing) + 1
    flat, faces = sheet(along, 4, spacing)
    e = make_elements(flat, faces)
    m = Material(0.2, 800.0, 1e-6, 0.01, mu, 1e-3)
    r = radius + m.margin
    s = (flat[:, 0] - 0.5 * flat[:, 0].max()) * 1.03
    angle = np.clip(s / r, -0.5 * np.pi, 0.5 * np.pi)
    below = np.abs(s) - 0.5 * np.pi * r
    x = np.column_stack([r * np.sin(angle), flat[:, 1], r * np.cos(angle)])
    x[below > 0.0, 2] = -below[below > 0.0]
    left = np.flatnonzero(flat[:, 0] < 0.5 * spacing)
    right = np.flatnonzero(flat[:, 0] > flat[:, 0].max() - 0.5 * spacing)
    held = np.concatenate([left, right]).astype(np.int32)
    drum = Obstacles.resting(
        np.array([[0.0, -1.0, 0.0]]), np.array([[0.0, 2.0, 0.0]]), np.array([radius])
    )
    run = Run(scheme, e, m, h, held, x, gravity=WEIGHTLESS)
    velocity = np.zeros((len(held), 3))
    velocity[: len(left), 2], velocity[len(left) :, 2] = speed, -speed
    slack, tight = [], []
    for _ in range(int(2.0 / h)):
        run.advance(velocity, drum)
        slack.append(-run.reaction[left].sum(axis=0)[2])
        tight.append(-run.reaction[right].sum(axis=0)[2])
    late = slice(-int(0.5 / h), None)
    return float(np.mean(tight[late]) / np.mean(slack[late]))


@pytest.mark.parametrize("scheme", ["one_step", "implicit", "second_order", "projective"])
@pytest.mark.parametrize("mu", [0.2, 0.5])
def test_tension_around_a_drum_grows_as_the_capstan_says(scheme: str, mu: float) -> None:
    """T₂ / T₁ = exp(μ φ), φ = π."""
    assert _capstan(scheme, mu, 0.004, 0.002) == pytest.approx(np.exp(mu * np.pi), rel=0.05)


@pytest.mark.parametrize("scheme", ["one_step", "implicit", "second_order", "projective"])
def test_tight_tube_is_pulled_over_a_limb_at_its_belt_friction(scheme: str) -> None:
    """A tube stretched by ε around a limb presses with k ε / r: F = 2π μ k ε L."""
    around, rows, length, limb, mu = 24, 16, 0.15, 0.05, 0.3
    strain = 0.06
    m = Material(0.2, 400.0, 1e-6, 0.02, mu, 1e-3)
    r = limb + m.margin
    rest = r / (1.0 + strain)
    angle = np.tile(np.arange(around) * 2 * np.pi / around, rows)
    z = np.repeat(np.linspace(0.0, length, rows), around)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    faces = []
    for i in range(rows - 1):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            faces += [[a, b, a + around], [b, b + around, a + around]]
    # A polygon's sides lie within the circle: its girth is what is stretched.
    e = make_elements(np.column_stack([rest * ring, z]), np.array(faces, dtype=np.int32))
    held = np.arange(around * (rows - 1), around * rows, dtype=np.int32)
    arm = Obstacles.resting(
        np.array([[0.0, 0.0, -1.0]]), np.array([[0.0, 0.0, 2.0]]), np.array([limb])
    )
    h = 0.005
    run = Run(scheme, e, m, h, held, np.column_stack([r * ring, z]), gravity=WEIGHTLESS)
    pull = []
    for _ in range(200):
        run.advance(np.tile([0.0, 0.0, 0.01], (around, 1)), arm)
        pull.append(run.reaction[held].sum(axis=0)[2])
    touching = length * (rows - 1.5) / (rows - 1)
    # The plant keeps faces clear of the limb, too, so that the nodes lie a little outside.
    girth = np.linalg.norm(run.x[: held[0], :2], axis=1).mean() / rest - 1.0
    expected = 2.0 * np.pi * mu * m.stretch_stiffness * girth * touching
    assert np.mean(pull[-60:]) == pytest.approx(expected, rel=0.05)


def _incline(angle: float) -> Obstacles:
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    return replace(Obstacles.none(), half_spaces=HalfSpaces.resting(np.zeros(3), normal))


@pytest.mark.parametrize("h", [0.002, 0.01, 0.05])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_incline_holds_below_the_friction_angle_and_slides_above(scheme: str, h: float) -> None:
    flat, e = sheet_elements(8, 8, 0.03)
    m = Material(friction=0.4)
    for degrees in (18.0, 30.0):
        a = np.radians(degrees)
        downhill = np.array([np.cos(a), 0.0, -np.sin(a)])
        normal = np.array([np.sin(a), 0.0, np.cos(a)])
        x = flat[:, :1] * downhill + flat[:, 1:2] * [0.0, 1.0, 0.0] + m.margin * normal
        run = Run(scheme, e, m, h, NO_NODES, x)
        steps = max(5, int(0.4 / h))
        for _ in range(steps):
            run.advance(NOTHING, _incline(a))
        speed = float((run.v @ downhill).mean())
        expected = max(0.0, 9.81 * (np.sin(a) - 0.4 * np.cos(a))) * steps * h
        assert speed == pytest.approx(expected, rel=0.02, abs=1e-6)


@pytest.mark.parametrize("h", [0.001, 0.01, 0.1, 1.0])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_landing_neither_bounces_nor_sinks_nor_adheres(scheme: str, h: float) -> None:
    x, e = sheet_elements(8, 8, 0.03)
    m = Material()
    x = x + np.array([0.0, 0.0, m.margin + 0.004])
    v = np.tile([0.0, 0.0, -1.0], (len(x), 1))
    run = Run(scheme, e, m, h, NO_NODES, x, v)
    floor = Obstacles.floor()
    for _ in range(12):
        run.advance(NOTHING, floor)
        assert run.v[:, 2].max() < 1e-3
        assert run.x[:, 2].min() > m.margin - 1e-6
        assert run.reaction[:, 2].min() > -1e-9


@pytest.mark.parametrize(
    ("scheme", "h"),
    [
        *(("one_step", h) for h in (0.002, 0.01, 0.05, 0.2)),
        # The stiffness at the start of the step bounds no energy when nodes move many edges.
        *(("conjugate_gradients", h) for h in (0.002, 0.01, 0.05)),
        *(
            (scheme, h)
            for scheme in ("implicit", "second_order", "projective")
            for h in (0.002, 0.01)
        ),
    ],
)
def test_no_energy_comes_from_nowhere(scheme: str, h: float) -> None:
    """A crumpled sheet is let go above a limb and a floor: energy never exceeds its start."""
    x, e = sheet_elements(14, 14, 0.03)
    rng = np.random.default_rng(4)
    x = x + 0.004 * rng.normal(size=x.shape) + np.array([0.0, 0.0, 0.3])
    m = Material(stretch_stiffness=100.0)
    bodies = replace(
        Obstacles.floor(),
        a=np.array([[0.1, 0.1, 0.15]]),
        b=np.array([[0.3, 0.3, 0.15]]),
        radius=np.array([0.05]),
        velocity=np.zeros((1, 3)),
        angular_velocity=np.zeros((1, 3)),
    )
    run = Run(scheme, e, m, h, NO_NODES, x)
    mass = run.mass

    def energy() -> float:
        kinetic = 0.5 * np.sum(mass[:, None] * run.v**2)
        potential = 9.81 * np.sum(mass * run.x[:, 2])
        inner = elastic_energy(e, m.stretch_stiffness, m.bending_stiffness, run.x)
        return float(kinetic + potential + inner)

    start = energy()
    for _ in range(int(min(2.0, 150 * h) / h)):
        run.advance(NOTHING, bodies)
        assert energy() < start * (1.0 + 1e-9)


@pytest.mark.parametrize("h", [0.001, 0.01, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_swung_and_dragged_sheet_stays_bounded(scheme: str, h: float) -> None:
    """Grippers swing a sheet over two limbs that move: bounded at every step size."""
    x, e = sheet_elements(14, 16, 0.03)
    held = np.array([0, 1, 15, 14], dtype=np.int32)
    run = Run(scheme, e, Material(), h, held, x)
    steps = int(np.clip(4.0 / h, 40, 800))
    start = run.x[held].copy()
    for k in range(steps):
        t = k * h
        limbs = Obstacles(
            np.array([[0.1, 0.0, -0.10], [0.2, 0.3, -0.2]]),
            np.array([[0.1, 0.5, -0.10], [0.5, 0.3, -0.2]]) + 0.02 * np.sin(t),
            np.array([0.05, 0.04]),
            np.array([[0.05 * np.cos(t), 0.0, 0.0], [0.0, 0.0, 0.05 * np.sin(t)]]),
            np.array([[0.0, 0.0, 0.2 * np.cos(t)], [0.2, 0.0, 0.0]]),
        )
        goal = start + 0.2 * np.array([np.sin(2 * (t + h)), 0.0, np.cos(2 * (t + h)) - 1.0])
        run.advance((goal - run.x[held]) / h, limbs)
        assert np.abs(run.x).max() < 2.5
        assert np.abs(run.v).max() < 30.0


@pytest.mark.parametrize("h", [0.004, 0.02])
@pytest.mark.parametrize("scheme", ["implicit", "second_order"])
def test_tapered_limbs_push_as_hard_as_they_are_pushed(scheme: str, h: float) -> None:
    """Momentum balances in every step, and so do force and moment on the person's bodies."""
    x, e = sheet_elements(12, 14, 0.03)
    middle = x.mean(axis=0)
    a = middle + np.array([[-0.15, 0.0, -0.07], [0.1, -0.2, -0.06]])
    b = middle + np.array([[0.15, 0.05, -0.06], [0.1, 0.2, -0.07]])
    turning = np.array([[0.0, 0.0, 0.3], [0.2, 0.0, 0.0]])
    limbs = Obstacles(a, b, np.array([[0.06, 0.03], [0.035, 0.055]]), np.zeros_like(a), turning)
    run = Run(scheme, e, Material(friction=0.5), h, NO_NODES, x)
    mass = Material().surface_density * e.node_area[:, None]
    touched, origin = set(), limbs.a + 0.1
    for _ in range(int(0.4 / h)):
        before = (mass * run.v).sum(axis=0)
        run.advance(NOTHING, limbs)
        push = run.reaction.sum(axis=0)
        change = (mass * run.v).sum(axis=0) - before
        weight = mass.sum() * np.array([0.0, 0.0, -9.81])
        np.testing.assert_allclose(change, h * (weight + push), atol=2e-4 * mass.sum())
        near = find_proximity(run.x, limbs, 0.0)
        pushed = np.any(run.reaction != 0.0, axis=1)
        touched |= set(near.owner[pushed].tolist())
        owner = np.where(pushed, near.owner, -1).astype(np.int32)
        wrench = body_wrenches(np.arange(2, dtype=np.int32), origin, run.x, owner, run.reaction)
        np.testing.assert_allclose(wrench[:, 3:].sum(axis=0), -push, atol=1e-9)
        about_0 = wrench[:, :3] + np.cross(origin, wrench[:, 3:])
        moment = np.cross(run.x, -run.reaction).sum(axis=0)
        np.testing.assert_allclose(about_0.sum(axis=0), moment, atol=1e-9)
    assert touched == {0, 1}
    assert find_proximity(run.x, limbs, 0.0).gap.min() > -1e-3


@pytest.mark.parametrize("stretch", [100.0, 5000.0])
@pytest.mark.parametrize("h", [0.01, 0.1, 1.0])
def test_few_iterations_from_the_motion_do_not_run_away(h: float, stretch: float) -> None:
    """A sheet whose nodes are thrown about at random, 3 m/s, which no step can foresee."""
    x, e = sheet_elements(14, 14, 0.03)
    held = np.array([0, 13], dtype=np.int32)
    m = Material(surface_density=0.2, stretch_stiffness=stretch, bending_stiffness=1e-4)
    cloth = ExplicitBiasCloth(e, m, h, held, settings=ExplicitSettings(iterations=5))
    v = np.random.default_rng(0).normal(scale=3.0, size=x.shape)
    v[held] = 0.0
    fastest = np.abs(v).max()
    for _ in range(200):
        x, v, _, _ = cloth.step(x, v, np.zeros((2, 3)), Obstacles.none())
        assert np.abs(v).max() < fastest
    assert np.abs(v).max() < 0.2 * fastest


@pytest.mark.parametrize(("h", "share"), [(0.01, 0.95), (0.1, 0.95), (1.0, 0.85)])
def test_cuff_follows_its_limb(h: float, share: float) -> None:
    """A tight cuff on a limb that moves and turns goes with it."""
    around, rows = 16, 5
    m = Material(friction=0.8, margin=1e-3)
    angle = np.tile(np.arange(around) * 2 * np.pi / around, rows)
    z = np.repeat(0.02 * np.arange(rows), around)
    faces = []
    for i in range(rows - 1):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            faces += [[a, b, a + around], [b, b + around, a + around]]
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    e = make_elements(np.column_stack([0.048 * ring, z]), np.array(faces, dtype=np.int32))
    run = Run("one_step", e, m, h, NO_NODES, np.column_stack([0.051 * ring, z]), gravity=WEIGHTLESS)
    velocity = np.array([0.1, 0.0, 0.02])
    before = run.x.mean(axis=0)
    steps = max(2, int(1.0 / h))
    for k in range(steps):
        shift = velocity * k * h
        limb = Obstacles(
            np.array([[0.0, 0.0, -0.5]]) + shift,
            np.array([[0.0, 0.0, 0.5]]) + shift,
            np.array([0.05]),
            velocity[None],
            np.zeros((1, 3)),
        )
        run.advance(NOTHING, limb)
    moved = run.x.mean(axis=0) - before
    assert moved @ velocity / (velocity @ velocity * steps * h) > share


@pytest.mark.parametrize("h", [0.001, 0.01, 0.1, 0.3])
def test_nothing_is_leapt_over_in_a_large_step(h: float) -> None:
    """A sheet thrown at a limb at 2 m/s lands on it instead of beyond it."""
    x, e = sheet_elements(10, 10, 0.02)
    m = Material()
    x = x + np.array([0.0, 0.0, 0.10])
    limb = Obstacles.resting(
        np.array([[0.09, -1.0, 0.0]]), np.array([[0.09, 1.0, 0.0]]), np.array([0.05])
    )
    v = np.tile([0.0, 0.0, -2.0], (len(x), 1))
    run = Run("one_step", e, m, h, NO_NODES, x, v, WEIGHTLESS)
    for _ in range(max(3, int(0.15 / h))):
        run.advance(NOTHING, limb)
        gap = find_proximity(run.x, limb, 0.0).gap
        assert gap.min() > -m.margin
    beyond = (np.abs(run.x[:, 0] - 0.09) < 0.05) & (run.x[:, 2] < 0.0)
    assert not beyond.any()
