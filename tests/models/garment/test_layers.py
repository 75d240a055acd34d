"""Cloth with two layers, closed bodies, flat pieces and unsewn panels are told as such."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.layers import other_layer
from drake_dress.models.garment.load import read_garment
from drake_dress.models.garment.mesh import REGION_NAMES
from drake_dress.models.garment.mesh_options import MeshOptions
from tests.models.garment.changed import (
    JACKET,
    Surface,
    panels,
    pullover,
    thick,
    written,
)


def refusal(path: Path, surface: Surface, **options: float) -> str:
    with pytest.raises(UserError) as caught:
        read_garment(written(path, surface), MeshOptions(**options))  # type: ignore[arg-type]
    message = str(caught.value)
    assert " … " not in message
    return message


@pytest.mark.parametrize("thickness", [0.001, 0.012])
def test_layers_that_are_joined_at_all_rims_are_a_body_with_a_thickness(
    tmp_path: Path, thickness: float
) -> None:
    message = refusal(tmp_path / "c.obj", thick(JACKET, thickness))
    assert "is a body with a thickness" in message
    told = float(message.partition(" mm apart")[0].rpartition(" ")[2])
    assert told == pytest.approx(1e3 * thickness, abs=0.2 + 0.2e3 * thickness)


@pytest.mark.parametrize("joined", [1, 2])
def test_layers_that_are_joined_at_some_rims_are_told(tmp_path: Path, joined: int) -> None:
    message = refusal(tmp_path / "c.obj", thick(JACKET, 0.004, joined))
    assert "two layers" in message or "body with a thickness" in message


def test_layers_that_are_not_joined_are_told_with_a_key_that_takes_one(tmp_path: Path) -> None:
    surface = thick(JACKET, 0.005, 0)
    message = refusal(tmp_path / "c.obj", surface)
    assert "two layers, such as a lining" in message
    taken = message.partition("garment.mesh.take: ['")[2].partition("'")[0]
    whole = read_garment(tmp_path / "c.obj", MeshOptions(take=[taken]))
    assert len(whole.faces) == len(JACKET.faces)


def test_a_closed_body_is_told(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(3, radius=0.4)
    surface = np.asarray(sphere.vertices), np.asarray(sphere.faces, dtype=np.int32)
    assert "the surface is closed" in refusal(tmp_path / "c.obj", surface)


def four_panels() -> tuple[Surface, np.ndarray]:
    """A pullover in front, back, and both sleeves."""
    x, faces = pullover()
    middle = x[faces].mean(axis=1)
    label = (middle[:, 0] > 0.0).astype(np.int64)
    # the sleeves of the coat, found by place because sewing renumbers nodes
    for k, side in enumerate(("left", "right")):
        sleeve = JACKET.rest_position[JACKET.region == REGION_NAMES.index(f"{side}_sleeve")]
        out = (1.0 if side == "left" else -1.0) * middle[:, 1]
        label[out > np.abs(sleeve[:, 1]).min() + 0.02] = 2 + k
    return (x, faces), label


def test_panels_that_are_not_sewn_are_told_with_the_gap_that_joins_them(tmp_path: Path) -> None:
    surface, label = four_panels()
    narrow = refusal(tmp_path / "p.obj", panels(surface, label, 0.0025))
    assert "the garment is 4 panels that are not sewn" in narrow
    weld = float(narrow.partition("garment.mesh.weld: ")[2].partition(" ")[0])
    assert read_garment(tmp_path / "p.obj", MeshOptions(weld=weld)).front == "closed"
    wide = refusal(tmp_path / "p.obj", panels(surface, label, 0.1))
    assert "weld cannot join them" in wide


def piece(at: float, width: float) -> tuple[FloatArray, np.ndarray]:
    y, z = np.meshgrid(np.linspace(0.0, width, 8), np.linspace(0.0, 0.6, 12), indexing="ij")
    x = np.column_stack([np.zeros(y.size), y.ravel() + at, z.ravel()])
    corner = (np.arange(7)[:, None] * 12 + np.arange(11)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 12, corner + 1], axis=1),
            np.stack([corner + 1, corner + 12, corner + 13], axis=1),
        ]
    )
    return x, faces


def test_pattern_pieces_in_one_plane_are_told(tmp_path: Path) -> None:
    places = [(0.0, 0.4), (0.5, 0.4), (1.0, 0.3), (1.4, 0.3)]
    parts = [piece(*place) for place in places]
    x = np.concatenate([part[0] for part in parts])
    faces = np.concatenate([part[1] + k * 96 for k, part in enumerate(parts)]).astype(np.int32)
    assert "4 flat pattern pieces in one plane" in refusal(tmp_path / "p.obj", (x, faces))
    one = (parts[0][0], parts[0][1].astype(np.int32))
    assert "the surface is flat" in refusal(tmp_path / "p.obj", one)


@pytest.mark.parametrize("gap", [0.001, 0.008, 0.03])
def test_the_share_and_gap_of_layers_are_measured(gap: float) -> None:
    lower, faces = piece(0.0, 0.4)
    x = np.concatenate([lower, lower + [gap, 0.0, 0.0]])
    both = np.concatenate([faces, faces[:, ::-1] + len(lower)])
    for sheet in (np.zeros(len(both)), np.repeat([0, 1], len(faces))):
        share, found = other_layer(x, both, sheet.astype(np.int64))
        assert share == pytest.approx(1.0 if gap < 0.02 else 0.0)
        if share:
            assert found == pytest.approx(gap)
    alone, _ = other_layer(lower, faces, np.zeros(len(faces), dtype=np.int64))
    assert alone == 0.0


def test_a_coat_that_lies_flat_is_one_layer(tmp_path: Path) -> None:
    """Its front lies on its back, and both are cloth of one garment."""
    x, faces = pullover()
    flat = x * [0.04, 1.0, 1.0]
    assert read_garment(written(tmp_path / "p.obj", (flat, faces)), MeshOptions()).front == "closed"
