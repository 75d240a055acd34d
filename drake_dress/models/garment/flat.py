"""The flat shape of a garment's triangles, from the texture coordinates of its file.

Garment programs lay the pattern out as texture coordinates, so these tell the cut of the cloth also
where the mesh is draped and strained. Their unit is unknown, and each island of them may have its
own, so each is scaled to the size that it has in the mesh.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray, IntArray
from drake_dress.models.garment.fans import HalfEdges
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.mesh import face_areas

# Texture coordinates nearer than this share of their range are the same point.
_SAME = 1e-6
# A triangle whose sides differ by more than this from the flat ones is no drape of them.
FAR = 0.25
# Largest median of the strain, and largest share of the area that is strained by more than `FAR`,
# at which texture coordinates are a pattern. Shirts that a garment program draped on a body have
# 0.05 and 0.001; atlases that a program made to paint on, cut into hundreds of pieces, 0.5 and 0.8.
_MOST_MEDIAN, _MOST_FAR = 0.1, 0.05


class FlatShape(NamedTuple):
    """The triangles of a garment as they lie in its pattern.

    Attributes:
        corners: (F,3,2), m.
        strain: (F,) of the mesh against them: the larger of |log σ| of both principal stretches σ.
        area: (F,) in the mesh, m².
        islands: number of pieces of the pattern.
    """

    corners: FloatArray
    strain: FloatArray
    area: FloatArray
    islands: int

    @property
    def median(self) -> float:
        """Median strain over the area."""
        return _weighted_quantile(self.strain, self.area, 0.5)

    @property
    def far(self) -> float:
        """Share of the area whose strain is above `FAR`."""
        return float(self.area[~(self.strain <= FAR)].sum() / self.area.sum())

    @property
    def is_pattern(self) -> bool:
        """Whether the mesh can be a drape of this pattern."""
        return self.median <= _MOST_MEDIAN and self.far <= _MOST_FAR

    def against(self, corner: FloatArray) -> FlatShape:
        """Returns them with the strain of other places (F,3,3) of their corners, m."""
        return self._replace(strain=_strain(_in_own_plane(corner), self.corners))

    def told(self) -> str:
        """Returns the strain of the mesh for messages."""
        most = _weighted_quantile(self.strain, self.area, 0.95)
        return (
            f"{100 * self.median:.1f} % in the median and more than {100 * most:.0f} % over a "
            "twentieth of the cloth"
        )


def flat_shape(mesh: RawMesh) -> FlatShape:
    """Returns the triangles as they lie in the texture coordinates, scaled to m.

    Each island is scaled by the median of its triangles, by area. A uniform strain of a whole
    island is therefore not told. A triangle that is strained by more than `FAR` keeps the shape
    that it has in the mesh.

    Args:
        mesh: in m, oriented manifold, with texture coordinates.

    Raises:
        UserError: there are no texture coordinates, or some triangles have none.
    """
    if mesh.uv is None:
        raise UserError(
            mesh.source, "rest", "is uv, but the file has no texture coordinates, expected mesh"
        )
    bare = np.asarray(~np.isfinite(mesh.uv).all(axis=(1, 2)))
    if bare.any():
        raise UserError(
            mesh.source,
            "rest",
            f"is uv, but {bare.sum()} of {len(bare)} triangles have no texture coordinates, the "
            f"first is {mesh.face(int(np.argmax(bare)))}; expected mesh",
        )
    own, area = _in_own_plane(mesh.position[mesh.faces]), face_areas(mesh.position, mesh.faces)
    island = _islands(mesh.faces, mesh.uv, len(mesh.position))
    side = mesh.uv[:, 1:] - mesh.uv[:, :1]
    with np.errstate(all="ignore"):
        ratio = np.sqrt(area / (0.5 * np.abs(np.linalg.det(side))))
    scale = np.array(
        [
            _weighted_quantile(ratio[island == k], area[island == k], 0.5)
            for k in range(int(island.max()) + 1)
        ]
    )
    with np.errstate(all="ignore"):
        corners = scale[island][:, None, None] * (mesh.uv - mesh.uv[:, :1])
        strain = _strain(own, corners)
    corners = np.where((strain <= FAR)[:, None, None], corners, own)
    return FlatShape(corners, strain, area, len(scale))


def check_pattern(flat: FlatShape, source: str) -> None:
    """Checks that texture coordinates are a pattern of the garment.

    Raises:
        UserError: the mesh is strained too much for that.
    """
    if not flat.is_pattern:
        raise UserError(
            source,
            "rest",
            f"is uv, but the texture coordinates, in {flat.islands} islands, are no flat pattern "
            f"of this mesh: they differ from it by {100 * np.expm1(flat.median):.0f} % in the "
            f"median, and by more than {100 * FAR:.0f} % over {100 * flat.far:.0f} % of the cloth, "
            f"expected at most {100 * _MOST_MEDIAN:.0f} % and {100 * _MOST_FAR:.0f} %, or mesh",
        )


def _in_own_plane(corner: FloatArray) -> FloatArray:
    """Returns (F,3,2) the corners (F,3,3) of each triangle in a plane of its own, m."""
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    length = np.maximum(np.linalg.norm(first, axis=1), 1e-300)
    along = np.einsum("ij,ij->i", first, second) / length
    across = np.linalg.norm(np.cross(first, second), axis=1) / length
    flat = np.zeros((len(corner), 3, 2))
    flat[:, 1, 0], flat[:, 2, 0], flat[:, 2, 1] = length, along, across
    return flat


def _strain(own: FloatArray, corners: FloatArray) -> FloatArray:
    """Returns (F,) the largest |log σ| of triangles against flat ones; infinity for flat points."""
    edges = [np.swapaxes(x[:, 1:] - x[:, :1], 1, 2) for x in (own, corners)]
    with np.errstate(all="ignore"):
        sound = np.abs(np.linalg.det(edges[1])) > 1e-9 * np.abs(np.linalg.det(edges[0]))
    safe = np.where(sound[:, None, None], edges[1], np.eye(2))
    stretch = np.linalg.svd(edges[0] @ np.linalg.inv(safe), compute_uv=False)
    with np.errstate(all="ignore"):
        strain = np.abs(np.log(stretch)).max(axis=1)
    return np.where(sound & np.isfinite(strain), strain, np.inf)


def _islands(faces: IndexArray, uv: FloatArray, n: int) -> IntArray:
    """Returns (F,) the island of each face: faces join where they share an edge in the texture."""
    edges = HalfEdges.of(faces, n)
    pairs = edges.pairs()
    first, second = edges.face[pairs[:, 0]], edges.face[pairs[:, 1]]
    same = np.ones(len(pairs), dtype=bool)
    near = _SAME * max(float(np.ptp(uv.reshape(-1, 2), axis=0).max()), 1e-300)
    for end in (0, 1):
        node = edges.ends[edges.edge[pairs[:, 0]], end]
        there = [uv[f, np.argmax(faces[f] == node[:, None], axis=1)] for f in (first, second)]
        same &= np.abs(there[0] - there[1]).max(axis=1) <= near
    graph = coo_array(
        (np.ones(int(same.sum())), (first[same], second[same])), shape=(len(faces), len(faces))
    )
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int32)


def _weighted_quantile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Returns the smallest value up to which at least this share of the weight lies."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(total, share * total[-1])), len(order) - 1)])
