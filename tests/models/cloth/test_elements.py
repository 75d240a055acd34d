import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements, make_elements
from tests.models.cloth.sheets import sheet


def test_an_inverted_triangle_is_named_with_its_neighbour() -> None:
    x, faces = sheet(4, 5, 0.03)
    faces[7] = faces[7, ::-1]
    with pytest.raises(ValueError, match=r"triangles .*\b7\b.* pass from node .* inverted"):
        make_elements(x, faces)


def test_an_edge_with_three_triangles_is_named() -> None:
    x, faces = sheet(3, 3, 0.03)
    x = np.vstack([x, [0.01, 0.01, 0.05]])
    shared = sorted(set(faces[0]) & set(faces[1]))
    fin = [*shared, len(x) - 1]
    with pytest.raises(ValueError, match="has 3 triangles, expected 1 or 2"):
        make_elements(x, np.vstack([faces, fin]))


def test_a_node_that_is_not_there_is_named() -> None:
    x, faces = sheet(3, 3, 0.03)
    faces[2, 1] = len(x)
    with pytest.raises(ValueError, match=r"triangle 2 has nodes .*expected 0 to 8"):
        make_elements(x, faces)


def test_a_rest_position_that_is_not_finite_is_named() -> None:
    x, faces = sheet(3, 3, 0.03)
    x[4, 2] = np.nan
    with pytest.raises(ValueError, match="node 4 rests at"):
        make_elements(x, faces)


def test_a_triangle_without_area_is_named() -> None:
    x, faces = sheet(3, 3, 0.03)
    x[faces[3, 1]] = x[faces[3, 0]]
    with pytest.raises(ValueError, match=r"triangle \d+ has no area"):
        make_elements(x, faces)


def test_triangles_of_their_own_that_are_those_of_a_sheet_give_the_sheet_s_elements() -> None:
    x, faces = sheet(5, 6, 0.03)
    whole, own = make_elements(x, faces), make_elements(x, faces, x[faces][..., :2])
    for name in ("triangle_area", "hinge_coefficient", "hinge_weight", "node_area"):
        np.testing.assert_allclose(getattr(own, name), getattr(whole, name), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(own.edge_rest_length, whole.edge_rest_length)
    np.testing.assert_allclose(own.hinge_rest, 0.0, atol=1e-12)

    # gradients are in other axes, and measure the same stretch
    def metric(e: Elements) -> FloatArray:
        g = e.triangle_gradient
        return np.asarray(np.einsum("fia,fja->fij", g, g))

    np.testing.assert_allclose(metric(own), metric(whole), rtol=1e-9)


def test_rest_shape_of_single_triangles_does_not_depend_on_where_the_nodes_are() -> None:
    x, faces = sheet(5, 6, 0.03)
    corners = x[faces][..., :2]
    rng = np.random.default_rng(0)
    bent = x + rng.normal(scale=0.01, size=x.shape)
    turned = corners @ np.array([[0.0, 1.0], [-1.0, 0.0]]) + rng.normal(size=(len(faces), 1, 2))
    here, there = make_elements(x, faces, corners), make_elements(bent, faces, turned)
    np.testing.assert_allclose(there.triangle_area, here.triangle_area, rtol=1e-9)
    np.testing.assert_allclose(there.hinge_coefficient, here.hinge_coefficient, atol=1e-9)
    np.testing.assert_allclose(there.edge_rest_length, here.edge_rest_length, rtol=1e-9)


def test_an_edge_between_triangles_of_different_size_rests_at_the_mean() -> None:
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, -1, 0]])
    faces = np.array([[0, 1, 2], [1, 0, 3]])
    corners = x[faces][..., :2]
    corners[1] *= 1.2
    e = make_elements(x, faces, corners)
    lengths = {tuple(edge): length for edge, length in zip(e.edge, e.edge_rest_length, strict=True)}
    assert lengths[0, 1] == pytest.approx(1.1)
    assert lengths[1, 3] == pytest.approx(1.2)


def test_corners_of_the_wrong_shape_are_told() -> None:
    x, faces = sheet(3, 3, 0.03)
    with pytest.raises(ValueError, match="corners have shape"):
        make_elements(x, faces, x[faces])
