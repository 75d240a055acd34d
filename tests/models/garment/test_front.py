"""A garment is open at the front, open at the back, or closed, whatever its pose and mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drake_dress.models.dressing.sleeve import loop_orientation
from drake_dress.models.garment.axes import orientation
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.front import Opening, front_of
from drake_dress.models.garment.load import MeshOptions, read_garment
from tests.models.garment.changed import JACKET, Surface, flat_gown, of, pullover, written

# The axes of a garment in its canonical pose, and of one that is turned about the vertical.
AHEAD, ABOUT = orientation("z"), orientation("z", "-x")
TURNED: dict[Opening, Opening] = {"front": "back", "back": "front", "closed": "closed"}


def opened(path: Path, surface: Surface, axes: np.ndarray, **options: float) -> set[Opening]:
    whole = read_garment(written(path, surface, axes), MeshOptions(**options))  # type: ignore[arg-type]
    return {front_of(whole.mesh()), *(front_of(whole.at_spacing(s)) for s in (0.03, 0.06))}


@pytest.mark.parametrize("spacing", [0.015, 0.06])
@pytest.mark.parametrize(
    "measures",
    [*COATS.values(), CoatParameters(front_opening=0.01), CoatParameters(front_opening=0.4)],
)
def test_every_parametric_coat_opens_where_it_was_cut(
    measures: CoatParameters, spacing: float
) -> None:
    assert front_of(make_coat(measures, spacing)) == measures.opens


@pytest.mark.parametrize(
    ("surface", "expected"), [(of(JACKET), "front"), (flat_gown(), "back"), (pullover(), "closed")]
)
def test_the_opening_is_told_and_turns_with_the_garment(
    tmp_path: Path, surface: Surface, expected: Opening
) -> None:
    path = tmp_path / "garment.obj"
    assert opened(path, surface, AHEAD) == {expected}
    assert opened(path, surface, ABOUT) == {TURNED[expected]}


@pytest.mark.parametrize("measures", [c for c in COATS.values() if c.opens == "front"])
def test_a_coat_that_is_opened_at_the_back_is_a_sound_gown(measures: CoatParameters) -> None:
    coat = make_coat(measures, 0.04)
    gown = coat.opened_at_back()
    gown.validate()
    assert front_of(gown) == "back"
    assert np.array_equal(gown.rest_position, coat.rest_position * [-1.0, 1.0, 1.0])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for end in ("armhole", "cuff"):
            loop = gown.rest_position[gown.loops[f"{side}_{end}"]]
            assert sign * loop[:, 1].mean() > 0.0
            assert loop[len(loop) // 4, 0] > loop[-len(loop) // 4, 0], "the front comes first"
        assert loop_orientation(gown, side) == loop_orientation(coat, side)
    again = gown.opened_at_back()
    assert np.array_equal(again.rest_position, coat.rest_position)
    assert np.array_equal(again.faces, coat.faces)
    assert all(np.array_equal(again.loops[name], coat.loops[name]) for name in coat.loops)


def test_edges_that_overlap_are_still_at_the_front() -> None:
    mesh = make_coat(CoatParameters(front_opening=0.02), 0.04)
    x = mesh.rest_position
    in_front = x[:, 0] > 0.05
    # each front panel is moved across the middle, over the other one
    x[:, 1] -= np.where(in_front, 0.06 * np.sign(x[:, 1]), 0.0)
    assert front_of(mesh) == "front"


def test_inside_out_faces_in_the_file_do_not_matter(tmp_path: Path) -> None:
    x, faces = flat_gown()
    assert opened(tmp_path / "gown.obj", (x, faces[:, ::-1]), AHEAD) == {"back"}


def test_a_hole_in_a_pullover_does_not_open_it(tmp_path: Path) -> None:
    x, faces = pullover()
    middle = x[faces].mean(axis=1)
    hole = (
        (np.abs(middle[:, 1]) < 0.03) & (middle[:, 0] > 0.0) & (np.abs(middle[:, 2] + 0.4) < 0.04)
    )
    assert hole.any()
    whole = read_garment(written(tmp_path / "p.obj", (x, faces[~hole])), MeshOptions())
    assert front_of(whole.mesh()) == "closed"
