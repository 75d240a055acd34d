"""The plant's linear solver: its matrix, its preconditioner, and what binds."""

import numpy as np
import pytest
import scipy.sparse as sp

from drake_dress.models.cloth.contact.modes import FREE, HELD, SLIP, STICK
from drake_dress.models.cloth.explicit.inner.filtered import Filtered
from drake_dress.models.cloth.factor.masked import SymbolicFactor
from drake_dress.models.cloth.filtered_cg import Bound, Preconditioner, Stop
from drake_dress.models.cloth.filtered_stiffness import normal_response
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import (
    bending_bound,
    bending_matrix,
    lumped_mass,
    stretch_matrix,
)
from tests.models.cloth.sheets import sheet_elements

H = 0.01
MATERIAL = Material(stretch_stiffness=300.0, bending_stiffness=1e-4)


class System:
    """A crumpled sheet's A, its P and A as a plain matrix."""

    def __init__(self, seed: int = 0) -> None:
        x, self.elements = sheet_elements(9, 8, 0.03)
        rng = np.random.default_rng(seed)
        self.rng, self.n = rng, len(x)
        x = x * np.array([1.1, 0.8, 1.0]) + 0.01 * rng.normal(size=x.shape)
        mass = sp.diags(lumped_mass(self.elements, MATERIAL))
        bending = bending_matrix(self.elements, MATERIAL)
        self.linear = sp.csc_matrix(mass + H**2 * bending)
        bound = stretch_matrix(self.elements, MATERIAL) + bending_bound(self.elements, MATERIAL)
        p = sp.csc_matrix(mass + H**2 * bound)
        filtered = Filtered(
            self.elements, MATERIAL.stretch_stiffness, H, self.linear, sp.csc_matrix(bending)
        )
        self.block = filtered.block(x)
        self.system = filtered.system(p)
        self.symbolic = SymbolicFactor(p)
        self.matrix = filtered.assemble(self.block).toarray()
        self.across = normal_response(self.elements, self.block, H**2, self.linear.diagonal())


def test_product_is_that_of_the_matrix() -> None:
    s = System()
    z = s.rng.normal(size=(s.n, 3))
    found = s.system.product(z, s.block)
    np.testing.assert_allclose(found.ravel(), s.matrix @ z.ravel(), rtol=1e-9, atol=1e-12)


def test_normal_response_is_that_of_the_diagonal_blocks() -> None:
    s = System()
    normal, give = s.across
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-12)
    for i in range(s.n):
        block = s.matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
        assert give[i] == pytest.approx(1.0 / (normal[i] @ block @ normal[i]), rel=1e-8)


@pytest.mark.parametrize("helped", [False, True])
@pytest.mark.parametrize("resisted", [False, True])
def test_solution_is_that_of_the_free_motions(helped: bool, resisted: bool) -> None:
    s = System(1)
    mode = np.zeros(s.n, dtype=np.int32)
    mode[:6], mode[20:24], mode[30:42] = HELD, STICK, SLIP
    normal = s.rng.normal(size=(s.n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    resistance = np.where(mode == SLIP, 3.0 * s.linear.diagonal(), 0.0) if resisted else None
    rhs, start = s.rng.normal(size=(s.n, 3)), s.rng.normal(size=(s.n, 3))
    # what is free, as columns
    free = [3 * i + c for i in np.flatnonzero(mode == FREE) for c in range(3)]
    columns = [np.eye(3 * s.n)[:, k] for k in free]
    for i in np.flatnonzero(mode == SLIP):
        for t in np.linalg.svd(normal[i][None])[2][1:]:
            column = np.zeros((s.n, 3))
            column[i] = t
            columns.append(column.ravel())
    basis = np.stack(columns, axis=1)
    a = s.matrix if resistance is None else s.matrix + np.diag(np.repeat(resistance, 3))
    bound = start.ravel() - basis @ (basis.T @ start.ravel())
    right = basis.T @ (rhs.ravel() - a @ bound)
    expected = bound + basis @ np.linalg.solve(basis.T @ a @ basis, right)

    z = start.copy()
    # a factor from a few other nodes, as it is kept between steps
    stale = np.isin(mode, (HELD, STICK))
    stale[22], stale[50] = False, True
    _, residual = s.system.solve(
        Preconditioner(s.symbolic.factorize(stale), s.across if helped else None),
        s.block,
        Bound(mode, normal, resistance),
        rhs,
        z,
        Stop(1e-12, 500),
    )
    assert residual < 1e-11
    np.testing.assert_allclose(z.ravel(), expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("drive", [0.0, 1e-18])
def test_what_nothing_but_prescribed_motion_drives_is_solved(drive: float) -> None:
    """A right-hand side of rounding errors alone: no tolerance of it can be met, nor need be."""
    s = System(3)
    mode = np.zeros(s.n, dtype=np.int32)
    mode[:6], mode[6:42] = HELD, SLIP
    normal = s.rng.normal(size=(s.n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    start = np.zeros((s.n, 3))
    start[:6] = [0.0, 0.0, 0.1]
    rhs = drive * s.rng.normal(size=(s.n, 3))
    factor = s.symbolic.factorize(mode == HELD)
    found = []
    for most in (100, 1000):
        z = start.copy()
        iterations, residual = s.system.solve(
            Preconditioner(factor, s.across),
            s.block,
            Bound(mode, normal),
            rhs,
            z,
            Stop(1e-6, most),
        )
        assert iterations < 100
        assert residual <= 1e-6
        found.append(z)
    np.testing.assert_array_equal(found[0], found[1])
    assert 0.05 < np.abs(found[0]).max() < 0.2


def test_motion_across_the_cloth_costs_fewer_iterations() -> None:
    s = System(2)
    mode = np.zeros(s.n, dtype=np.int32)
    mode[:9] = HELD
    factor = s.symbolic.factorize(mode == HELD)
    # a push across the sheet, node by node
    rhs = s.rng.normal(size=(s.n, 1)) * s.across[0]
    count = [
        s.system.solve(
            Preconditioner(factor, across),
            s.block,
            Bound(mode, np.zeros((s.n, 3))),
            rhs,
            np.zeros((s.n, 3)),
            Stop(1e-4, 500),
        )[0]
        for across in (None, s.across)
    ]
    assert count[1] < 0.8 * count[0]
