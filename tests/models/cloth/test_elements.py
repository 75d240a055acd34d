import numpy as np
import pytest

from drake_dress.models.cloth.elements import make_elements
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
