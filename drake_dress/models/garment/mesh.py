"""A garment as a labelled triangle mesh, and checks that it is valid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.edges import unique_edges
from drake_dress.models.garment.manifold import Named, check_manifold, plain_node
from drake_dress.models.sides import SIDES

REGION_NAMES = ("body", "left_sleeve", "right_sleeve", "collar")
Hold = Literal["shoulders", "edges"]
LOOP_NAMES = ("left_armhole", "left_cuff", "right_armhole", "right_cuff")


class AtRest(Protocol):
    """A source of a garment's openings at rest: its mesh, or a run's log."""

    @property
    def rest_position(self) -> FloatArray:
        """(n,3) m."""

    @property
    def loops(self) -> Mapping[str, npt.NDArray[np.integer]]:
        """Nodes around each opening, in order, by the name of the opening."""


class SurfaceAtRest(AtRest, Protocol):
    """A source of the whole surface at rest."""

    @property
    def faces(self) -> npt.NDArray[np.integer]:
        """(F,3) triangles."""


@dataclass(frozen=True)
class GarmentMesh:
    """A garment at rest, with its openings and the nodes that grippers hold.

    In the canonical rest pose a coat faces +x, +y is its wearer's left, and z is up. The hem is
    lowest, the sleeves point sideways and down, and the origin is the midpoint between the shoulder
    tips.

    Attributes:
        rest_position: (n,3) float64, m.
        faces: (F,3) int32, counter-clockwise seen from outside.
        loops: node indices in order around each opening of `LOOP_NAMES`; the first is not repeated.
        grasp: nodes held by each gripper, with keys `left` and `right`.
        region: (n,) int8, index into `REGION_NAMES`.
        hold: where the grippers hold it: at its shoulders, or at the edges of its opening.
    """

    rest_position: FloatArray
    faces: IntArray
    loops: dict[str, IntArray]
    grasp: dict[str, IntArray]
    region: npt.NDArray[np.int8]
    hold: Hold = "shoulders"

    @property
    def held(self) -> IntArray:
        """(k,) int32 nodes held by the left, then by the right gripper."""
        return np.concatenate([self.grasp[side] for side in SIDES]).astype(np.int32)

    @property
    def held_offsets(self) -> tuple[FloatArray, FloatArray]:
        """(k,3) nodes held by the left and by the right gripper from their middle at rest, m."""
        left, right = (self.rest_position[self.grasp[side]] for side in SIDES)
        return left - left.mean(axis=0), right - right.mean(axis=0)

    def scaled(self, factor: float) -> GarmentMesh:
        """Returns the same mesh with every length multiplied by `factor` about the origin.

        Raises:
            UserError: `factor` is not a positive finite number.
        """
        if not (np.isfinite(factor) and factor > 0):
            raise UserError("garment", "scale", f"is {factor}, expected a positive number")
        return replace(self, rest_position=self.rest_position * factor)

    def opened_at_back(self) -> GarmentMesh:
        """Returns the mirror image with front and back exchanged: a coat becomes a gown.

        Left stays left. Loops still begin at their first nodes and run along the front first.
        """
        loops = {name: np.roll(loop[::-1], 1) for name, loop in self.loops.items()}
        return replace(
            self,
            rest_position=self.rest_position * np.array([-1.0, 1.0, 1.0]),
            faces=np.ascontiguousarray(self.faces[:, ::-1]),
            loops=loops,
        )

    def validate(self, source: str = "garment") -> None:
        """Checks everything that the rest of the package relies on.

        Args:
            source: file or name at the beginning of the message.

        Raises:
            UserError: the mesh is empty, holds NaN or infinity, has a face without area, or is not
                a connected oriented manifold (see `check_manifold`); a loop is missing or is not a
                closed chain of edges; a grasp patch or the region is invalid.
        """
        check_positions(self.rest_position, source)
        n = len(self.rest_position)
        check_manifold(self.faces, n, source)
        areas = face_areas(self.rest_position, self.faces)
        flat = np.flatnonzero(areas < 1e-6 * np.mean(areas))
        if len(flat):
            raise UserError(
                source, "faces", f"{len(flat)} without area, the first is face {flat[0]}"
            )
        _check_loops(self.loops, self.faces, n, source)
        for side in SIDES:
            _check_indices(self.grasp.get(side), n, source, f"grasp.{side}")
        if self.region.shape != (n,):
            raise UserError(
                source, "region", f"has shape {self.region.shape}, expected ({n},) as the nodes"
            )
        if self.region.min() < 0 or self.region.max() >= len(REGION_NAMES):
            raise UserError(source, "region", f"holds values outside 0…{len(REGION_NAMES) - 1}")


def check_positions(position: FloatArray, source: str = "mesh") -> None:
    """Checks that there are nodes and that all are finite.

    Args:
        position: array to check, expected (n,3), m.
        source: file or name put in front of the message.

    Raises:
        UserError: the array has no nodes, another shape, NaN or infinity.
    """
    if position.size == 0:
        raise UserError(source, "nodes", "the mesh is empty, expected at least one triangle")
    if position.ndim != 2 or position.shape[1] != 3:
        raise UserError(source, "nodes", f"have shape {position.shape}, expected (n, 3)")
    bad = np.flatnonzero(~np.isfinite(position).all(axis=1))
    if len(bad):
        raise UserError(
            source,
            "nodes",
            f"{len(bad)} of {len(position)} hold NaN or infinity, the first is node {bad[0]}",
        )


def check_loop(
    loop: IntArray,
    faces: IntArray,
    n: int,
    source: str,
    key: str,
    node: Named = plain_node,
) -> None:
    """Checks that nodes form a closed chain of edges of the mesh.

    Args:
        loop: node indices in order, the first not repeated.
        faces: (F,3) node indices.
        n: number of nodes.
        source: file or name put in front of the message.
        key: key of the loop in the source, for the message.
        node: returns a node's name for messages.

    Raises:
        UserError: an index is out of range or repeated, there are fewer than three, or no edge
            joins two neighbours.
    """
    _check_indices(loop, n, source, key)
    if len(loop) < 3:
        raise UserError(source, key, f"has {len(loop)} nodes, expected at least 3")
    edges = unique_edges(faces).astype(np.int64) @ np.array([n, 1])
    pairs = np.sort(np.stack([loop, np.roll(loop, -1)], axis=1), axis=1).astype(np.int64)
    broken = np.flatnonzero(~np.isin(pairs @ np.array([n, 1]), edges))
    if len(broken):
        at = broken[0]
        raise UserError(
            source,
            key,
            f"is not a closed chain of mesh edges: no edge joins {node(loop[at])} and "
            f"{node(loop[(at + 1) % len(loop)])}",
        )


def face_areas(position: FloatArray, faces: npt.NDArray[np.integer]) -> FloatArray:
    """Returns (F,) areas, m²."""
    a, b, c = (position[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), dtype=np.float64)


def loop_length(position: FloatArray, loop: npt.NDArray[np.integer]) -> float:
    """Returns the length of a closed loop of nodes (a girth), m."""
    points = position[loop]
    return float(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).sum())


def edge_lengths(position: FloatArray, faces: npt.NDArray[np.integer]) -> FloatArray:
    """Returns (E,) lengths of `unique_edges`, m; their mean is the spacing of the mesh."""
    edges = unique_edges(faces)
    chord = position[edges[:, 0]] - position[edges[:, 1]]
    return np.asarray(np.linalg.norm(chord, axis=1), dtype=np.float64)


def _check_loops(loops: dict[str, IntArray], faces: IntArray, n: int, source: str) -> None:
    missing = [name for name in LOOP_NAMES if name not in loops]
    if missing:
        raise UserError(source, "loops", f"{', '.join(missing)} missing, expected {LOOP_NAMES}")
    for name, loop in loops.items():
        check_loop(loop, faces, n, source, f"loops.{name}")


def _check_indices(indices: IntArray | None, n: int, source: str, key: str) -> None:
    if indices is None or len(indices) == 0:
        raise UserError(source, key, "is missing or empty, expected node indices")
    if indices.ndim != 1 or not np.issubdtype(indices.dtype, np.integer):
        raise UserError(source, key, "expected a list of node indices")
    if indices.min() < 0 or indices.max() >= n:
        raise UserError(
            source,
            key,
            f"node indices reach from {indices.min()} to {indices.max()}, expected 0 to {n - 1}",
        )
    if len(np.unique(indices)) < len(indices):
        raise UserError(source, key, "names a node twice, expected each once")
