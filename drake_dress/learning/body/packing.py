"""Makes the file of the parametric body from a body model."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.body.collapse import Collapse
from drake_dress.learning.body.corners import corner_shapes
from drake_dress.learning.body.parts import bone_weights, joint_rows, part_numbers
from drake_dress.learning.body.source import Source
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.body_file import MIDDLE_JOINTS, PARTS, STEP, BodyFile
from drake_dress.models.human.skin.macro import AGES

# Largest error at which a vertex is left out, m. A garment meets arms and trunk, whose girths are
# measured; nobody looks at ears and finger tips.
_TOLERANCE = {
    "trunk": 6e-4,
    "neck": 6e-4,
    "head": 3e-3,
    "upper_arm": 2.5e-4,
    "forearm": 2.5e-4,
    "palm": 6e-4,
    "fingers": 1.5e-3,
    "thumb": 1e-3,
    "thigh": 8e-4,
    "shin": 8e-4,
    "foot": 2e-3,
}
_ON_PLANE = 1e-6  # m, of a vertex on the plane of symmetry


def body_file(source: Source) -> BodyFile:
    """Returns the content of the file for a symmetric body model."""
    corners = corner_shapes(source)
    parts = part_numbers(source)
    adult = corners["base"][:, AGES.index("young"), 1, 1].mean(axis=0)
    position = (source.position + adult)[: source.vertex_count]
    half = source.faces[(position[source.faces, 1] > -_ON_PLANE).all(axis=1)]
    on_plane = np.abs(position[:, 1]) < _ON_PLANE
    tolerance = np.array([_TOLERANCE[PARTS[part]] for part in parts])
    faces = Collapse(position, half, set(np.flatnonzero(on_plane)), tolerance).run()
    kept, middle = _ordered(faces, on_plane)
    rows = np.concatenate([kept, joint_rows(source)])
    shapes = {name: array[..., rows, :] for name, array in corners.items()}
    _put_on_plane(shapes, middle, len(kept))
    mean = shapes["base"].reshape(-1, len(rows), 3).mean(axis=0)
    template = source.position[rows].copy()
    template[_middle_rows(middle, len(kept)), 1] = 0.0
    shapes["base"] = shapes["base"] - mean
    new = np.zeros(len(position), dtype=np.int64)
    new[kept] = np.arange(len(kept))
    return BodyFile(
        middle=middle,
        mean=template + mean,
        **{name: np.rint(array / STEP).astype(np.int16) for name, array in shapes.items()},
        faces=_sorted(new[faces]),
        weights=bone_weights(source)[kept],
        parts=parts[kept],
    )


def _ordered(faces: IndexArray, on_plane: np.ndarray) -> tuple[IndexArray, int]:
    """Returns the vertices that are used, those of the plane first, and how many these are."""
    used = np.unique(faces)
    return np.concatenate([used[on_plane[used]], used[~on_plane[used]]]), int(on_plane[used].sum())


def _middle_rows(middle: int, count: int) -> IndexArray:
    return np.concatenate([np.arange(middle), count + np.arange(len(MIDDLE_JOINTS))])


def _put_on_plane(shapes: dict[str, FloatArray], middle: int, count: int) -> None:
    for array in shapes.values():
        array[..., _middle_rows(middle, count), 1] = 0.0


def _sorted(faces: IndexArray) -> IndexArray:
    """Returns faces in an order that depends on nothing else; each keeps its winding."""
    first = np.argmin(faces, axis=1)
    turned = np.stack([np.roll(f, -k) for f, k in zip(faces, first, strict=True)])
    return turned[np.lexsort(turned.T[::-1])]
