"""Pictures show garment and person in their colours, at their places."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.report.stills import CameraPose, Surface, node_normals, render_still
from tests.models.human.skin.bodies import WOMAN, skin_of
from tests.report import synthetic


def _picture(offset: float, taper: float = 1.0) -> np.ndarray:
    garment = synthetic.coat(0.05)
    first, second, radius = synthetic.capsules(synthetic.dressed_joints(garment))
    position = garment.rest_position + [0.0, offset, synthetic.SHOULDER_HEIGHT]
    return render_still(
        garment.faces,
        position,
        (first, second, np.stack([radius, taper * radius], axis=1)),
        grippers=np.array([[0.0, 0.3, 1.5]]),
        camera=CameraPose((2.8, 0.4, 1.5), (0.0, 0.0, 1.1)),
        size=(320, 240),
    ).astype(float)


def test_coat_is_where_it_is() -> None:
    left, right = _picture(0.4), _picture(-0.4)

    def middle(picture: np.ndarray) -> float:
        blue = picture[:, :, 2] > picture[:, :, 0] + 60.0
        assert blue.mean() > 0.03
        return float(np.nonzero(blue)[1].mean())

    # seen from the front, the person's left is the picture's right
    assert middle(left) > middle(right) + 40.0


def test_person_is_skin_coloured_and_background_light() -> None:
    picture = _picture(0.0)
    skin = (picture[:, :, 0] > picture[:, :, 2] + 40.0) & (picture[:, :, 0] > 120.0)
    assert skin.mean() > 0.005
    assert picture[:20].mean() > 220.0


def test_limbs_that_grow_toward_their_ends_show_more_skin() -> None:
    def skin(picture: np.ndarray) -> float:
        there = (picture[:, :, 0] > picture[:, :, 2] + 40.0) & (picture[:, :, 0] > 120.0)
        return float(there.mean())

    assert skin(_picture(0.0, 2.0)) > 1.2 * skin(_picture(0.0))


def test_a_skin_is_shown_in_place_of_limbs() -> None:
    garment = synthetic.coat(0.06)
    skin = skin_of(WOMAN)
    picture = render_still(
        garment.faces,
        garment.rest_position + [-9.0, 0.0, 0.0],
        Surface(skin.vertices, skin.faces.astype(np.int32)),
        grippers=np.zeros((0, 3)),
        camera=CameraPose((4.0, 0.0, 1.0), (0.0, 0.0, 0.85)),
        size=(240, 320),
    ).astype(float)
    there = (picture[:, :, 0] > picture[:, :, 2] + 30.0) & (picture[:, :, 0] > 100.0)
    rows = np.nonzero(there.any(axis=1))[0]
    # 1.63 m of the 2.47 m that the picture shows at 4 m
    assert (rows[-1] - rows[0]) / 320 == pytest.approx(1.63 / 2.47, abs=0.05)
    # the soles are on the floor, whose disk is all around them
    assert not there[rows[-1] + 3 :].any()


def test_normals_of_a_flat_sheet_are_its_normal() -> None:
    x = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    np.testing.assert_allclose(node_normals(faces, x), np.tile([0.0, 0.0, 1.0], (4, 1)))
