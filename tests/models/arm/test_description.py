"""The Panda's files: converted once, and what the models say of it is what they say."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_dress.models.arm.description import panda_source, panda_urdf
from drake_dress.models.arm.panda import SHAPE

HAND = {"hand": 8}


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return panda_urdf(tmp_path_factory.mktemp("cache"))


def test_it_is_made_once(urdf: Path) -> None:
    before = urdf.stat().st_mtime_ns
    again = panda_urdf(urdf.parents[1])
    assert again == urdf
    assert again.stat().st_mtime_ns == before
    assert [p.name for p in urdf.parents[1].iterdir()] == [urdf.parent.name]


def test_nothing_is_left_half_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("drake_dress.models.arm.description._write_mesh", fail)
    with pytest.raises(OSError, match="disk full"):
        panda_urdf(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_meshes_are_as_they_were_but_turned(urdf: Path) -> None:
    converted = trimesh.load_scene(urdf.parent / "link4" / "model.gltf")
    source = trimesh.load_scene(panda_source() / "meshes" / "visual" / "link4.dae")
    # y is up in glTF
    low, high = source.bounds[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    np.testing.assert_allclose(converted.bounds[0], np.minimum(low, high), atol=1e-5)
    np.testing.assert_allclose(converted.bounds[1], np.maximum(low, high), atol=1e-5)


@pytest.mark.parametrize("name", [*(f"link{i}" for i in range(8)), "hand"])
def test_capsules_hold_the_collision_meshes(name: str) -> None:
    mesh = trimesh.load_mesh(panda_source() / "meshes" / "collision" / f"{name}.stl")
    k = HAND.get(name, int(name[-1]) if name[-1].isdigit() else 0)
    a, b = SHAPE.capsules.first[k], SHAPE.capsules.second[k]
    points = np.asarray(mesh.vertices)
    if name == "hand":
        # in the last link's frame: turned about its axis, at the flange
        c = np.sqrt(0.5)
        points = points @ np.array([[c, c, 0.0], [-c, c, 0.0], [0.0, 0.0, 1.0]]).T
        points = points + [0.0, 0.0, 0.107]
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    away = np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
    assert away.max() <= SHAPE.capsules.radius[k] + 1e-6
    assert away.max() > SHAPE.capsules.radius[k] - 2e-3
