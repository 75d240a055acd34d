"""Options for reading a garment file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import AXES, facings
from drake_dress.models.garment.life_size import AUTO, UNITS
from drake_dress.models.garment.mesh import LOOP_NAMES
from drake_dress.models.garment.rest import MESH, RESTS
from drake_dress.models.sides import SIDES

WELD_RANGE = (0.0, 0.02)  # m
SCALE_RANGE = (1e-4, 1e4)  # files from a ten-thousandth of life size to 10,000 times life size
FRONTS = ("auto", "open", "closed")


@dataclass(frozen=True)
class MeshOptions:
    """Options for reading a garment file.

    Attributes:
        unit: unit of its coordinates, one of `UNITS`; or `auto`, which means the one in which the
            shoulders are most like an adult's.
        up: axis of the file that points up.
        facing: axis of the file that the garment faces; None for the usual one, which is +x with
            z up, +z with y up, and +y with x up.
        weld: distance across which edges of seams are joined, m; 0 joins only coincident nodes.
        leave_out: names of objects or groups, sizes such as `<0.05 m` of connected parts, or places
            such as `near (0.1, 0, 1.2) m`; see `chosen`.
        take: the same; what is not taken is left out. Empty for all.
        loops: nodes of the file, counted from 0, in order around each opening of `LOOP_NAMES`;
            those not named are searched for (see `openings`). In an STL, which lists a node once
            per triangle, any of the copies may be named. Or a place, such as
            `near (0.5, 0, 1.2) m`, or a plane; see `placed_loops`.
        grasp: nodes of the file that the `left` and `right` gripper hold; by default the ten
            nodes nearest to a point 3.5 cm inward of the armhole's highest node.
        scale: factor on all coordinates, in addition to the unit.
        front: what to do with front edges that coincide from neck to hem: `open` and `auto` keep
            them apart, `closed` sews them. With `open` the garment must be open.
        rest: rest shape of the cloth: `mesh`, that of the file; `uv`, the size that it has in the
            texture coordinates; `auto`, the latter where they are a flat pattern of the mesh.
    """

    unit: str = "m"
    up: str = "z"
    weld: float = 0.0
    leave_out: Sequence[str] = ()
    loops: Mapping[str, Sequence[int] | str] | None = None
    grasp: Mapping[str, Sequence[int]] | None = None
    scale: float = 1.0
    facing: str | None = None
    take: Sequence[str] = ()
    front: str = FRONTS[0]
    rest: str = MESH

    def check(self, source: str) -> None:
        """Raises UserError if an option is unknown or out of range."""
        for key, word, known in (
            ("unit", self.unit, (*UNITS, AUTO)),
            ("up", self.up, AXES),
            ("front", self.front, FRONTS),
            ("rest", self.rest, RESTS),
        ):
            if word not in known:
                raise UserError(source, key, f"is {word!r}, expected one of {', '.join(known)}")
        if self.facing is not None and self.facing not in facings(self.up):
            expected = ", ".join(facings(self.up))
            raise UserError(
                source,
                "facing",
                f"is {self.facing!r}, expected one of {expected} with {self.up} up",
            )
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
