"""A shell fills the space between its layers, without gaps and without turning inside out."""

import numpy as np
import pytest

from drake_dress.models.garment import COATS, make_coat
from drake_dress.models.garment.shell import Shell, make_shell

THICK = 0.002


def sheet() -> tuple[np.ndarray, np.ndarray]:
    """Returns a wavy sheet (n,3), (F,3)."""
    k = 8
    x, y = np.meshgrid(np.linspace(0.0, 0.3, k), np.linspace(0.0, 0.3, k), indexing="ij")
    position = np.stack([x, y, 0.02 * np.sin(20.0 * x)], axis=-1).reshape(-1, 3)
    i = np.arange(k * k).reshape(k, k)
    corners = [i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]]
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    return position, faces


def volumes(shell: Shell, position: np.ndarray) -> np.ndarray:
    corner = shell.nodes(position)[shell.tetrahedra]
    return np.asarray(np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6.0)


def test_tetrahedra_have_the_volume_of_the_shell() -> None:
    position, faces = sheet()
    shell = make_shell(position, faces, THICK)
    corner = position[faces]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    expected = 0.5 * THICK * np.linalg.norm(area, axis=1).sum()
    # layers of a bent sheet are not quite as far apart as its nodes'
    assert volumes(shell, position).sum() == pytest.approx(expected, rel=0.05)
    np.testing.assert_array_equal(shell.owner, np.arange(len(position)))


def test_neighbours_share_their_sides() -> None:
    """Each side of a tetrahedron is of two of them, or of the shell's surface."""
    position, faces = sheet()
    tetrahedra = make_shell(position, faces, THICK).tetrahedra
    sides = np.concatenate([np.delete(tetrahedra, k, axis=1) for k in range(4)])
    _, owners = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert owners.max() == 2
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, edge_owners = np.unique(np.sort(pairs, axis=1), axis=0, return_counts=True)
    # both layers, and two for each edge of the border
    assert (owners == 1).sum() == 2 * len(faces) + 2 * (edge_owners == 1).sum()


@pytest.mark.parametrize("coat", ["jacket", "overcoat"])
def test_no_tetrahedron_of_a_coat_is_inside_out(coat: str) -> None:
    mesh = make_coat(COATS[coat], 0.03)
    shell = make_shell(mesh.rest_position, mesh.faces, THICK)
    assert (volumes(shell, mesh.rest_position) > 0.0).all()
    np.testing.assert_array_equal(shell.owner[shell.faces], mesh.faces)
    # only where the coat folds back on itself
    assert len(shell.owner) - len(mesh.rest_position) < 0.05 * 3 * len(mesh.faces)
