"""Grippers that hold a garment at the edges of its opening hold each edge at one height."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import orientation
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.front import rim_of
from drake_dress.models.garment.geodesics import reach
from drake_dress.models.garment.hold import held_at_edges
from drake_dress.models.garment.load import MeshOptions, read_garment
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from tests.models.garment.changed import pullover, written

OPEN = [pytest.param(c, id=name) for name, c in COATS.items()]


def armholes_height(mesh: GarmentMesh) -> float:
    z = [mesh.rest_position[mesh.loops[f"{side}_armhole"], 2] for side in SIDES]
    return float(np.ptp(np.concatenate(z)))


@pytest.mark.parametrize("measures", OPEN)
@settings(max_examples=5)
@given(depth=st.floats(0.3, 1.0), spacing=st.sampled_from([0.02, 0.05]))
def test_both_edges_of_every_cut_are_held_at_the_wanted_depth(
    measures: CoatParameters, depth: float, spacing: float
) -> None:
    mesh = make_coat(measures, spacing)
    held = held_at_edges(mesh, depth, "s.yaml")
    held.validate()
    rim, x = rim_of(mesh), mesh.rest_position
    assert rim is not None
    wanted = -depth * armholes_height(mesh)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        nodes = held.grasp[side]
        on_edge = nodes[np.isin(nodes, rim)]
        assert len(nodes) >= 4
        assert len(on_edge) >= 1
        assert np.abs(x[on_edge, 2] - wanted).min() < 1.5 * spacing
        assert np.ptp(x[nodes], axis=0).max() < 0.045 * 2 + 2.0 * spacing
        assert (sign * x[nodes, 1] > -0.5 * spacing).all(), "each gripper holds its own side"
        ahead = 1.0 if measures.opens == "front" else -1.0
        assert ahead * x[on_edge, 0].mean() > 0.0, "on the side that is open"
    mirrored = x[held.grasp["right"]].mean(axis=0) * [1.0, -1.0, 1.0]
    assert np.linalg.norm(x[held.grasp["left"]].mean(axis=0) - mirrored) < 0.02


@pytest.mark.parametrize("measures", OPEN)
def test_spread_edges_reach_further_apart_than_at_rest(measures: CoatParameters) -> None:
    held = held_at_edges(make_coat(measures, 0.05), 0.4, "s.yaml")
    x = held.rest_position
    at_rest = np.linalg.norm(
        x[held.grasp["left"]].mean(axis=0) - x[held.grasp["right"]].mean(axis=0)
    )
    assert reach(held).between_grippers > 1.2 * at_rest


def test_a_hold_deeper_than_the_hem_is_refused() -> None:
    with pytest.raises(UserError, match=r"s.yaml: garment.hold_depth: is 9, deeper than the left"):
        held_at_edges(make_coat(COATS["jacket"], 0.05), 9.0, "s.yaml")


def test_what_is_not_open_has_no_edges_to_hold(tmp_path: Path) -> None:
    path = written(tmp_path / "pullover.obj", pullover(), orientation("z"))
    mesh = read_garment(path, MeshOptions()).mesh()
    with pytest.raises(UserError, match=r"s.yaml: garment.hold: is edges, but no opening"):
        held_at_edges(mesh, 0.4, "s.yaml")
