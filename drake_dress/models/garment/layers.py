"""Refuses cloth that is modelled as two layers: an outer and an inner sheet.

Two sheets that are joined at their rims are a hollow body, with a handle for each sleeve. Sheets
that are not joined everywhere have borders that lie in each other. A sheet of cloth has neither.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray, IntArray
from drake_dress.models.garment.edges import boundary_loops, unique_edges
from drake_dress.models.garment.files.raw import RawMesh, place
from drake_dress.models.garment.mesh import face_areas, loop_length

THICKEST = 0.02  # distance of two layers of one garment, m: quilted coats are 1 to 2 cm thick
_SHARE = 0.5  # of the area that has another layer, above which a garment is double
_OPPOSED = 0.7  # least cosine between the normals of two layers
_CANDIDATES = 24  # nearest faces among which the other layer is searched
_ONE_WAY = 0.99  # mean cosine of the faces' normals above which a surface is flat
_LEAST_GIRTH = 0.1  # of a border that counts, m


def check_one_layer(mesh: RawMesh) -> None:
    """Checks that a surface is one layer of cloth with openings.

    Args:
        mesh: a connected oriented manifold, in m.

    Raises:
        UserError: it is closed, or it has an outer and an inner layer.
    """
    x, faces = mesh.position, mesh.faces
    corner = x[faces]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    if np.linalg.norm(across.sum(axis=0)) > _ONE_WAY * np.linalg.norm(across, axis=1).sum():
        raise UserError(
            mesh.source,
            "faces",
            f"the surface is flat{_middle(x)}, a pattern piece and not a garment: expected it sewn "
            "and draped (export it so from the program that made it)",
        )
    loops = [q for q in boundary_loops(faces) if loop_length(x, q) >= _LEAST_GIRTH]
    handles = 1 - 0.5 * (
        len(x) - len(unique_edges(faces)) + len(faces) + len(boundary_loops(faces))
    )
    if not loops or handles >= 1.0:
        share, gap = other_layer(x, faces, np.zeros(len(faces), dtype=np.int64))
        if share > _SHARE:
            raise UserError(
                mesh.source,
                "faces",
                f"the cloth is a body with a thickness: over {100 * share:.0f} % of it, an outer "
                f"and an inner layer lie {1e3 * gap:.1f} mm apart and are joined at their rims, "
                "expected one layer (export the garment without thickness)",
            )
    if not loops:
        raise UserError(
            mesh.source,
            "faces",
            f"the surface is closed, {len(faces)} triangles without a border{_middle(x)}, expected "
            "openings for head, hem and arms",
        )
    nested = _nested(x, loops)
    if nested is not None:
        outer, inner, gap = nested
        raise UserError(
            mesh.source,
            "faces",
            f"the cloth has two layers, such as a lining: two borders {loop_length(x, outer):.2f} "
            f"and {loop_length(x, inner):.2f} m around lie within {1e3 * gap:.0f} mm of each "
            f"other{_middle(x[outer])}, expected one layer (leave one out by "
            "garment.mesh.leave_out)",
        )


def other_layer(x: FloatArray, faces: IndexArray, sheet: IndexArray) -> tuple[float, float]:
    """Returns the share of the area that has another layer close to it, and their median gap, m.

    Faces of the same sheet count if they face away from each other; those of different sheets count
    also if they face the same way.

    Args:
        x: (n,3), m.
        faces: (F,3).
        sheet: (F,) sheet of each face.
    """
    a, b, c = (x[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    middle = (a + b + c) / 3.0
    width = np.sqrt(face_areas(x, faces))
    _, other = KDTree(middle).query(middle, k=min(_CANDIDATES, len(faces)))
    offset = middle[other] - middle[:, None]
    depth = np.einsum("fki,fi->fk", offset, normal)
    aside = np.linalg.norm(offset - depth[..., None] * normal[:, None], axis=2)
    alike = np.einsum("fki,fi->fk", normal[other], normal)
    apart = np.where(sheet[other] == sheet[:, None], alike < -_OPPOSED, np.abs(alike) > _OPPOSED)
    apart &= (np.abs(depth) < THICKEST) & (aside < 2.0 * width[:, None])
    double = apart.any(axis=1)
    area = face_areas(x, faces)
    gap = np.where(apart, np.abs(depth), np.inf).min(axis=1)
    return float(area[double].sum() / area.sum()), float(np.median(gap[double])) if any(
        double
    ) else 0.0


def _nested(x: FloatArray, loops: Sequence[IntArray]) -> tuple[IntArray, IntArray, float] | None:
    """Returns two borders that lie in each other, and their greatest distance, m."""
    for k, first in enumerate(loops):
        for second in loops[k + 1 :]:
            there, _ = KDTree(x[first]).query(x[second])
            back, _ = KDTree(x[second]).query(x[first])
            gap = max(float(there.max()), float(back.max()))
            if gap < THICKEST:
                return first, second, gap
    return None


def _middle(points: FloatArray) -> str:
    return place(points.mean(axis=0))
