import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.cloth.batch.partition import Partition, make_partition
from drake_dress.models.cloth.batch.system import system_matrix
from drake_dress.models.cloth.elements import FloatArray
from drake_dress.models.cloth.material import Material
from tests.models.cloth.sheets import sheet_elements


def _apply(partition: Partition, rhs: FloatArray) -> FloatArray:
    """The stages in plain words, with each row's order of reading checked."""
    source = rhs
    for stages in (partition.forward, partition.backward):
        target = np.full_like(rhs, np.nan)
        for stage in stages:
            value = np.zeros((len(stage.row), rhs.shape[1]))
            for r in range(len(stage.row)):
                own = slice(stage.start[r], stage.split[r])
                earlier = slice(stage.split[r], stage.start[r + 1])
                value[r] = stage.weight[own] @ source[stage.column[own]]
                value[r] += stage.weight[earlier] @ target[stage.column[earlier]]
            target[stage.row] = value
        source = target
    return source


@pytest.mark.parametrize("h", [0.005, 1.0])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.7])
def test_partitioned_inverse_solves_the_free_block(share: float, h: float) -> None:
    rng = np.random.default_rng(5)
    _, e = sheet_elements(12, 15, 0.03)
    p = system_matrix(e, Material(), h)
    masked = rng.random(e.node_count) < share
    rhs = rng.normal(size=(e.node_count, 3))
    solution = _apply(make_partition(p, masked, 300.0), rhs)
    expected = spla.spsolve(sp.csc_matrix(p[~masked][:, ~masked]), rhs[~masked])
    np.testing.assert_allclose(solution[~masked], expected, rtol=1e-10, atol=1e-10)
    assert np.all(np.isnan(solution[masked]))


def test_dearer_stages_make_fewer_of_them_and_more_entries() -> None:
    _, e = sheet_elements(20, 22, 0.03)
    p = system_matrix(e, Material(), 0.01)
    free = np.zeros(e.node_count, dtype=np.bool_)
    cheap, dear = (make_partition(p, free, cost) for cost in (100.0, 20_000.0))
    assert len(dear.forward) < len(cheap.forward)
    assert dear.entries > cheap.entries


def test_all_nodes_held_leave_nothing_to_solve() -> None:
    _, e = sheet_elements(4, 4, 0.03)
    masked = np.ones(e.node_count, dtype=np.bool_)
    assert make_partition(system_matrix(e, Material(), 0.01), masked, 100.0).entries == 0


@pytest.mark.parametrize("diagonal", [[1.0, -1.0, 2.0], [1.0, 0.0, 2.0]])
def test_indefinite_matrix_is_refused(diagonal: list[float]) -> None:
    with pytest.raises(ValueError, match="not positive definite"):
        make_partition(sp.csc_matrix(np.diag(diagonal)), np.zeros(3, dtype=np.bool_), 100.0)
