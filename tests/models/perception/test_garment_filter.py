from __future__ import annotations

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.material import Material
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.edges import unique_edges
from drake_dress.models.perception.depth_buffer import depth_buffer
from drake_dress.models.perception.garment_filter import (
    FilterSettings,
    GarmentFilter,
    TrackedGarment,
    View,
)
from drake_dress.models.perception.point_cloud import Pinhole

COAT = make_coat(COATS["jacket"], 0.06)
TRACKER = GarmentFilter(COAT, Material(surface_density=0.3, stretch_stiffness=800.0, damping=0.02))
NOBODY = Obstacles.none()
STEPS = 6  # of a prediction
PERIOD = STEPS * FilterSettings().time_step
HELD = COAT.rest_position[TRACKER.held]


def camera(eye: list[float]) -> Pinhole:
    """A camera that looks level at the axis of the coat."""
    ahead = np.array([0.0, 0.0, eye[2]]) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    return Pinhole(
        160, 120, 150.0, np.stack([right, [0.0, 0.0, -1.0], ahead], axis=1), np.array(eye)
    )


HEIGHT = float(COAT.rest_position[:, 2].mean())
CAMERAS = [camera([1.6, 0.5, HEIGHT]), camera([-1.6, -0.5, HEIGHT])]


def views_of(x: FloatArray) -> list[View]:
    views = []
    for each in CAMERAS:
        depth = depth_buffer(each, x, COAT.faces)
        labels = np.isfinite(depth).astype(np.int32)
        views.append(View(each, np.where(labels == 1, depth, 0.0), labels, 1))
    return views


def hanging(wind: float, count: int = 40) -> FloatArray:
    """Where the coat hangs in a wind along x that is a share of its weight."""
    state = TrackedGarment.at_rest(COAT.rest_position)
    force = np.zeros_like(COAT.rest_position)
    force[:, 0] = wind * 9.81 * 0.3 * 2.0 / len(force)
    state = TrackedGarment(state.cloth, force)
    for _ in range(count):
        state = TRACKER.predicted(state, HELD, [NOBODY] * STEPS)
    return state.cloth.x


@pytest.fixture(scope="module")
def still() -> FloatArray:
    return hanging(0.0)


def error(state: TrackedGarment, truth: FloatArray) -> float:
    return float(np.linalg.norm(state.cloth.x - truth, axis=1).mean())


def test_grippers_lead_the_prediction(still: FloatArray) -> None:
    state = TrackedGarment.at_rest(still)
    to = HELD + [0.0, 0.05, 0.1]
    moved = TRACKER.predicted(state, to, [NOBODY] * STEPS)
    np.testing.assert_allclose(moved.cloth.x[TRACKER.held], to, atol=1e-9)
    assert (moved.cloth.x - still)[:, 2].mean() > 0.03
    assert moved.bias is state.bias


def test_what_is_seen_where_it_was_predicted_changes_little(still: FloatArray) -> None:
    state = TRACKER.corrected(TrackedGarment.at_rest(still), views_of(still), PERIOD, NOBODY)
    assert error(state, still) < 2e-3


def test_a_coat_elsewhere_is_found_by_correcting(still: FloatArray) -> None:
    bend = np.clip(HELD[:, 2].mean() - still[:, 2], 0.0, None)[:, None] * [0.12, 0.0, 0.0]
    start = TrackedGarment.at_rest(still + bend)
    state = TRACKER.corrected(start, views_of(still), PERIOD, NOBODY)
    assert error(start, still) > 0.03
    assert error(state, still) < 0.5 * error(start, still)
    np.testing.assert_array_equal(state.cloth.x[TRACKER.held], start.cloth.x[TRACKER.held])


def test_a_force_that_the_simulation_lacks_is_made_up_for(still: FloatArray) -> None:
    truth = hanging(0.25)
    alone = error(TrackedGarment.at_rest(still), truth)
    state = TrackedGarment.at_rest(still)
    for _ in range(25):
        state = TRACKER.predicted(state, HELD, [NOBODY] * STEPS)
        before = error(state, truth)
        state = TRACKER.corrected(state, views_of(truth), PERIOD, NOBODY)
    # what is predicted from one correction to the next stays there, too
    assert before < 0.3 * alone
    assert state.bias[:, 0].sum() > 0.0
    np.testing.assert_array_equal(state.bias[TRACKER.held], 0.0)


def test_without_views_the_estimate_stays_and_the_force_fades(still: FloatArray) -> None:
    bias = np.random.default_rng(0).normal(size=still.shape)
    state = TrackedGarment(TrackedGarment.at_rest(still).cloth, bias)
    after = TRACKER.corrected(state, [], PERIOD, NOBODY)
    np.testing.assert_array_equal(after.cloth.x, still)
    kept = np.exp(-PERIOD / FilterSettings().bias_fading)
    np.testing.assert_allclose(after.bias, kept * bias)


def test_corrections_hardly_stretch_the_coat(still: FloatArray) -> None:
    """What moves nodes alike in the image would tear a simulation that it strains."""
    edges = unique_edges(COAT.faces)

    def lengths(x: FloatArray) -> FloatArray:
        return np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)

    rest = lengths(COAT.rest_position)
    bend = np.clip(HELD[:, 2].mean() - still[:, 2], 0.0, None)[:, None] * [0.12, 0.0, 0.0]
    x = TRACKER.corrected(TrackedGarment.at_rest(still), views_of(still + bend), PERIOD, NOBODY)
    change = lengths(x.cloth.x) - lengths(still)
    assert np.linalg.norm(x.cloth.x - still, axis=1).mean() > 0.01
    assert np.percentile(change / rest, 99) < 0.02
