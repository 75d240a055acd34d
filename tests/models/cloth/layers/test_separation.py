"""Laws of layers that do not pass through each other."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.layers import LayerSeparation, SeparationRecord, piercing_edges
from drake_dress.models.cloth.layers import separation as separation_module
from drake_dress.models.cloth.layers.separation import Impulses
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.garment import COATS, GarmentMesh, make_coat
from tests.models.cloth.layers.scenes import crumpled, two_sheets
from tests.models.cloth.sheets import sheet

MASS_PER_NODE = 2e-4  # kg


def _turn(axis: tuple[float, float, float], angle: float) -> FloatArray:
    k: FloatArray = np.cross(np.eye(3), np.array(axis) / np.linalg.norm(axis))
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def _coat(spacing: float = 0.03) -> tuple[GarmentMesh, Elements]:
    mesh = make_coat(COATS["jacket"], spacing)
    return mesh, make_elements(mesh.rest_position, mesh.faces)


def _sleeve_faces(mesh: GarmentMesh) -> IntArray:
    """Returns the faces of the left sleeve: what the armhole cuts off with the cuff."""
    loop = set(mesh.loops["left_armhole"].tolist())
    seen = set(mesh.loops["left_cuff"].tolist())
    size = 0
    while len(seen) != size:
        size = len(seen)
        inside = np.array(sorted(seen - loop))
        seen |= set(mesh.faces[np.isin(mesh.faces, inside).any(axis=1)].ravel().tolist())
    inside = np.array(sorted(seen - loop))
    return np.flatnonzero(np.isin(mesh.faces, inside).any(axis=1)).astype(np.int32)


class _Run:
    """A garment stepped by a scheme, corrected, with the laws checked at every step."""

    def __init__(self, scheme: str, h: float, x: FloatArray, e: Elements, held: IntArray) -> None:
        material = Material()
        self._implicit = scheme == "implicit"
        self._cloth = (
            ImplicitCloth(e, material, h, held)
            if self._implicit
            else ExplicitBiasCloth(e, material, h, held)
        )
        self._state = ClothState.at_rest(x)
        self._h, self._held, self._e = h, held, e
        self.mass = self._cloth.mass
        self._w = 1.0 / self.mass
        self._w[held] = 0.0
        self._separation = LayerSeparation(e)
        self.contacts = 0

    @property
    def x(self) -> FloatArray:
        return self._state.x

    @property
    def v(self) -> FloatArray:
        return self._state.v

    def step(self) -> None:
        x, h, still = self.x, self._h, np.zeros((len(self._held), 3))
        if isinstance(self._cloth, ImplicitCloth):
            proposed, _ = self._cloth.step(self._state, Obstacles.none(), still)
            after, velocity = proposed.x, proposed.v
        else:
            after, velocity, *_ = self._cloth.step(x, self.v, still, Obstacles.none())
            proposed = self._state
        dx, record = self._separation.correct(x, after - x, self._w)
        rate = after - x + record.rate_change
        touched = np.any(record.rate_change != 0.0, axis=1)
        velocity = np.where(touched[:, None], rate / h, velocity)
        self._state = replace(proposed, x=x + dx, v=velocity)
        self.contacts += record.impulse_count

        assert record.crossing == 0
        assert len(piercing_edges(self.x, self._e, rings=1)) == 0
        energy = [np.sum(self.mass[:, None] * k**2) for k in (after - x, rate, dx)]
        assert energy[1] <= energy[0] * (1.0 + 1e-12)
        assert energy[2] <= energy[0] * (1.0 + 1e-12)


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
@pytest.mark.parametrize(("h", "duration"), [(2e-3, 0.3), (1e-2, 1.2)])
def test_sheet_falls_onto_a_sheet_and_stays_there(scheme: str, h: float, duration: float) -> None:
    x, e, rim, upper = two_sheets(9, 0.03, 0.02)
    run = _Run(scheme, h, x, e, rim)
    lowest = 0.0
    for _ in range(round(duration / h)):
        run.step()
        lowest = min(lowest, float(run.x[:, 2].min()))
        assert len(piercing_edges(run.x, e)) == 0
    assert run.contacts > 100
    assert -0.08 < lowest < 0.0
    assert np.abs(run.v).max() < 2.0
    # carried: without the lower sheet it would be 0.4 m down
    assert run.x[upper, 2].mean() > -0.05


@pytest.mark.parametrize("scheme", ["implicit", "explicit"])
def test_layers_stay_untangled_at_a_tenth_of_a_second(scheme: str) -> None:
    x, e, rim, _ = two_sheets(6, 0.04, 0.02)
    run = _Run(scheme, 0.1, x, e, rim)
    for _ in range(6):
        run.step()
    assert run.contacts > 100
    assert np.abs(run.v).max() < 10.0


def test_sheets_would_cross_without_correction() -> None:
    x, e, rim, _ = two_sheets(9, 0.03, 0.02)
    cloth = ImplicitCloth(e, Material(), 1e-2, rim)
    state = ClothState.at_rest(x)
    pierced = 0
    for _ in range(20):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((len(rim), 3)))
        pierced = max(pierced, len(piercing_edges(state.x, e, rings=1)))
    assert pierced > 20


def test_folded_sheet_closes_without_passing_through_itself() -> None:
    flat, faces = sheet(16, 6, 0.02)
    e = make_elements(flat, faces)
    # the far half lies 1 cm above the near one, around a half-circle of the same height
    length, radius = flat[:, 0], 0.005
    bend = 0.15
    along = np.clip((length - bend) / radius, 0.0, np.pi)
    x = flat.copy()
    x[:, 0] = np.minimum(length, bend) + radius * np.sin(along)
    x[:, 0] -= np.maximum(length - bend - np.pi * radius, 0.0)
    x[:, 2] = radius * (1.0 - np.cos(along))
    held = np.flatnonzero(length <= bend).astype(np.int32)
    run = _Run("implicit", 1e-2, x, e, held)
    for _ in range(60):
        run.step()
    assert run.contacts > 20
    assert np.abs(run.v).max() < 2.0


def test_sleeve_is_stopped_by_the_body_of_a_coat() -> None:
    mesh, e = _coat()
    x = mesh.rest_position.copy()
    armhole, cuff = (x[mesh.loops[f"left_{k}"]].mean(axis=0) for k in ("armhole", "cuff"))
    axis = (cuff - armhole) / np.linalg.norm(cuff - armhole)
    # the sleeve, from 8 cm below the armhole, is turned into the side of the body
    sleeve = np.isin(np.arange(len(x)), mesh.faces[_sleeve_faces(mesh)])
    weight = np.where(sleeve, np.clip(((x - armhole) @ axis - 0.08) / 0.1, 0.0, 1.0), 0.0)
    w = np.where(weight > 0.0, 1.0 / MASS_PER_NODE, 0.0)
    separation = LayerSeparation(e)
    alone = x.copy()
    impulses, pierced = 0, 0
    for _ in range(14):
        turn = np.deg2rad(4.0) * weight[:, None]
        x_axis = np.array([-1.0, 0.0, 0.0])
        dx, record = separation.correct(x, turn * np.cross(x_axis, x - armhole), w)
        x = x + dx
        impulses += record.impulse_count
        assert record.crossing == 0
        assert len(piercing_edges(x, e, rings=1)) == 0
        alone += turn * np.cross(x_axis, alone - armhole)
        pierced = max(pierced, len(piercing_edges(alone, e, rings=1)))
    assert impulses > 50
    assert pierced > 20
    inward = x[mesh.loops["left_cuff"], 1].mean() - alone[mesh.loops["left_cuff"], 1].mean()
    assert inward > 0.05


@pytest.mark.parametrize("spacing", [0.02, 0.03])
@pytest.mark.parametrize("name", sorted(COATS))
def test_coat_at_rest_has_no_layers_closer_than_the_thickness(name: str, spacing: float) -> None:
    mesh = make_coat(COATS[name], spacing)
    e = make_elements(mesh.rest_position, mesh.faces)
    x = mesh.rest_position
    # squeezed by a tenth: collar, seams and armpits come closer and must not jam
    dx = -0.1 * (x - x.mean(axis=0))
    after, record = LayerSeparation(e).correct(x, dx, np.full(len(x), 1.0 / MASS_PER_NODE))
    assert record.impulse_count == 0
    np.testing.assert_array_equal(after, dx)


def test_rigid_motion_changes_nothing() -> None:
    for x, e in (crumpled(1), (_coat()[0].rest_position, _coat()[1])):
        separation = LayerSeparation(e)
        w = np.full(len(x), 1.0 / MASS_PER_NODE)
        dx = x @ _turn((1.0, 2.0, -1.0), 0.4).T - x + [0.3, -20.0, 0.1]
        after, record = separation.correct(x, dx, w)
        np.testing.assert_array_equal(after, dx)
        assert record.impulse_count == 0
        assert record.zones == 0


def test_motion_seen_from_another_frame_is_corrected_alike() -> None:
    x, e = crumpled(2)
    dx = np.random.default_rng(0).normal(scale=2e-3, size=x.shape)
    w = np.full(len(x), 1.0 / MASS_PER_NODE)
    turn = _turn((0.3, -1.0, 0.5), 1.1)
    here, record = LayerSeparation(e).correct(x, dx, w)
    there, _ = LayerSeparation(e).correct(x @ turn.T + 1.0, dx @ turn.T, w)
    assert record.impulse_count > 10
    # the order of pairs, and with it the result, follows the grid: only roughly alike
    assert np.abs(there - here @ turn.T).max() < 2e-3


def test_garment_without_contact_comes_back_bit_for_bit() -> None:
    x, faces = sheet(12, 12, 0.02)
    e = make_elements(x, faces)
    dx = 0.01 * np.sin(9.0 * x[:, [1, 2, 0]]) - 0.0
    after, record = LayerSeparation(e).correct(x, dx, np.ones(len(x)))
    np.testing.assert_array_equal(after.view(np.int64), dx.view(np.int64))
    assert record.pairs == 0
    assert not record.rate_change.any()


def test_impulses_between_free_nodes_keep_momentum() -> None:
    x, e = crumpled(0)
    rng = np.random.default_rng(1)
    mass = rng.uniform(1e-4, 3e-4, size=len(x))
    for size in (3e-3, 5e-2):
        dx = rng.normal(scale=size, size=x.shape)
        after, record = LayerSeparation(e).correct(x, dx, 1.0 / mass)
        assert record.impulse_count > 10
        for change in (after - dx, record.rate_change):
            moved = np.abs(mass[:, None] * change).sum()
            np.testing.assert_allclose(
                (mass[:, None] * change).sum(axis=0), 0.0, atol=1e-12 * moved
            )
        assert record.crossing == 0
        assert len(piercing_edges(x + after, e, rings=1)) == 0


def _layers_above(point: FloatArray, x: FloatArray, triangles: IntArray) -> int:
    """How many of the triangles the vertical line from `point` upward meets."""
    corner = x[triangles] - point
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    weights = np.column_stack(
        [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((b, c), (c, a), (a, b))]
    )
    inside = np.all(weights > 0.0, axis=1) | np.all(weights < 0.0, axis=1)
    height = np.einsum("ij,ij->i", weights[inside], corner[inside, :, 2])
    return int(np.count_nonzero(height / weights[inside].sum(axis=1) > 0.0))


@pytest.mark.parametrize("held", [True, False])
def test_fast_node_does_not_tunnel(held: bool) -> None:
    lower, faces = sheet(9, 9, 0.03)
    tip = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.02], [0.0, 0.01, 0.02]])
    e = make_elements(
        np.vstack([lower, tip]), np.vstack([faces, len(lower) + np.array([[0, 1, 2]])])
    )
    bullet = np.arange(len(lower), len(lower) + 3)
    x = np.vstack([lower, tip + [0.118, 0.113, 0.1]])
    dx = np.zeros_like(x)
    dx[bullet] = [0.01, -0.02, -0.3]  # 3 m/s for 0.1 s
    w = np.full(len(x), 1.0 / MASS_PER_NODE)
    if held:
        w[: len(lower)] = 0.0
    after, record = LayerSeparation(e).correct(x, dx, w)
    end = x + after
    assert record.crossing == 0
    assert len(piercing_edges(end, e)) == 0
    for node in bullet:
        assert _layers_above(end[node], end, e.triangle[: len(faces)]) % 2 == 0
        assert _layers_above((x + dx)[node], x, e.triangle[: len(faces)]) == 1
    if held:
        assert end[bullet, 2].min() > 0.5e-3
        np.testing.assert_array_equal(after[: len(lower)], dx[: len(lower)])


def test_layers_keep_their_thickness() -> None:
    x, e, _, upper = two_sheets(7, 0.03, 0.004)
    dx = np.zeros_like(x)
    dx[upper, 2] = -0.01
    w = np.where(np.arange(len(x)) < upper[0], 0.0, 1.0 / MASS_PER_NODE)
    after, _ = LayerSeparation(e, thickness=2e-3).correct(x, dx, w)
    inside = np.all(np.abs(x[upper, :2] - 0.09) < 0.085, axis=1)
    height = (x + after)[upper[inside], 2]
    assert height.min() > 1.9e-3
    assert np.median(height) < 2.5e-3
    assert np.sum(after**2) < 0.05 * np.sum(dx**2)


def test_layers_that_start_closer_than_the_thickness_are_not_pushed() -> None:
    x, e, _, upper = two_sheets(7, 0.03, 0.0005)
    dx = np.zeros_like(x)
    dx[upper, 2] = -0.01
    w = np.where(np.arange(len(x)) < upper[0], 0.0, 1.0 / MASS_PER_NODE)
    after, _ = LayerSeparation(e, thickness=2e-3).correct(x, dx, w)
    inside = np.all(np.abs(x[upper, :2] - 0.09) < 0.085, axis=1)
    height = (x + after)[upper[inside], 2]
    assert height.min() > 4.7e-4
    assert np.median(height) < 6e-4
    assert np.sum(after**2) < 0.05 * np.sum(dx**2)


def test_node_is_not_moved_along_its_barred_direction() -> None:
    x, e = crumpled(0)
    rng = np.random.default_rng(5)
    barred = rng.normal(size=x.shape)
    barred /= np.linalg.norm(barred, axis=1, keepdims=True)
    barred[::3] = 0.0
    dx = rng.normal(scale=2e-3, size=x.shape)
    after, record = LayerSeparation(e).correct(x, dx, np.full(len(x), 5e3), barred)
    assert record.impulse_count > 10
    np.testing.assert_allclose(np.einsum("ij,ij->i", after - dx, barred), 0.0, atol=1e-15)


def test_nodes_that_can_hardly_be_moved_are_not_thrown() -> None:
    x, e, _, upper = two_sheets(7, 0.03, 0.004)
    rng = np.random.default_rng(4)
    dx = np.zeros_like(x)
    dx[upper, 2] = -0.01
    # most nodes are prescribed, the others barred from nearly the direction of the approach
    w = np.where(rng.uniform(size=len(x)) < 0.8, 0.0, 1.0 / MASS_PER_NODE)
    barred = np.zeros_like(x)
    barred[::2] = [1e-5, 0.0, 1.0]
    after, record = LayerSeparation(e).correct(x, dx, w, barred)
    assert record.impulse_count > 0
    assert record.crossing > 0
    assert np.abs(after - dx).max() < 0.05


def test_prescribed_motions_that_cross_are_reported() -> None:
    x, e, _, upper = two_sheets(5, 0.03, 0.004)
    dx = np.zeros_like(x)
    dx[upper, 2] = -0.01
    after, record = LayerSeparation(e).correct(x, dx, np.zeros(len(x)))
    np.testing.assert_array_equal(after, dx)
    assert record.crossing > 10


def test_zones_alone_prevent_crossing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(separation_module, "_PASSES", 0)
    x, e = crumpled(3)
    rng = np.random.default_rng(2)
    mass = rng.uniform(1e-4, 3e-4, size=len(x))
    dx = rng.normal(scale=4e-3, size=x.shape)
    assert len(piercing_edges(x + dx, e, rings=1)) > 0
    after, record = LayerSeparation(e).correct(x, dx, 1.0 / mass)
    assert record.impulse_count == 0
    assert record.zones > 0
    assert record.crossing == 0
    assert len(piercing_edges(x + after, e, rings=1)) == 0
    assert np.sum(mass[:, None] * after**2) <= np.sum(mass[:, None] * dx**2)
    np.testing.assert_allclose((mass[:, None] * (after - dx)).sum(axis=0), 0.0, atol=1e-14)


def test_fresh_object_returns_the_same() -> None:
    x, e = crumpled(0)
    rng = np.random.default_rng(1)
    used = LayerSeparation(e)
    for size in (1e-3, 3e-2):
        dx = rng.normal(scale=size, size=x.shape)
        first, _ = used.correct(x, dx, np.full(len(x), 5e3))
        second, _ = LayerSeparation(e).correct(x, dx, np.full(len(x), 5e3))
        np.testing.assert_array_equal(first, second)


def _replay(record: SeparationRecord, dx: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The linear part of the correction with its pairs held, one impulse at a time."""
    rate = dx @ record.frame
    total = np.zeros_like(dx)
    for part in record.parts:
        for stage in part:
            if not isinstance(stage, Impulses):
                stage.apply(rate)
                continue
            sums = np.zeros(stage.slots)
            for k, (node, c, n) in enumerate(
                zip(stage.node, stage.weights, stage.direction, strict=True)
            ):
                impulse = -stage.scale[k] * (c @ (rate[node] @ n))
                slot = stage.slot[k]
                if stage.release[k]:
                    impulse = -sums[slot]
                if slot >= 0:
                    sums[slot] += impulse
                for i, weight in zip(node, c, strict=True):
                    m = record.barred[i]
                    rate[i] += record.inverse_mass[i] * weight * impulse * (n - m * (m @ n))
        total += rate / len(record.parts)
    return total @ record.frame.T, rate @ record.frame.T


@pytest.mark.parametrize(("size", "passes"), [(2e-3, 60), (2e-2, 60), (4e-3, 0)])
def test_transpose_belongs_to_the_correction_with_pairs_held(
    size: float, passes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(separation_module, "_PASSES", passes)
    x, e = crumpled(3)
    rng = np.random.default_rng(2)
    w = rng.uniform(3e3, 6e3, size=len(x))
    w[::17] = 0.0
    barred = np.zeros_like(x)
    barred[5] = [0.0, 0.6, 0.8]
    separation = LayerSeparation(e)
    _, record = separation.correct(x, rng.normal(scale=size, size=x.shape), w, barred)
    assert any(record.parts)
    stages = [s for part in record.parts for s in part if isinstance(s, Impulses)]
    assert passes == 0 or any(s.release.any() for s in stages)
    bar, direction = rng.normal(size=(2, *x.shape))
    total, rate = _replay(record, direction)
    back = separation.correct_vjp(record, bar)
    assert np.sum(back * direction) == pytest.approx(np.sum(bar * total), rel=1e-8)
    back = separation.rate_vjp(record, bar)
    assert np.sum(back * direction) == pytest.approx(np.sum(bar * rate), rel=1e-8)


def test_transpose_is_the_derivative_of_a_head_on_collision() -> None:
    lower, faces = sheet(3, 3, 0.03)
    tip = np.array([[0.02, 0.011, 0.001], [0.03, 0.011, 0.05], [0.02, 0.021, 0.05]])
    x = np.vstack([lower, tip])
    e = make_elements(x, np.vstack([faces, [[9, 10, 11]]]))
    rng = np.random.default_rng(0)
    dx = rng.normal(scale=1e-5, size=x.shape)
    dx[9:, 2] = -0.003  # straight onto the inside of a triangle, through it half-way
    w = rng.uniform(3e3, 6e3, size=len(x))
    separation = LayerSeparation(e)
    _, record = separation.correct(x, dx, w)
    assert record.impulse_count > 0
    np.testing.assert_array_equal(record.frame, np.eye(3))
    bar, direction = rng.normal(size=(2, *x.shape))
    back = separation.correct_vjp(record, bar)
    step = 1e-9
    ahead, _ = separation.correct(x, dx + step * direction, w)
    behind, _ = separation.correct(x, dx - step * direction, w)
    difference = np.sum(bar * (ahead - behind)) / (2.0 * step)
    assert np.sum(back * direction) == pytest.approx(difference, rel=1e-5)


def test_piercing_edges_are_counted() -> None:
    x, e, _, upper = two_sheets(5, 0.03, 0.004)
    assert len(piercing_edges(x, e)) == 0
    x[upper[12], 2] = -0.01
    found = piercing_edges(x, e)
    # the edges at the pulled node pierce the sheet below, its edges those steep triangles
    at_node = np.any(e.edge[found[:, 0]] == upper[12], axis=1)
    beside_node = np.any(e.triangle[found[:, 1]] == upper[12], axis=1)
    assert np.count_nonzero(at_node) >= 4
    assert np.all(at_node ^ beside_node)


@pytest.mark.parametrize("thickness", [0.0, -1e-3, np.nan])
def test_thickness_has_to_be_positive(thickness: float) -> None:
    _, e = crumpled(0)
    with pytest.raises(ValueError, match="thickness"):
        LayerSeparation(e, thickness=thickness)


def test_wrong_shapes_are_named() -> None:
    x, e = crumpled(0)
    with pytest.raises(ValueError, match="inverse_mass has shape"):
        LayerSeparation(e).correct(x, x, np.ones(3))
    with pytest.raises(ValueError, match="rings"):
        LayerSeparation(e, rings=0)
