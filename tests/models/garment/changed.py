"""Garments for tests: a parametric coat that is cut, capped, sewn or bent, and a flat gown."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.edges import border_edges, boundary_loops
from drake_dress.models.garment.mesh import REGION_NAMES, GarmentMesh
from drake_dress.models.rotation import rotation_about

Surface = tuple[FloatArray, IntArray]

JACKET = make_coat(COATS["jacket"], 0.04)


def written(path: Path, surface: Surface, axes: FloatArray | None = None) -> Path:
    """Writes an OBJ file; `axes` (3,3) has forward, left and up as rows."""
    x = surface[0] if axes is None else surface[0] @ axes
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in x.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in surface[1] + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


def of(mesh: GarmentMesh) -> Surface:
    return mesh.rest_position, mesh.faces


def in_sleeve(mesh: GarmentMesh, side: str) -> BoolArray:
    """Returns (F,) which faces are a sleeve's."""
    nodes = mesh.region == REGION_NAMES.index(f"{side}_sleeve")
    return np.asarray(nodes[mesh.faces].any(axis=1))


def without(surface: Surface, faces: BoolArray) -> Surface:
    """Returns the surface without some faces and without the nodes that only they use."""
    kept = surface[1][~faces]
    used, new = np.unique(kept, return_inverse=True)
    return surface[0][used], new.reshape(-1, 3).astype(np.int32)


def capped(surface: Surface, near: FloatArray) -> Surface:
    """Returns the surface with the border that passes nearest to a point closed by a fan."""
    x, faces = surface
    following = dict(border_edges(faces, len(x)).tolist())
    start = min(following, key=lambda node: float(np.linalg.norm(x[node] - near)))
    loop = [start]
    while following[loop[-1]] != start:
        loop.append(following[loop[-1]])
    tip = x[loop].mean(axis=0)
    fan = [[loop[k], loop[k - 1], len(x)] for k in range(len(loop))]
    return np.vstack([x, tip]), np.concatenate([faces, fan]).astype(np.int32)


def center(mesh: GarmentMesh, name: str) -> FloatArray:
    return np.asarray(mesh.rest_position[mesh.loops[name]].mean(axis=0))


def sleeves_turned(mesh: GarmentMesh, angle_deg: float) -> Surface:
    """Returns the coat with its sleeves turned downward about the shoulder tips."""
    x = mesh.rest_position.copy()
    for side, sign in (("left", -1.0), ("right", 1.0)):
        nodes = mesh.region == REGION_NAMES.index(f"{side}_sleeve")
        tip = x[mesh.loops[f"{side}_armhole"][0]]
        x[nodes] = (x[nodes] - tip) @ rotation_about("x", sign * np.deg2rad(angle_deg)).T + tip
    return x, mesh.faces


def zipped(spacing: float = 0.04) -> Surface:
    """Returns a coat whose front edges coincide from the hem to below the neck."""
    mesh = make_coat(CoatParameters(front_opening=0.012), spacing)
    x = mesh.rest_position.copy()
    border = np.unique(border_edges(mesh.faces, len(x)))
    front = border[(np.abs(x[border, 1]) < 0.0065) & (x[border, 0] > 0.05)]
    x[front, 1] = 0.0
    return x, mesh.faces


def pullover(spacing: float = 0.04) -> Surface:
    """Returns `zipped` with one set of nodes at the front."""
    return sewn(zipped(spacing))


def sewn(surface: Surface) -> Surface:
    """Returns a surface whose nodes at the same place are one."""
    x, which = np.unique(surface[0].round(9) + 0.0, axis=0, return_inverse=True)
    return x, which.reshape(-1)[surface[1]].astype(np.int32)


def thick(mesh: GarmentMesh, thickness: float, joined: int = 3) -> Surface:
    """Returns a coat with an inner layer that is joined to it at some of its borders.

    Args:
        mesh: the coat.
        thickness: between the layers, m.
        joined: number of borders at which they are joined, the longest first.
    """
    x, faces, n = mesh.rest_position, mesh.faces, len(mesh.rest_position)
    normal = np.zeros_like(x)
    corner = x[faces]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    for k in range(3):
        np.add.at(normal, faces[:, k], across)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rims = []
    for loop in boundary_loops(faces)[:joined]:
        for a, b in zip(loop, np.roll(loop, -1), strict=True):
            rims += [[b, a, a + n], [b, a + n, b + n]]
    both = [faces, faces[:, ::-1] + n, np.array(rims, dtype=np.int32).reshape(-1, 3)]
    return np.vstack([x, x - thickness * normal]), np.concatenate(both).astype(np.int32)


def panels(surface: Surface, label: np.ndarray, gap: float = 0.0) -> Surface:
    """Returns the surface with own nodes for the faces of each label (F,), moved apart.

    Args:
        surface: the garment.
        label: (F,) panel of each face.
        gap: distance by which each panel is moved away from the middle of the garment, m.
    """
    x, faces = surface
    nodes, kept, count = [], [], 0
    for part in np.unique(label):
        used, new = np.unique(faces[label == part], return_inverse=True)
        away = x[used].mean(axis=0) - x.mean(axis=0)
        nodes.append(x[used] + gap * away / np.linalg.norm(away))
        kept.append(new.reshape(-1, 3) + count)
        count += len(used)
    return np.concatenate(nodes), np.concatenate(kept).astype(np.int32)


def flat_gown(spacing: float = 0.02) -> Surface:
    """Returns a gown that is spread flat, its back open, with sleeves that stand out forward.

    The sleeves are cones that widen smoothly into the flat cloth. It faces +x; z is up.
    """
    sleeve_at, tube, reach, length = np.array([0.2, 0.0]), 0.06, 0.16, 0.22
    y, z = np.meshgrid(
        np.arange(-0.5, 0.501, spacing), np.arange(-0.7, 0.151, spacing), indexing="ij"
    )
    grid = np.stack([y.ravel(), z.ravel()], axis=1)
    grid = grid[~((np.abs(grid[:, 0]) < 0.08) & (grid[:, 1] > 0.1))]  # the neck
    rings = []
    for sign in (1.0, -1.0):
        at = sleeve_at * [sign, 1.0]
        grid = grid[np.linalg.norm(grid - at, axis=1) > reach - 0.4 * spacing]
        for r in np.linspace(0.03, reach - spacing, 14):
            angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
            rings.append(at + r * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    pattern = np.concatenate([grid, *rings])
    faces = Delaunay(pattern).simplices.astype(np.int32)
    middle = pattern[faces].mean(axis=1)
    hole = np.zeros(len(faces), dtype=bool)
    ahead = np.zeros(len(pattern))
    for sign in (1.0, -1.0):
        at = sleeve_at * [sign, 1.0]
        hole |= np.linalg.norm(middle - at, axis=1) < 0.03
        offset = pattern - at
        r = np.linalg.norm(offset, axis=1)
        inside = r < reach
        share = ((r - 0.03) / (reach - 0.03)).clip(0.0, 1.0)
        radius = tube + (reach - tube) * share**4
        pattern = np.where(inside[:, None], at + offset * (radius / r.clip(1e-9))[:, None], pattern)
        ahead[inside] = length * (1.0 - share[inside])
    middle = pattern[faces].mean(axis=1)
    hole |= (np.abs(middle[:, 0]) < 0.08) & (middle[:, 1] > 0.1)
    x = np.column_stack([ahead, pattern])
    a, b, c = (x[faces[:, k], 1:] for k in range(3))
    away = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0.0
    faces[away] = faces[away][:, ::-1]
    return without((x, faces), hole)
