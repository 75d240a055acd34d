"""A panel's triangles fill it, follow its border, and have no slivers."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.files.pattern.triangles import triangulated


def outline(corners: list[list[float]], step: float) -> FloatArray:
    points = []
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        start, end = np.array(a), np.array(b)
        count = max(1, round(float(np.linalg.norm(end - start)) / step))
        points.append(start + np.linspace(0, 1, count, endpoint=False)[:, None] * (end - start))
    return np.vstack(points)


SHAPES = {
    "rectangle": [[0.0, 0.0], [0.5, 0.0], [0.5, 0.3], [0.0, 0.3]],
    "l": [[0.0, 0.0], [0.5, 0.0], [0.5, 0.2], [0.2, 0.2], [0.2, 0.6], [0.0, 0.6]],
    "wedge": [[0.0, 0.0], [0.5, 0.0], [0.25, 0.4]],
    "neck": [[0.0, 0.0], [0.6, 0.0], [0.6, 0.5], [0.4, 0.5], [0.3, 0.38], [0.2, 0.5], [0.0, 0.5]],
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("step", [0.012, 0.03])
def test_triangles_fill_a_panel(name: str, step: float) -> None:
    border = outline(SHAPES[name], step)
    made = triangulated(border, step)
    assert made is not None
    points, faces = made
    np.testing.assert_array_equal(points[: len(border)], border)
    flat = np.column_stack([points, np.zeros(len(points))])
    areas = np.cross(flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]])
    assert (areas[:, 2] > 0).all()
    x, y = border.T
    whole = 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum()
    assert 0.5 * areas[:, 2].sum() == pytest.approx(whole, rel=1e-9)
    angles = np.rad2deg(trimesh.triangles.angles(flat[faces]))
    assert angles.min() > 15.0


def test_a_border_too_coarse_for_its_narrowest_place_gives_none() -> None:
    # a slit 1 mm wide in steps of 5 cm
    corners = [
        [0.0, 0.0],
        [0.5, 0.0],
        [0.5, 0.4],
        [0.251, 0.4],
        [0.25, 0.1],
        [0.249, 0.4],
        [0, 0.4],
    ]
    border = outline(corners, 0.05)
    border[:, 0] += 0.004 * (border[:, 1] > 0.15) * (border[:, 0] > 0.2) * (border[:, 0] < 0.2499)
    assert triangulated(border, 0.05) is None
