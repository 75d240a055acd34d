from pathlib import Path

import numpy as np
import pytest

from drake_dress.learning.body.corners import corner_shapes
from drake_dress.learning.body.packing import body_file
from drake_dress.models.human.skin.body_file import STEP, read_body, write_body
from drake_dress.models.human.skin.macro import Macro
from drake_dress.models.human.skin.skin import skin_of_points
from tests.learning.body.model import small_model


def test_packed_body_has_the_vertices_of_the_model() -> None:
    source = small_model()
    body = body_file(source)
    assert (body.middle, body.vertex_count) == (4, 5)
    points = body.points(Macro(0.0, 1.0, 0.0, 1.0, height=1.0))
    corners = corner_shapes(source)
    expected = source.position + corners["base"][0, 3, 0, 2] + 0.5 * corners["height"][0, 3, 0, 2]
    # rounding of the two shapes to steps
    assert points[:5] == pytest.approx(expected[:5], abs=0.8 * STEP)
    skin = skin_of_points(body, points)
    assert len(skin.vertices) == 6
    assert skin.volume > 1.0
    assert np.array_equal(skin.sides, [0, 0, 0, 0, 1, -1])


def test_same_model_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("first.npz", "second.npz"):
        write_body(tmp_path / name, body_file(small_model()))
    assert (tmp_path / "first.npz").read_bytes() == (tmp_path / "second.npz").read_bytes()
    assert read_body(tmp_path / "first.npz").vertex_count == 5
