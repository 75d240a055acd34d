"""The nape of a person."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points, body_capsules
from drake_dress.models.human.neck import NAPE_LENGTH, distance_to_nape, find_neck, nape

M = BodyMeasures()


def joints(turn: float) -> np.ndarray:
    c, s = np.cos(turn), np.sin(turn)
    frame = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3)
    return np.vstack([arm_points(M, "standing", s, ArmPose(), frame) for s in ("left", "right")])


@pytest.mark.parametrize("posture", ["standing", "sitting"])
def test_the_neck_is_found_among_all_capsules(posture: str) -> None:
    capsules = [c for c in body_capsules(M, posture) if c.body == "torso"]  # type: ignore[arg-type]
    a, b = (np.array([getattr(c, end) for c in capsules]) for end in ("a_B", "b_B"))
    top = a[:, 2].max() if posture == "sitting" else M.shoulder_height
    height = M.shoulder_height - (0.5 * M.leg_length if posture == "sitting" else 0.0)
    k = find_neck(a, b, np.array([0.0, 0.0, height]))
    assert k is not None
    assert capsules[k].radius == M.neck_radius
    assert top > 0.0


def test_limbs_alone_have_no_neck() -> None:
    q = joints(0.0)
    assert find_neck(q[[0, 1, 3, 4]], q[[1, 2, 4, 5]], 0.5 * (q[0] + q[3])) is None


@given(turn=st.floats(-3.0, 3.0))
def test_it_is_behind_the_neck_and_turns_with_the_person(turn: float) -> None:
    low, high = nape(joints(turn), 0.045, 0.055)
    behind = -np.array([np.cos(turn), np.sin(turn), 0.0])
    np.testing.assert_allclose(low, [0, 0, M.shoulder_height + 0.045] + 0.055 * behind, atol=1e-9)
    np.testing.assert_allclose(high - low, [0.0, 0.0, NAPE_LENGTH], atol=1e-12)


@given(along=st.floats(0.0, 1.0), off=st.floats(0.0, 0.3), above=st.floats(0.0, 0.2))
def test_distance_is_to_the_nearest_point(along: float, off: float, above: float) -> None:
    ends = nape(joints(0.0), 0.045, 0.055)
    beside = (1.0 - along) * ends[0] + along * ends[1] + [-off, 0.0, 0.0]
    assert distance_to_nape(beside, ends) == pytest.approx(off, abs=1e-12)
    assert distance_to_nape(ends[1] + [0, 0, above], ends) == pytest.approx(above, abs=1e-12)
    assert distance_to_nape(ends[0] - [0, 0, above], ends) == pytest.approx(above, abs=1e-12)
