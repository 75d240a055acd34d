"""Pairs of layers that resist approach within a step."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.layers.bonds import NO_BONDS, Bonds, bond_product
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.layers.scenes import two_sheets
from tests.models.cloth.sheets import sheet_elements

NOTHING = np.zeros((0, 3))
NO_NODES = np.zeros(0, dtype=np.int32)


def some_bonds(rng: np.random.Generator, nodes: int, count: int) -> Bonds:
    node = np.stack([rng.choice(nodes, 4, replace=False) for _ in range(count)]).astype(np.int32)
    weights = rng.uniform(size=(count, 4)) * np.array([1.0, 1.0, -1.0, -1.0])
    weights[:, :2] /= weights[:, :2].sum(axis=1, keepdims=True)
    weights[:, 2:] /= -weights[:, 2:].sum(axis=1, keepdims=True)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    row = weights[:, :, None] * direction[:, None, :]
    closing = rng.uniform(size=count) < 0.5
    return Bonds(node, row, rng.uniform(0.1, 1.0, count), rng.normal(size=count), closing)


def test_product_and_drive_are_those_of_the_rows() -> None:
    rng = np.random.default_rng(0)
    bonds = some_bonds(rng, 30, 8)
    rows = np.zeros((8, 90))
    for p in range(8):
        for m in range(4):
            rows[p, 3 * bonds.node[p, m] : 3 * bonds.node[p, m] + 3] += bonds.row[p, m]
    z = rng.normal(size=(30, 3))
    out = np.zeros_like(z)
    bond_product(z, bonds.node, bonds.row, bonds.resistance, out)
    np.testing.assert_allclose(out.ravel(), rows.T @ (bonds.resistance * (rows @ z.ravel())))
    drive = bonds.drive(30)
    np.testing.assert_allclose(drive.ravel(), rows.T @ (bonds.resistance * bonds.rate))
    # as much on one part as on the other
    assert np.abs(drive.sum(axis=0)).max() < 1e-12
    assert not NO_BONDS.drive(30).any()


def flying_sheet(rng: np.random.Generator) -> tuple[ImplicitCloth, ClothState]:
    x, e = sheet_elements(6, 6, 0.02)
    cloth = ImplicitCloth(
        e,
        Material(),
        0.01,
        NO_NODES,
        np.zeros(3),
        settings=ImplicitSettings(tolerance=1e-8, max_iterations=300),
    )
    state = replace(ClothState.at_rest(x), v=0.1 * rng.normal(size=x.shape))
    return cloth, state


def one_bond(rate: float) -> Bonds:
    weights = np.array([[1.0, -1.0, 0.0, 0.0]])
    row = weights[:, :, None] * np.array([[[0.0, 0.0, 1.0]]])
    node = np.array([[3, 32, 10, 20]], dtype=np.int32)
    return Bonds(node, row, np.array([1e3]), np.array([rate]), np.array([True]))


def test_a_bond_takes_approach_and_no_momentum() -> None:
    cloth, state = flying_sheet(np.random.default_rng(1))
    free, _ = cloth.step(state, Obstacles.none(), NOTHING)
    parting = free.v[3, 2] - free.v[32, 2]
    bonds = one_bond(parting + 0.02)
    bound, _ = cloth.step(state, Obstacles.none(), NOTHING, Influences(bonds=bonds))
    assert abs(bound.v[3, 2] - bound.v[32, 2] - parting - 0.02) < 1e-4
    np.testing.assert_allclose(cloth.mass @ bound.v, cloth.mass @ state.v, atol=1e-9)


def test_what_parts_by_itself_is_not_held_back() -> None:
    cloth, state = flying_sheet(np.random.default_rng(1))
    free, _ = cloth.step(state, Obstacles.none(), NOTHING)
    bonds = one_bond(free.v[3, 2] - free.v[32, 2] - 0.02)
    after, _ = cloth.step(state, Obstacles.none(), NOTHING, Influences(bonds=bonds))
    np.testing.assert_allclose(after.v, free.v, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_layers_push_and_do_not_pull(seed: int) -> None:
    """Signorini's conditions of many pairs at once, whichever of them resisted at first."""
    rng = np.random.default_rng(seed)
    cloth, state = flying_sheet(rng)
    bonds = some_bonds(rng, 36, 12)
    bonds = replace(bonds, resistance=1e3 * bonds.resistance)
    for closing in (bonds.closing, np.ones(12, dtype=np.bool_), np.zeros(12, dtype=np.bool_)):
        given = Influences(bonds=replace(bonds, closing=closing))
        after, _ = cloth.step(state, Obstacles.none(), NOTHING, given)
        lacking = bonds.lacking(after.v)
        assert cloth.time_step * lacking.max() < 1e-3
        assert np.count_nonzero(np.abs(lacking) < 1e-3) > 1
        assert np.count_nonzero(lacking < -1e-2) > 1
        np.testing.assert_allclose(cloth.mass @ after.v, cloth.mass @ state.v, atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_wrung_and_pushed_together_comes_to_rest(seed: int) -> None:
    """Hundreds of pairs in one crumple. While pairs could pull, it flew apart, at 2 km/s."""
    rng = np.random.default_rng(seed)
    x, e = sheet_elements(14, 14, 0.02)
    x = x + np.array([0.0, 0.0, 2e-3]) * rng.normal(size=x.shape)
    sides = [np.flatnonzero(x[:, 0] < 1e-6), np.flatnonzero(x[:, 0] > 0.26 - 1e-6)]
    held = np.concatenate(sides).astype(np.int32)
    inner = ImplicitCloth(
        e,
        Material(),
        0.01,
        held,
        settings=ImplicitSettings(tolerance=0.1, implicitness=0.7, buckling_wavelength=3.0),
    )
    cloth, state = LayeredCloth(inner), ClothState.at_rest(x)
    right = slice(len(sides[0]), None)
    wring = np.array([np.pi, 0.0, 0.0])  # rad/s
    speeds = []
    for k in range(200):
        velocity = np.zeros((len(held), 3))
        if k < 100:
            arm = state.x[held[right]] - state.x[held[right]].mean(axis=0)
            velocity[right] = np.cross(wring, arm) - np.array([0.24, 0.0, 0.0])
        state, _ = cloth.step(state, Obstacles.none(), velocity)
        speeds.append(np.linalg.norm(state.v, axis=1).max())
    assert max(speeds) < 2.5
    assert max(speeds[180:]) < 0.4
    assert not state.tangled.any()
    assert len(piercing_edges(state.x, e, rings=1)) == 0


def test_a_resting_sheet_leaves_little_to_correct() -> None:
    """A sheet that lies on another at steps of 8 ms: no edge is stretched by the layers."""
    x, e, rim, _ = two_sheets(9, 0.03, 0.012)
    material = Material(damping=0.01)
    cloth = LayeredCloth(ImplicitCloth(e, material, 0.008, rim))
    state, still = ClothState.at_rest(x), np.zeros((len(rim), 3))
    stretched = []
    for _ in range(100):
        state, _ = cloth.step(state, Obstacles.none(), still)
        ends = state.x[e.edge]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        stretched.append(np.max(length / e.edge_rest_length) - 1.0)
    assert len(piercing_edges(state.x, e)) == 0
    assert max(stretched) < 0.15
    assert np.abs(state.v).max() < 0.05
