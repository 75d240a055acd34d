from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drake_dress.errors import UserError
from drake_dress.models.arrays import IndexArray
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.edges import boundary_loops, unique_edges
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths, loop_length

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@pytest.fixture(scope="module")
def coat() -> GarmentMesh:
    return make_coat(CoatParameters(), 0.06)


def changed(mesh: GarmentMesh, **kwargs: Any) -> GarmentMesh:
    parts = {
        "rest_position": mesh.rest_position.copy(),
        "faces": mesh.faces.copy(),
        "loops": {k: v.copy() for k, v in mesh.loops.items()},
        "grasp": {k: v.copy() for k, v in mesh.grasp.items()},
        "region": mesh.region.copy(),
    }
    return GarmentMesh(**{**parts, **kwargs})


def refusal(mesh: GarmentMesh) -> str:
    with pytest.raises(UserError) as caught:
        mesh.validate("coat.obj")
    assert str(caught.value).startswith("coat.obj: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_closed_surface_has_no_boundary_and_obeys_euler() -> None:
    check_manifold(TETRAHEDRON, 4)
    assert boundary_loops(TETRAHEDRON) == []
    assert 4 - len(unique_edges(TETRAHEDRON)) + 4 == 2


def test_boundary_keeps_the_surface_to_its_left() -> None:
    (loop,) = boundary_loops(np.array([[0, 1, 2], [0, 2, 3]]))
    assert loop.tolist() == [0, 1, 2, 3]


def test_scaling_scales_every_length(coat: GarmentMesh) -> None:
    larger = coat.scaled(1.05)
    for name, loop in coat.loops.items():
        girth = loop_length(coat.rest_position, loop)
        assert loop_length(larger.rest_position, larger.loops[name]) == pytest.approx(1.05 * girth)
    ratio = edge_lengths(larger.rest_position, larger.faces) / edge_lengths(
        coat.rest_position, coat.faces
    )
    assert np.allclose(ratio, 1.05)
    larger.validate()


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf])
def test_scale_must_be_positive(coat: GarmentMesh, factor: float) -> None:
    with pytest.raises(UserError, match="scale"):
        coat.scaled(factor)


@pytest.mark.parametrize(
    ("faces", "count", "reason"),
    [
        (np.empty((0, 3), int), 3, "empty"),
        (np.array([[0, 1, 5]]), 3, "expected 0 to 2"),
        (np.array([[0, 1, -1]]), 3, "expected 0 to 2"),
        (np.array([[0, 1, 1]]), 2, "degenerate"),
        (np.array([[0, 1, 2], [1, 2, 0]]), 3, "given twice"),
        (np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), 5, "more than two faces"),
        (np.array([[0, 1, 2], [0, 1, 3]]), 4, "oriented against"),
        (np.array([[0, 1, 2]]), 4, "belong to no face"),
        (np.array([[0, 1, 2], [3, 4, 5]]), 6, "2 separate parts"),
        (np.array([[0, 1, 2], [0, 3, 4]]), 5, "two sheets only touch"),
    ],
)
def test_broken_topology_is_named(faces: IndexArray, count: int, reason: str) -> None:
    with pytest.raises(UserError, match=reason):
        check_manifold(faces, count)


def test_unusable_garment_is_named(coat: GarmentMesh) -> None:
    coat.validate()
    x = coat.rest_position.copy()
    x[7, 1] = np.nan
    assert "NaN or infinity" in refusal(changed(coat, rest_position=x))
    x[7, 1] = np.inf
    assert "node 7" in refusal(changed(coat, rest_position=x))
    assert "empty" in refusal(changed(coat, rest_position=np.empty((0, 3))))
    x = coat.rest_position.copy()
    x[coat.faces[3]] = x[coat.faces[3, 0]]
    assert "without area" in refusal(changed(coat, rest_position=x))
    assert "region" in refusal(changed(coat, region=coat.region[:-1]))
    assert "region" in refusal(changed(coat, region=coat.region + 7))


def test_unusable_loop_is_named(coat: GarmentMesh) -> None:
    def with_loop(loop: npt.NDArray[np.integer]) -> GarmentMesh:
        return changed(coat, loops={**coat.loops, "left_cuff": np.asarray(loop)})

    loop = coat.loops["left_cuff"]
    assert "loops.left_cuff: is not a closed chain" in refusal(
        with_loop(loop[[0, 2, 1, *range(3, len(loop))]])
    )
    assert "not a closed chain" in refusal(with_loop(loop[:-2]))
    assert "expected at least 3" in refusal(with_loop(loop[:2]))
    assert "expected 0 to" in refusal(with_loop(np.append(loop, 10**6)))
    assert "twice" in refusal(with_loop(np.append(loop, loop[0])))
    assert "loops.left_cuff" in refusal(with_loop(np.empty(0, int)))
    rest = {k: v for k, v in coat.loops.items() if k != "left_cuff"}
    assert "left_cuff missing" in refusal(changed(coat, loops=rest))
    assert "grasp.right" in refusal(changed(coat, grasp={"left": coat.grasp["left"]}))
