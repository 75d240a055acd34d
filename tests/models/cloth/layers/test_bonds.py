"""Pairs of layers that resist approach within a step."""

import numpy as np

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit import ClothState, ImplicitCloth
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.layers.bonds import NO_BONDS, Bonds, bond_product
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.cloth.material import Material
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
    return Bonds(node, row, rng.uniform(0.1, 1.0, count), rng.normal(size=count))


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


def test_a_bond_takes_approach_and_no_momentum() -> None:
    x, e = sheet_elements(6, 6, 0.02)
    rng = np.random.default_rng(1)
    cloth = ImplicitCloth(
        e, Material(), 0.01, NO_NODES, np.zeros(3), tolerance=1e-8, max_iterations=300
    )
    v = 0.1 * rng.normal(size=x.shape)
    state = ClothState(
        x,
        v,
        np.zeros(36, dtype=np.int32),
        np.zeros_like(x),
        np.full(36, -1, dtype=np.int32),
    )
    up = np.array([[0.0, 0.0, 1.0]])
    weights = np.array([[1.0, -1.0, 0.0, 0.0]])
    row = weights[:, :, None] * up[:, None, :]
    node = np.array([[3, 32, 10, 20]], dtype=np.int32)
    ends = []
    for resistance in (0.0, 1e3):
        bonds = Bonds(node, row, np.array([resistance]), np.array([0.02]))
        after, _ = cloth.step(state, Obstacles.none(), NOTHING, Influences(bonds=bonds))
        ends.append(after.v)
    free, bound = ends
    assert abs(bound[3, 2] - bound[32, 2] - 0.02) < 1e-4
    assert abs(free[3, 2] - free[32, 2] - 0.02) > 1e-2
    momentum = cloth.mass @ v
    np.testing.assert_allclose(cloth.mass @ bound, momentum, atol=1e-9)


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
