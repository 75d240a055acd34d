"""What every coat's mesh must satisfy, whatever its cut."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.garment.coat import CoatParameters
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths, loop_length


def check_whole_coat(mesh: GarmentMesh, p: CoatParameters, spacing: float) -> None:
    """Checks that a coat is one manifold sheet with good triangles that nowhere pierces itself.

    Its boundaries are both cuffs and the rim; its girths and lengths are the measures.
    """
    mesh.validate()
    x, faces = mesh.rest_position, mesh.faces
    length = edge_lengths(x, faces)
    assert 0.7 * spacing < length.mean() < 1.25 * spacing
    assert length.max() <= 1.7 * spacing
    assert np.rad2deg(trimesh.triangles.angles(x[faces]).min()) >= 12.0
    loops = [set(q.tolist()) for q in boundary_loops(faces)]
    assert len(loops) == 3
    assert all(set(mesh.loops[f"{side}_cuff"].tolist()) in loops for side in ("left", "right"))
    assert len(piercing_edges(x, make_elements(x, faces))) == 0
    for side, sign in (("left", 1.0), ("right", -1.0)):
        armhole, cuff = mesh.loops[f"{side}_armhole"], mesh.loops[f"{side}_cuff"]
        assert (sign * x[armhole, 1] > 0).all()
        assert loop_length(x, armhole) == pytest.approx(p.armhole_girth, rel=0.03)
        assert loop_length(x, cuff) == pytest.approx(p.cuff_girth, rel=0.03)
        top = np.linalg.norm(x[cuff[0]] - x[armhole[0]])
        assert top == pytest.approx(p.sleeve_length, rel=0.03)
        assert x[armhole[0], 2] - x[:, 2].min() == pytest.approx(p.body_length, rel=0.03)
        # the wearer's front first
        quarter = len(armhole) // 4
        assert x[armhole[quarter], 0] > 0 > x[armhole[-quarter], 0]
        held = x[mesh.grasp[side]]
        assert len(held) >= 4
        assert (sign * held[:, 1] > 0).all()
        assert abs(held.mean(axis=0)[2]) < 0.08
