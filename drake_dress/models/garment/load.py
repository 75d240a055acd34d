"""Loads a user's own garment: a file of triangles becomes a labelled mesh, or a reason why not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.axes import AXES, turned
from drake_dress.models.garment.files import EXTENSIONS, RawMesh, read_mesh
from drake_dress.models.garment.label import labelled, with_openings
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.merge import duplicates_merged, seams_sewn
from drake_dress.models.garment.mesh import LOOP_NAMES, GarmentMesh, check_loop
from drake_dress.models.garment.parts import (
    check_one_part,
    sizes_of,
    without_named,
    without_small,
)
from drake_dress.models.garment.plausible import check_plausible
from drake_dress.models.garment.simplify import to_spacing
from drake_dress.models.sides import SIDES

__all__ = ["EXTENSIONS", "UNITS", "MeshOptions", "WholeGarment", "load_garment", "read_garment"]

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
DIAGONAL_RANGE = (0.5, 3.0)  # of a garment's bounding box, m
SPACING_RANGE = (0.005, 0.1)  # m
WELD_RANGE = (0.0, 0.02)  # m
SCALE_RANGE = (1e-4, 1e4)  # from tenths of a millimetre to tens of metres of life size

# Is told what is being done, and which share of it is.
Progress = Callable[[str, float], None]


def _silent(_stage: str, _share: float) -> None:
    pass


@dataclass(frozen=True)
class MeshOptions:
    """How a file is to be read.

    Attributes:
        unit: of its coordinates, `m`, `cm` or `mm`.
        up: axis of the file that points up; see `axes.AXES` for where the garment faces then.
        weld: distance across which edges of seams are joined, m; 0 joins equal nodes alone.
        leave_out: names of objects or groups, or sizes such as `<0.05 m` of connected parts.
        loops: nodes of the file, counted from 0, in order around each opening of `LOOP_NAMES`;
            those not named are looked for (see `openings`). In an STL, which lists a node once
            per triangle, any of the copies may be named.
        grasp: nodes of the file that the `left` and `right` gripper hold; by default the ten
            nodes nearest to a point 3.5 cm inward of the armhole's highest node.
        scale: of all coordinates, beside the unit.
    """

    unit: str = "m"
    up: str = "z"
    weld: float = 0.0
    leave_out: Sequence[str] = ()
    loops: Mapping[str, Sequence[int]] | None = None
    grasp: Mapping[str, Sequence[int]] | None = None
    scale: float = 1.0

    def check(self, source: str) -> None:
        """Raises UserError if an option is unknown or out of range."""
        for key, word, known in (("unit", self.unit, UNITS), ("up", self.up, AXES)):
            if word not in known:
                raise UserError(source, key, f"is {word!r}, expected one of {', '.join(known)}")
        low, high = WELD_RANGE
        if not low <= self.weld <= high:
            raise UserError(source, "weld", f"is {self.weld} m, expected {low:g} to {high} m")
        low, high = SCALE_RANGE
        if not low <= self.scale <= high:
            raise UserError(source, "scale", f"is {self.scale}, expected {low:g} to {high:g}")
        for key, given, allowed in (
            ("loops", self.loops, LOOP_NAMES),
            ("grasp", self.grasp, SIDES),
        ):
            for name in given or {}:
                if name not in allowed:
                    raise UserError(
                        source, f"{key}.{name}", f"unknown, expected {', '.join(allowed)}"
                    )


@dataclass(frozen=True)
class WholeGarment:
    """A garment as its file has it: sound, and with its openings known.

    Attributes:
        source: the file, for messages.
        position: (n,3), m, facing +x, the left at +y, z up.
        faces: (F,3), counter-clockwise seen from outside.
        loops: nodes around each opening of `LOOP_NAMES`.
        grasp: nodes of those grippers whose nodes are named.
    """

    source: str
    position: FloatArray
    faces: IntArray
    loops: dict[str, IntArray]
    grasp: dict[str, IntArray]

    def mesh(self) -> GarmentMesh:
        """Returns the labelled mesh as fine as the file has it."""
        return labelled(self.position, self.faces, self.loops, self.grasp)

    def at_spacing(self, spacing: float, progress: Progress = _silent) -> GarmentMesh:
        """Returns the labelled mesh with a mean edge of about `spacing`, m.

        Raises:
            UserError: the spacing is out of range, or the mesh cannot be brought to it.
        """
        low, high = SPACING_RANGE
        if not low <= spacing <= high:
            raise UserError(self.source, "spacing", f"is {spacing} m, expected {low} to {high} m")
        names = list(self.loops)
        try:
            position, faces, chains, became = to_spacing(
                self.position,
                self.faces,
                [self.loops[name] for name in names],
                spacing,
                lambda share: progress("bringing the garment to its spacing", share),
            )
            loops = dict(zip(names, chains, strict=True))
            grasp = {side: np.unique(became[nodes]) for side, nodes in self.grasp.items()}
            check_manifold(faces, len(position))
            mesh = labelled(position, faces, loops, grasp)
            mesh.validate()
        except UserError as error:
            raise UserError(
                self.source, "spacing", f"is {spacing} m, at which {error.message}"
            ) from error
        return mesh


def load_garment(
    path: str | Path,
    *,
    unit: str,
    spacing: float | None = None,
    up: str = "z",
    weld: float = 0.0,
    leave_out: Sequence[str] = (),
    loops: Mapping[str, Sequence[int]] | None = None,
    grasp: Mapping[str, Sequence[int]] | None = None,
    scale: float = 1.0,
    progress: Progress = _silent,
) -> GarmentMesh:
    """Returns the garment of an OBJ, PLY or STL file, in the pose of `GarmentMesh`.

    Args:
        path: file.
        unit: unit of its coordinates, `m`, `cm` or `mm`.
        spacing: desired mean edge length, m. None keeps the mesh as it is.
        up: axis of the file that points up: `z`, `y` or `x`, with a minus sign for upside down.
        weld: distance across which seams are sewn, m.
        leave_out: names of objects or groups to leave out, or sizes such as `<0.05 m`.
        loops: nodes in order around each opening, by its name; those not given are searched for.
        grasp: nodes that the `left` and the `right` gripper hold.
        scale: factor on all coordinates, in addition to the unit.
        progress: function that is called with the present task and the share of it that is done.

    Raises:
        UserError: the file, an option or the mesh is unusable; see `read_garment` and
            `WholeGarment.at_spacing`.
    """
    options = MeshOptions(unit, up, weld, leave_out, loops, grasp, scale)
    whole = read_garment(path, options, progress)
    return whole.mesh() if spacing is None else whole.at_spacing(spacing, progress)


@np.errstate(all="ignore")  # damaged numbers are told by the checks, not by numpy
def read_garment(
    path: str | Path, options: MeshOptions, progress: Progress = _silent
) -> WholeGarment:
    """Returns the garment of an OBJ, PLY or STL file, checked.

    The file shows the garment with its sleeves sideways. Nodes at the same place are merged, nodes
    of no face dropped, and faces turned outward if all point inward.

    Raises:
        UserError: in one line what cannot be used: the file, its format or an option, a mesh that
            is empty, not finite, not plausible, not manifold or in parts, loops that are absent or
            not closed, wrong indices. Nodes are named as the file counts them, from 0, with lines.
    """
    source = str(path)
    options.check(source)
    progress("reading the garment", 0.0)
    raw = without_named(read_mesh(Path(path)), options.leave_out)
    progress("checking the garment", 0.3)
    raw = duplicates_merged(raw.scaled(UNITS[options.unit] * options.scale))
    # first what holds in any unit, so that a wild node is not taken for a wrong unit
    check_plausible(raw)
    _check_size(raw, options.unit)
    raw = seams_sewn(raw, options.weld)
    for size in sizes_of(options.leave_out, source):
        raw = without_small(raw, size)
    check_one_part(raw)
    node, face = raw.node, raw.face
    check_manifold(raw.faces, len(raw.position), source, node, face)
    faces = _outward(raw.position, raw.faces).astype(np.int32)

    loops = {
        name: _mapped(raw, nodes, f"loops.{name}") for name, nodes in (options.loops or {}).items()
    }
    grasp = {
        side: _mapped(raw, nodes, f"grasp.{side}") for side, nodes in (options.grasp or {}).items()
    }
    for name, loop in loops.items():
        check_loop(loop, faces, len(raw.position), source, f"loops.{name}", node)
    progress("looking for the garment's openings", 0.5)
    loops = with_openings(raw.position, faces, loops, options.up, source)
    whole = WholeGarment(source, turned(raw.position, options.up), faces, loops, grasp)
    whole.mesh().validate(source)
    return whole


def _check_size(raw: RawMesh, unit: str) -> None:
    diagonal = float(np.linalg.norm(np.ptp(raw.position, axis=0)))
    low, high = DIAGONAL_RANGE
    if not low <= diagonal <= high:
        better = [
            name for name, factor in UNITS.items() if low <= diagonal * factor / UNITS[unit] <= high
        ]
        hint = f"with {better[0]} it would fit" if better else "no unit fits, a scale might"
        raise UserError(
            raw.source,
            "unit",
            f"in {unit} the garment's bounding box has a diagonal of {diagonal:.3g} m, expected "
            f"{low} to {high} m (wrong unit?); {hint}",
        )


def _outward(position: FloatArray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (position[faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    center = np.average((a + b + c) / 3, axis=0, weights=np.linalg.norm(area, axis=1) + 1e-15)
    if float((area * ((a + b + c) / 3 - center)).sum()) < 0.0:
        return np.ascontiguousarray(faces[:, ::-1])
    return faces


def _mapped(raw: RawMesh, nodes: Sequence[int], key: str) -> IntArray:
    """Returns the nodes that nodes of the file have become."""
    given = np.asarray(nodes)
    if given.ndim != 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise UserError(raw.source, key, "expected a list of node indices (whole numbers)")
    if given.min() < 0 or given.max() >= len(raw.became):
        raise UserError(
            raw.source,
            key,
            f"node indices reach from {given.min()} to {given.max()}, expected 0 to "
            f"{len(raw.became) - 1}",
        )
    mapped = raw.became[given]
    if mapped.min() < 0:
        raise UserError(raw.source, key, f"node {given[np.argmin(mapped)]} belongs to no face")
    return mapped.astype(np.int32)
