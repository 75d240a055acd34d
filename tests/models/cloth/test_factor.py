import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.cloth.factor.masked import SymbolicFactor, restricted_solve
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import (
    bending_bound,
    bending_matrix,
    lumped_mass,
    stretch_matrix,
)
from tests.models.cloth.sheets import sheet_elements


def _system() -> sp.csc_matrix:
    _, e = sheet_elements(12, 15, 0.03)
    material = Material()
    return sp.csc_matrix(sp.diags(lumped_mass(e, material)) + 1e-3 * stretch_matrix(e, material))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.7])
def test_masked_factor_solves_the_free_block(share: float) -> None:
    rng = np.random.default_rng(5)
    p = _system()
    count = p.shape[0]
    masked = rng.random(count) < share
    rhs = rng.normal(size=(count, 3))
    solution = SymbolicFactor(p).factorize(masked).solve(rhs)
    free = ~masked
    expected = spla.spsolve(sp.csc_matrix(p[free][:, free]), rhs[free])
    np.testing.assert_allclose(solution[free], expected, rtol=1e-9, atol=1e-9)
    assert np.all(solution[masked] == 0.0)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_part_of_a_factor_solves_between_its_nodes(share: float) -> None:
    rng = np.random.default_rng(6)
    p = _system()
    count = p.shape[0]
    masked = rng.random(count) < share
    factor = SymbolicFactor(p).factorize(masked)
    free = np.flatnonzero(~masked).astype(np.int32)
    nodes = rng.choice(free, size=len(free) // 4, replace=False)
    force = rng.normal(size=(len(nodes), 3))
    motion = np.empty_like(force)
    restricted_solve(factor.part(nodes), force, motion)
    rhs = np.zeros((count, 3))
    rhs[nodes] = force
    np.testing.assert_allclose(motion, factor.solve(rhs)[nodes], rtol=1e-9, atol=1e-12)


def test_indefinite_matrix_is_refused() -> None:
    with pytest.raises(ValueError, match="not positive"):
        SymbolicFactor(sp.csc_matrix(np.diag([1.0, -1.0, 2.0]))).factorize(np.zeros(3, dtype=bool))


def test_bending_bound_is_above_bending() -> None:
    _, e = sheet_elements(6, 7, 0.03)
    difference = (bending_bound(e, Material()) - bending_matrix(e, Material())).toarray()
    assert np.linalg.eigvalsh(difference).min() > -1e-12
    np.testing.assert_allclose(difference.sum(axis=0), 0.0, atol=1e-12)
