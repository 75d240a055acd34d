"""The Panda's links in pictures: closed solids that are where the arm's capsules are."""

from __future__ import annotations

import numpy as np
import trimesh

from drake_dress.models.arm.description import link_meshes
from drake_dress.models.arm.panda import SHAPE, STAND_RADIUS, panda
from drake_dress.models.arm.solids import joined, panda_solids, stand

FROM_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
Q = np.array([0.3, -0.6, 0.2, -1.9, 0.4, 1.7, 0.6])


def test_each_link_lies_within_its_capsules() -> None:
    """The capsules hold the collision meshes of links and hand, the fingers aside."""
    links = panda(np.eye(4)).links(Q)
    placed = SHAPE.placed(links)
    for k, solid in enumerate(panda_solids()):
        points = solid.vertices @ links[k, :3, :3].T + links[k, :3, 3]
        mine = SHAPE.link == k
        a, b = placed.first[mine], placed.second[mine]
        along = np.einsum("pca,ca->pc", points[:, None] - a, b - a)
        along = np.clip(along / np.einsum("ca,ca->c", b - a, b - a), 0.0, 1.0)
        distance = np.linalg.norm(points[:, None] - a - along[..., None] * (b - a), axis=2)
        outside = (distance - placed.radius[mine]).min(axis=1)
        # the fingers reach beyond the hand
        assert np.quantile(outside, 0.8) < 1e-3
        assert outside.max() < (0.08 if k == 7 else 1e-3)


def test_fingertips_are_at_the_tool() -> None:
    links = panda(np.eye(4)).links(Q)
    hand = panda_solids()[-1].vertices @ links[7, :3, :3].T + links[7, :3, 3]
    tool = links[-1]
    local = (hand - tool[:3, 3]) @ tool[:3, :3]
    tips = local[local[:, 2] > -0.02]
    assert len(tips) > 8
    # two fingers, a little open, about the tool's point
    assert np.abs(tips).max() < 0.03
    assert abs(tips[:, 1].mean()) < 2e-3


def test_normals_point_outward() -> None:
    for solid in panda_solids():
        np.testing.assert_allclose(np.linalg.norm(solid.normals, axis=1), 1.0, atol=1e-6)
        mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
        along = np.einsum("fa,fca->fc", mesh.face_normals, solid.normals[solid.faces])
        assert along.min() > 0.3
        assert mesh.volume > 0.0


def test_real_meshes_are_about_the_same_size() -> None:
    for files, solid in zip(link_meshes(), panda_solids(), strict=True):
        points = []
        for path, X in files:
            scene = trimesh.load_scene(path)
            scene.apply_transform(
                np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
            )
            vertices = np.asarray(scene.to_mesh().vertices)
            points.append(vertices @ X[:3, :3].T + X[:3, 3])
        real = np.concatenate(points)
        np.testing.assert_allclose(real.min(axis=0), solid.vertices.min(axis=0), atol=0.02)
        np.testing.assert_allclose(real.max(axis=0), solid.vertices.max(axis=0), atol=0.02)


def test_a_stand_reaches_from_the_floor_to_the_base() -> None:
    column = stand(0.9)
    low, high = column.vertices.min(axis=0), column.vertices.max(axis=0)
    np.testing.assert_allclose([low[2], high[2]], [-0.9, 0.0], atol=1e-9)
    np.testing.assert_allclose(high[:2], STAND_RADIUS, rtol=0.01)
    base = panda_solids()[0]
    both = joined(base, column)
    volumes = [
        trimesh.Trimesh(s.vertices, s.faces, process=False).volume for s in (base, column, both)
    ]
    np.testing.assert_allclose(volumes[2], volumes[0] + volumes[1], rtol=1e-9)
