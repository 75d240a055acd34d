"""Views that arrive late change the estimate as if they had come in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.perception.delayed_tracking import (
    DelayedTracker,
    Exposure,
    Motion,
    Tracking,
)
from drake_dress.models.sides import SIDES
from tests.models.perception.hanging import (
    COAT,
    GRIPPERS,
    OFFSETS,
    STEP,
    motion,
    tracker_of_coat,
    view_of,
)


@pytest.fixture(scope="module")
def tracker() -> DelayedTracker:
    return tracker_of_coat(memory=0.3)


@pytest.fixture(scope="module")
def start(tracker: DelayedTracker) -> Tracking:
    return tracker.begun(COAT.rest_position, motion(0))


def motions(first: int, last: int) -> list[Motion]:
    return [motion(tick) for tick in range(first, last + 1)]


def nodes(tracking: Tracking) -> FloatArray:
    return tracking.now.garment.cloth.x


def test_the_coat_hangs_at_rest_at_the_start(tracker: DelayedTracker, start: Tracking) -> None:
    after = tracker.advanced(start, [replace(motion(0), time=k * STEP) for k in range(1, 7)])
    assert np.linalg.norm(nodes(after) - nodes(start), axis=1).max() < 0.02
    of = [i for i, side in enumerate(SIDES) for _ in COAT.grasp[side]]
    np.testing.assert_allclose(nodes(start)[COAT.held], GRIPPERS[of] + OFFSETS, atol=1e-9)


def test_late_views_do_what_they_would_have_done_in_time(
    tracker: DelayedTracker, start: Tracking
) -> None:
    moved = nodes(start) + [0.0, 0.0, -0.03]
    seen = [Exposure(2 * STEP, (view_of(moved),))]
    in_time = tracker.seen(tracker.advanced(start, motions(1, 2)), seen)
    in_time = tracker.advanced(in_time, motions(3, 5))
    late = tracker.seen(tracker.advanced(start, motions(1, 5)), seen)
    np.testing.assert_array_equal(nodes(late), nodes(in_time))
    assert late.corrected == 2 * STEP
    without = tracker.advanced(start, motions(1, 5))
    assert np.abs(nodes(late) - nodes(without)).max() > 1e-3


def test_views_out_of_order_or_too_old_are_left_out(
    tracker: DelayedTracker, start: Tracking
) -> None:
    view = view_of(nodes(start))
    state = tracker.advanced(start, motions(1, 15))
    assert tracker.seen(state, [Exposure(0.0, (view,))]) is state  # older than the memory
    state = tracker.seen(state, [Exposure(14 * STEP, (view,))])
    assert tracker.seen(state, [Exposure(13 * STEP, (view,))]) is state


def test_only_what_may_still_be_corrected_is_kept(tracker: DelayedTracker, start: Tracking) -> None:
    state = tracker.advanced(start, motions(1, 40))
    times = [moment.motion.time for moment in state.moments]
    np.testing.assert_allclose(times, STEP * np.arange(31, 41))


def test_an_open_gripper_lets_the_coat_fall(tracker: DelayedTracker, start: Tracking) -> None:
    falling = [motion(tick, are_open=True) for tick in range(1, 11)]
    state = tracker.advanced(start, falling)
    down = (nodes(start) - nodes(state))[:, 2].mean()
    # free fall of 10 steps, to the damping of the scheme
    assert down == pytest.approx(0.5 * 9.81 * (10 * STEP) ** 2, rel=0.15)
