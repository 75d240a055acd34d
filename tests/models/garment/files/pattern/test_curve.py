"""Edges have the length and shape of their curves."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.models.garment.files.pattern.curve import Curve, curve_of

START, END = np.array([0.0, 0.0]), np.array([2.0, 0.0])


def made(curvature: object, absolute: float | None = None) -> Curve:
    return curve_of(START, END, curvature, absolute, 1.0, ("a", "b"))


def test_a_line_is_sampled_evenly() -> None:
    np.testing.assert_allclose(made(None).sampled(4)[:, 0], [0.0, 0.5, 1.0, 1.5, 2.0])


def test_samples_lie_at_equal_arc_lengths_of_every_kind() -> None:
    for curvature in (
        [0.2, 0.6],
        {"type": "cubic", "params": [[0.0, 1.0], [1.0, -1.0]]},
        {"type": "circle", "params": [1.1, 1, 1]},
    ):
        curve = made(curvature)
        points = curve.sampled(200)
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        assert steps.std() < 0.01 * steps.mean()
        np.testing.assert_allclose(points[[0, -1]], [START, END], atol=1e-12)
        assert steps.sum() == pytest.approx(curve.length, rel=1e-3)


def test_a_quadratic_curve_s_middle_is_halfway_to_its_control_point() -> None:
    # symmetric control point: along half the edge, and to the left of it by half its length
    middle = made([0.5, 0.5]).sampled(2)[1]
    np.testing.assert_allclose(middle, [1.0, 0.5], atol=1e-4)
    same = made({"type": "quadratic", "params": [[1.0, 1.0]]}, absolute=1.0)
    np.testing.assert_allclose(same.sampled(2)[1], middle, atol=1e-4)


def test_a_cubic_curve_s_middle_is_the_weighted_mean_of_its_control_points() -> None:
    middle = made({"type": "cubic", "params": [[0.0, 0.5], [1.0, 0.5]]}).sampled(2)[1]
    np.testing.assert_allclose(middle, [1.0, 0.75], atol=1e-4)


@pytest.mark.parametrize("large", [0, 1])
@pytest.mark.parametrize("right", [0, 1])
def test_arcs_are_of_their_circle_and_on_the_side_that_their_flags_say(
    large: int, right: int
) -> None:
    radius = 1.25
    curve = made({"type": "circle", "params": [radius, large, right]})
    half = np.arcsin(1.0 / radius)
    angle = 2.0 * np.pi - 2.0 * half if large else 2.0 * half
    assert curve.length == pytest.approx(radius * angle, rel=1e-4)
    # counter-clockwise from left to right along x is below the chord
    assert np.sign(curve.sampled(2)[1][1]) == (-1.0 if right else 1.0)
