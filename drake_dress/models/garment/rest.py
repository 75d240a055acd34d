"""The rest shape of a garment's cloth: that of the mesh, or that of its flat pattern.

A mesh comes draped on a body, strained and wrinkled. Where its texture coordinates are the pattern,
the cloth creeps from the mesh into a shape in which every triangle has its size in the pattern, as
sewn patterns do (`files/pattern/worn.py`). What seams keep strained is not in the rest shape. All
later steps, such as bringing the garment to a spacing, see this shape alone.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.flat import FlatShape, check_pattern, flat_shape
from drake_dress.models.garment.settled import (
    MATERIAL,
    NO_GRAVITY,
    NONE_HELD,
    TIME_STEP,
    settled,
)

MESH, UV, AUTO = RESTS = ("mesh", "uv", "auto")
# One solve a step: the cloth creeps on in the next.
_SETTINGS = ImplicitSettings(max_iterations=40, max_passes=1)
_TOLD = 0.01  # median strain from which on a mesh is told to be draped


def at_rest(
    mesh: RawMesh, rest: str, progress: Callable[[float], None] = lambda _share: None
) -> tuple[RawMesh, tuple[str, ...]]:
    """Returns the mesh in its rest shape, and what was done or could be done, a line each.

    Args:
        mesh: one oriented manifold, in m.
        rest: `mesh` for its own shape; `uv` for that of its texture coordinates; `auto` for the
            latter where they are a pattern of the mesh.
        progress: called with the share of the work that is done.

    Raises:
        UserError: `rest` is `uv`, and the texture coordinates are absent or no pattern of the mesh.
    """
    flat = None
    if rest == UV:
        flat = flat_shape(mesh)
        check_pattern(flat, mesh.source)
    elif mesh.uv is not None:
        with suppress(UserError):
            flat = flat_shape(mesh)
            check_pattern(flat, mesh.source)
    is_pattern = flat is not None and flat.is_pattern
    if flat is None or not is_pattern:
        told = "the file has no texture coordinates that are its flat pattern: it rests as it is"
        return mesh, (told,) if rest == AUTO else ()
    pieces = f"its texture coordinates, a pattern of {flat.islands} pieces"
    if rest == MESH:
        told = (
            f"the mesh is draped: {pieces}, differ from it by {flat.told()}; garment.mesh.rest: uv "
            "takes their size"
        )
        return mesh, (told,) if flat.median > _TOLD else ()
    position = _unstrained(mesh, flat, progress)
    left = flat.against(position[mesh.faces])
    told = (
        f"the cloth rests in the size of {pieces}, from which the mesh differs by {flat.told()}; "
        f"seams keep {left.told()}"
    )
    return replace(mesh, position=position), (told,)


def _unstrained(mesh: RawMesh, flat: FlatShape, progress: Callable[[float], None]) -> FloatArray:
    """Returns positions (n,3), m, at which the triangles have their flat size."""
    elements = make_elements(mesh.position, mesh.faces, flat.corners)
    cloth = ImplicitCloth(elements, MATERIAL, TIME_STEP, NONE_HELD, NO_GRAVITY, settings=_SETTINGS)
    return np.asarray(settled(cloth, mesh.position, Obstacles.none(), progress))
