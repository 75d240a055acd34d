import numpy as np
import pytest

from drake_dress.models.human.skin.inside import winding_numbers
from tests.models.human.skin.bodies import tube


def test_closed_mesh_winds_once_around_what_is_inside() -> None:
    vertices, faces = tube(np.array([0.1, 0.05]), np.array([0.0, 0.4]))
    inside, outside = np.array([[0.0, 0.0, 0.2], [0.08, 0.0, 0.02]]), np.array([[0.09, 0.0, 0.3]])
    assert winding_numbers(inside, vertices, faces) == pytest.approx([1.0, 1.0])
    assert winding_numbers(outside, vertices, faces) == pytest.approx([0.0], abs=1e-12)
    assert winding_numbers(inside, vertices, faces[:, ::-1]) == pytest.approx([-1.0, -1.0])


def test_hole_takes_its_solid_angle_away() -> None:
    vertices, faces = tube(np.array([0.1, 0.1]), np.array([0.0, 0.2]), corners=200)
    lid = (faces == len(vertices) - 1).any(axis=1)
    seen = winding_numbers(np.array([[0.0, 0.0, 0.1]]), vertices, faces[~lid])
    # a disc seen from its axis at its radius away
    assert seen == pytest.approx([1.0 - 0.5 * (1.0 - np.sqrt(0.5))], abs=1e-3)
