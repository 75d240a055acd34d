"""Loads a user's garment file as a labelled mesh, or says why it cannot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray, IntArray
from drake_dress.models.garment.axes import turned
from drake_dress.models.garment.chosen import Chosen, by_measure, by_name, chosen
from drake_dress.models.garment.files import EXTENSIONS, RawMesh, read_mesh
from drake_dress.models.garment.files.raw import place
from drake_dress.models.garment.front import Opening, front_of
from drake_dress.models.garment.front_edges import front_parted, sewn_edges
from drake_dress.models.garment.label import labelled, with_openings
from drake_dress.models.garment.layers import check_one_layer
from drake_dress.models.garment.life_size import (
    ADULT,
    AUTO,
    JACKET,
    UNITS,
    check_diagonal,
    check_life_size,
    from_adult,
    is_life_size,
    shoulder_width,
    units_that_fit,
)
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.mend import mended
from drake_dress.models.garment.merge import duplicates_merged, seams_sewn
from drake_dress.models.garment.mesh import GarmentMesh, check_loop
from drake_dress.models.garment.mesh_options import FRONTS, MeshOptions
from drake_dress.models.garment.parts import check_one_part
from drake_dress.models.garment.placed_loops import placed_loops
from drake_dress.models.garment.plausible import check_plausible
from drake_dress.models.garment.rest import MESH, at_rest
from drake_dress.models.garment.simplify import to_spacing

__all__ = ["EXTENSIONS", "UNITS", "MeshOptions", "WholeGarment", "load_garment", "read_garment"]

SPACING_RANGE = (0.005, 0.1)  # m

# What is taken of a file, and what is left out.
_Parts = tuple[Sequence[Chosen], Sequence[Chosen]]
# Called with the current task and the fraction of it that is done.
Progress = Callable[[str, float], None]


def _silent(_stage: str, _share: float) -> None:
    pass


@dataclass(frozen=True)
class WholeGarment:
    """A garment at the resolution of its file, checked and with its openings known.

    Attributes:
        source: the file, for messages.
        position: (n,3), m, facing +x, with left at +y and z up.
        faces: (F,3), counter-clockwise seen from outside.
        loops: nodes around each opening of `LOOP_NAMES`.
        grasp: nodes that a gripper holds, for each gripper whose nodes the options name.
        notes: what was mended, a line each.
    """

    source: str
    position: FloatArray
    faces: IntArray
    loops: dict[str, IntArray]
    grasp: dict[str, IntArray]
    notes: tuple[str, ...] = ()

    @property
    def front(self) -> Opening:
        """Where it opens: at the front, at the back, or not (see `front_of`)."""
        return front_of(self.mesh())

    def mesh(self) -> GarmentMesh:
        """Returns the labelled mesh at the resolution of the file."""
        return labelled(self.position, self.faces, self.loops, self.grasp)

    def at_spacing(self, spacing: float, progress: Progress = _silent) -> GarmentMesh:
        """Returns the labelled mesh with a mean edge of about `spacing`, m.

        Raises:
            UserError: the spacing is out of range, or the mesh cannot be remeshed to it.
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
    loops: Mapping[str, Sequence[int] | str] | None = None,
    grasp: Mapping[str, Sequence[int]] | None = None,
    scale: float = 1.0,
    facing: str | None = None,
    take: Sequence[str] = (),
    front: str = FRONTS[0],
    rest: str = MESH,
    progress: Progress = _silent,
) -> GarmentMesh:
    """Returns the garment of an OBJ, PLY, STL or glTF file, in the pose of `GarmentMesh`.

    Args:
        path: file.
        unit: unit of its coordinates, one of `UNITS`, or `auto`.
        spacing: desired mean edge length, m. None keeps the mesh as it is.
        up: axis of the file that points up: `z`, `y` or `x`, with a minus sign for upside down.
        weld: distance across which seams are sewn, m.
        leave_out: names of objects or groups to leave out, sizes such as `<0.05 m`, or places such
            as `near (0.1, 0, 1.2) m`.
        loops: nodes in order around each opening, or a place or plane, by its name; those not given
            are searched for.
        grasp: nodes that the `left` and the `right` gripper hold.
        scale: factor on all coordinates, in addition to the unit.
        facing: axis of the file that the garment faces; None for the usual one: +x with z up, +z
            with y up, +y with x up.
        take: the only objects, groups, sizes or places to take, as in `leave_out`.
        front: `auto`, `open` or `closed`; see `MeshOptions`.
        rest: `mesh`, `uv` or `auto`; see `MeshOptions`.
        progress: function that is called with the current task and the fraction of it that is done.

    Raises:
        UserError: the file, an option or the mesh is unusable; see `read_garment` and
            `WholeGarment.at_spacing`.
    """
    options = MeshOptions(unit, up, weld, leave_out, loops, grasp, scale, facing, take, front, rest)
    whole = read_garment(path, options, progress)
    return whole.mesh() if spacing is None else whole.at_spacing(spacing, progress)


@np.errstate(all="ignore")  # the checks report damaged numbers, not numpy
def read_garment(
    path: str | Path, options: MeshOptions, progress: Progress = _silent
) -> WholeGarment:
    """Returns the garment of an OBJ, PLY, STL or glTF file, checked.

    The sleeves must point sideways in the file. Nodes at the same place are merged, unused nodes
    are dropped, and an inside-out mesh is turned outward. What `mend` can mend is mended.

    Raises:
        UserError: the file, its format or an option is unusable; the mesh is empty, not finite, not
            plausible, in parts, or not manifold in too many places; a loop is absent or not closed;
            an index is wrong. The message is one line and names nodes as the file counts them, from
            0, with lines.
    """
    source = str(path)
    options.check(source)
    progress("reading the garment", 0.0)
    parts = chosen(options.take, "take", source), chosen(options.leave_out, "leave_out", source)
    whole_file = read_mesh(Path(path), lambda share: progress("putting on the pattern", share))
    raw = by_name(whole_file, *parts).scaled(options.scale)
    progress("checking the garment", 0.3)
    if options.unit == AUTO:
        return _in_likely_unit(raw, parts, options, progress)
    whole = _checked(raw, parts, options, progress)
    check_life_size(shoulder_width(whole.position, whole.loops), options.scale, source)
    return whole


def _in_likely_unit(
    raw: RawMesh, parts: _Parts, options: MeshOptions, progress: Progress
) -> WholeGarment:
    """Returns the garment in the unit in which its shoulders are most like an adult's."""
    used = raw.position[np.unique(raw.faces)]
    diagonal = max(float(np.linalg.norm(np.ptp(used, axis=0))), 1e-12)
    found = []
    as_it_is = replace(options, rest=MESH)
    for unit in units_that_fit(diagonal):
        with suppress(UserError):
            whole = _checked(raw, parts, replace(as_it_is, unit=unit), progress)
            width = shoulder_width(whole.position, whole.loops)
            if is_life_size(width):
                found.append((unit, width, whole))
    if not found:
        # as large as a jacket: what is wrong with it besides its size is told
        like = _checked(raw.scaled(JACKET / diagonal), parts, replace(as_it_is, unit="m"), progress)
        width = shoulder_width(like.position, like.loops) * diagonal / JACKET
        scale = f"garment.mesh.scale: {options.scale * ADULT / width:.2g}"
        raise UserError(
            raw.source,
            "unit",
            f"is auto, but in no unit the shoulders are a person's: they are {width:.3g} wide; "
            f"with garment.mesh.unit: m and {scale} they would be {ADULT} m wide",
        )
    unit, width, best = min(found, key=lambda item: from_adult(item[1]))
    if options.rest != MESH:
        best = _checked(raw, parts, replace(options, unit=unit), progress)
    note = f"the unit is {unit}, in which the shoulders are {width:.2f} m wide"
    return replace(best, notes=(note, *best.notes))


def _checked(raw: RawMesh, parts: _Parts, options: MeshOptions, progress: Progress) -> WholeGarment:
    """Returns the garment of a mesh, to which the scale was applied, in the options' unit."""
    source, factor = raw.source, UNITS[options.unit]
    unmerged = raw
    raw = duplicates_merged(raw.scaled(factor))
    # first check what holds in any unit, so that a stray node is not reported as a wrong unit
    check_plausible(raw)
    diagonal = float(np.linalg.norm(np.ptp(raw.position, axis=0))) / factor
    check_diagonal(diagonal, options.unit, options.scale, source)
    raw = seams_sewn(raw, options.weld)
    raw = by_measure(raw, *parts)
    check_one_part(raw)
    raw, notes = mended(raw)
    if notes:
        check_plausible(raw)  # a face with a wrong corner shows once it is cut off
    node, face = raw.node, raw.face
    check_manifold(raw.faces, len(raw.position), source, node, face)
    check_one_layer(raw)
    raw, told = at_rest(
        raw, options.rest, lambda share: progress("bringing the cloth to its flat size", share)
    )
    faces = _outward(raw.position, raw.faces).astype(np.int32)
    given = options.loops or {}
    loops = {
        name: _mapped(raw, nodes, f"loops.{name}")
        for name, nodes in given.items()
        if not isinstance(nodes, str)
    }
    grasp = {
        side: _mapped(raw, nodes, f"grasp.{side}") for side, nodes in (options.grasp or {}).items()
    }
    for name, loop in loops.items():
        check_loop(loop, faces, len(raw.position), source, f"loops.{name}", node)
    progress("looking for the garment's openings", 0.5)
    places = {name: text for name, text in given.items() if isinstance(text, str)}
    position, faces, placed = placed_loops(raw.position, faces, places, source)
    loops = with_openings(position, faces, loops | placed, options.up, options.facing, source)
    position = turned(position, options.up, options.facing)
    whole = WholeGarment(source, position, faces, loops, grasp, (*notes, *told))
    whole = _front_as_asked(whole, sewn_edges(unmerged, raw), options.front, raw)
    whole.mesh().validate(source)
    return whole


def _front_as_asked(
    whole: WholeGarment, sewn: IndexArray, front: str, raw: RawMesh
) -> WholeGarment:
    """Returns the garment with front edges that coincide apart, unless they are to be sewn.

    Args:
        whole: the garment, in which they are sewn.
        sewn: (k,2) edges at which sheets were joined.
        front: as in `MeshOptions`.
        raw: the same nodes in the axes of the file.

    Raises:
        UserError: the front is to be open, and it is closed.
    """
    parted = None if front == "closed" else front_parted(whole.mesh(), sewn)
    if parted is not None:
        ends = [place(raw.position[node]).removeprefix(" at ") for node in parted.line[[0, -1]]]
        note = (
            f"the edges of the {parted.opening} coincide from {ends[0]} to {ends[1]}: they are "
            "kept apart, as of an open garment; garment.mesh.front: closed sews them"
        )
        position = np.concatenate([whole.position, whole.position[parted.copied]])
        whole = replace(whole, position=position, faces=parted.faces, notes=(*whole.notes, note))
    if front == "open" and whole.front == "closed":
        raise UserError(
            whole.source,
            "front",
            "is open, but neck and hem are different openings, and no line of coincident edges "
            "joins them; expected auto or closed",
        )
    return whole


def _outward(position: FloatArray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (position[faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    center = np.average((a + b + c) / 3, axis=0, weights=np.linalg.norm(area, axis=1) + 1e-15)
    if float((area * ((a + b + c) / 3 - center)).sum()) < 0.0:
        return np.ascontiguousarray(faces[:, ::-1])
    return faces


def _mapped(raw: RawMesh, nodes: Sequence[int], key: str) -> IntArray:
    """Returns the mesh nodes that nodes of the file were merged into."""
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
