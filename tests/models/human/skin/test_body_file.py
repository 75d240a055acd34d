from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.human.skin.body_file import (
    JOINTS,
    MIDDLE_JOINTS,
    SHIPPED,
    STEP,
    read_body,
    write_body,
)
from drake_dress.models.human.skin.macro import Macro
from drake_dress.models.human.skin.skin import skin_of_points


def test_shipped_file_is_small() -> None:
    assert SHIPPED.stat().st_size < 3 * 2**20


def test_written_file_has_the_same_bytes_as_the_one_it_was_read_from(tmp_path: Path) -> None:
    body = read_body()
    for name in ("first.npz", "second.npz"):
        write_body(tmp_path / name, body)
    first = (tmp_path / "first.npz").read_bytes()
    assert first == (tmp_path / "second.npz").read_bytes()
    again = read_body(tmp_path / "first.npz")
    for name in ("mean", "base", "height", "proportions", "faces", "parts"):
        assert np.array_equal(getattr(again, name), getattr(body, name))
    assert again.weights == pytest.approx(body.weights, abs=1e-6)


def test_points_at_a_corner_are_those_of_the_file() -> None:
    body = read_body()
    points = body.points(Macro(1.0, 2.0 / 3.0, 0.5, 1.0))
    expected = body.mean + STEP * body.base[1, 2, 1, 2]
    assert points == pytest.approx(expected, abs=1e-12)
    tallest = body.points(Macro(1.0, 2.0 / 3.0, 0.5, 1.0, height=1.0))
    assert tallest - points == pytest.approx(0.5 * STEP * body.height[1, 2, 1, 2], abs=1e-12)


def test_middle_is_on_the_plane_of_symmetry_at_every_corner() -> None:
    body = read_body()
    n = body.vertex_count
    middle = [*range(body.middle), *(n + i for i in range(len(MIDDLE_JOINTS)))]
    assert np.all(body.mean[middle, 1] == 0.0)
    for array in (body.base, body.height, body.proportions):
        assert not array[..., middle, 1].any()
    assert len(body.mean) == n + len(MIDDLE_JOINTS) + len(JOINTS)


def test_skin_weights_sum_to_one() -> None:
    assert read_body().weights.sum(axis=1) == pytest.approx(1.0, abs=1e-14)
    assert read_body().weights.min() >= 0.0


def test_whole_skin_is_closed_and_oriented() -> None:
    body = read_body()
    skin = skin_of_points(body, body.points(Macro(0.0, 0.7)))
    directed = Counter((int(f[k]), int(f[(k + 1) % 3])) for f in skin.faces for k in range(3))
    assert set(directed.values()) == {1}
    assert all((b, a) in directed for a, b in directed)
    assert skin.volume > 0.05


@pytest.mark.parametrize("content", [b"", b"no archive", SHIPPED.read_bytes()[:5000]])
def test_damaged_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "body.npz"
    path.write_bytes(content)
    with pytest.raises(UserError, match="dataset body"):
        read_body(path)


def test_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        read_body(tmp_path / "absent.npz")
    path = tmp_path / "other.npz"
    np.savez(path, x=np.zeros(3))
    with pytest.raises(UserError, match="cannot be read"):
        read_body(path)
