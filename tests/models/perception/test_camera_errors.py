"""Errors of where a camera stands."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.perception.camera_errors import CameraErrors, drawn_pose_error


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.1), st.floats(0.0, 10.0))
def test_a_camera_is_turned_and_moved(seed: int, position: float, rotation_deg: float) -> None:
    errors = CameraErrors(position=position, rotation_deg=rotation_deg)
    turned, moved = drawn_pose_error(errors, np.random.default_rng(seed))
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turned) > 0.0
    assert np.abs(moved).max() <= 8.0 * position
    angle = np.arccos(np.clip(0.5 * (np.trace(turned) - 1.0), -1.0, 1.0))
    assert angle <= np.radians(14.0 * rotation_deg) + 1e-7


def test_errors_have_their_size() -> None:
    errors = CameraErrors(position=0.01, rotation_deg=1.0)
    rng = np.random.default_rng(0)
    drawn = [drawn_pose_error(errors, rng) for _ in range(2000)]
    moved = np.array([m for _, m in drawn])
    np.testing.assert_allclose(moved.std(axis=0), 0.01, rtol=0.06)
    # a small rotation's vector is in its antisymmetric part
    about = np.array([[t[2, 1], t[0, 2], t[1, 0]] for t, _ in drawn])
    np.testing.assert_allclose(np.degrees(about.std(axis=0)), 1.0, rtol=0.06)
