"""A parametric open-front coat.

The left half is a few structured grids that share their border nodes, so that every seam is closed
by construction. The right half is its mirror image. The grids are

    lower    columns around the left half of the chest ellipse × rows from hem to underarm,
    front    from the underarm level up to the shoulder seam and, where the coat has one, the front
             neckline; without one, its inner edge leans toward the neck,
    back     the same behind; it shares the nodes of the shoulder seam with the front,
    sleeve   a tube from the armhole loop (the columns under the arm between front and back,
             and the outer edges of both) to the cuff circle,
    collar   a strip or a hood that stands on the neckline, and strips on the front edges.

The spacing gives the numbers of columns and rows. The sizes are then solved on the polygons, so
that girths are met at any spacing and not only in the limit.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.garment.coat.builder import Builder, mirrored
from drake_dress.models.garment.coat.collars import add_collar
from drake_dress.models.garment.coat.panels import add_body, add_sleeve
from drake_dress.models.garment.coat.parameters import CoatParameters, check
from drake_dress.models.garment.coat.shape import Counts, Shape, count_cells, solve_shape
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths

_FEWEST_HELD = 4  # nodes of a gripper: three may lie on a line, about which the cloth could turn
_FILLS = (1.0, 0.95, 0.9, 0.85, 0.8)  # grid step over spacing, tried in order
_MORE_FILLS = (0.75, 0.7)  # for flared coats, whose columns differ more in width
_LONGEST = 1.6  # longest edge over spacing


def make_coat(
    parameters: CoatParameters,
    spacing: float,
    source: str = "coat",
    like: CoatParameters | None = None,
) -> GarmentMesh:
    """Returns an open-front coat in the canonical rest pose of `GarmentMesh`.

    The mesh is manifold, symmetric about y = 0 (except for the order of nodes), and oriented
    outward. Its boundaries are the two cuffs and the rim: hem, front edges and collar. Armhole and
    cuff loops begin at the shoulder tip and run along the front first; entry k of both is the same
    column of the sleeve.

    Args:
        parameters: measures of the coat.
        spacing: desired mean edge length, m; met to 25 %.
        source: file or name at the beginning of error messages.
        like: measures of another coat. The mesh then has the same nodes and loops as the other
            coat's mesh at this spacing, each at the same place of the pattern, so that nodal
            arrays of both can be compared. Only the other coat meets the spacing. The held nodes
            and the diagonals of the grids follow the coat's own measures.

    Raises:
        UserError: a measure or the spacing is out of range, or measures contradict each other.
    """
    check(parameters, spacing, source)
    if like is None:
        return _at_spacing(parameters, spacing, source)[1]
    check(like, spacing, source)
    counts, _ = _at_spacing(like, spacing, source)
    return _build(parameters, solve_shape(parameters, counts, source), counts, source)


def _at_spacing(p: CoatParameters, spacing: float, source: str) -> tuple[Counts, GarmentMesh]:
    """Returns a coat's mesh, and the numbers of columns and rows that it was built with."""
    draft = solve_shape(p, None, source)
    for fill in _FILLS if p.is_plain else _FILLS + _MORE_FILLS:
        counts = count_cells(p, draft, fill * spacing)
        mesh = _build(p, solve_shape(p, counts, source), counts, source)
        if edge_lengths(mesh.rest_position, mesh.faces).max() <= _LONGEST * spacing:
            break
    return counts, mesh


def _build(p: CoatParameters, shape: Shape, c: Counts, source: str) -> GarmentMesh:
    half = Builder()
    body = add_body(half, p, shape, c)
    body_count = half.count
    armhole = body.armhole(c)
    cuff = add_sleeve(half, p, armhole, c)
    sleeve_end = half.count
    add_collar(half, p, body, c)

    region = np.zeros(half.count, dtype=np.int8)
    region[body_count:sleeve_end] = 1
    region[sleeve_end:] = 3
    hold = shape.seam[0] + p.grasp_fraction * (shape.seam[-1] - shape.seam[0])
    far = np.linalg.norm(half.position - hold, axis=1)
    count = max(_FEWEST_HELD, int(np.count_nonzero(far <= p.grasp_radius)))
    grasp = np.argsort(far, kind="stable")[:count].astype(np.int32)
    if p.grasp_radius == 0.0:
        grasp = body.front[-1, c.front_neck :]
    mesh = mirrored(half, armhole, cuff, grasp, region, source)
    return mesh.opened_at_back() if p.opens == "back" else mesh
