"""A wheelchair fits its person, holds nothing inside of them, and lets no node through its back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.cloth.contact.detection import find_contacts, find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.human.body import ArmPose, BodyMeasures, body_capsules, shoulder_joint
from drake_dress.models.human.shape import CHAIR, capsule_arrays
from drake_dress.models.human.wheelchair import (
    Wheelchair,
    chair_capsules,
    room_of_arms,
    seated_capsules,
)
from drake_dress.models.sides import Side

M = BodyMeasures()
SEAT = M.shoulder_height - 0.5 * M.leg_length - M.torso_length
HELD_OUT: dict[Side, ArmPose] = {
    side: ArmPose(np.deg2rad(30.0), np.deg2rad(46.0), 0.0, np.deg2rad(10.0))
    for side in ("left", "right")
}


def obstacles(chair: Wheelchair, measures: BodyMeasures = M) -> Obstacles:
    return Obstacles.resting(*capsule_arrays(chair_capsules(chair, measures)))


def gap(chair: Wheelchair, *points: list[float]) -> list[float]:
    found: list[float] = find_proximity(np.array(points), obstacles(chair), 0.0).gap.tolist()
    return found


def test_sizes_are_those_that_are_asked_for() -> None:
    chair = Wheelchair(seat_width=0.45, back_height=0.40, armrest_height=0.23, handle_height=0.42)
    a, b, radii = capsule_arrays(chair_capsules(chair, M))
    np.testing.assert_array_equal(radii[:, 0], radii[:, 1])
    radius, lying = radii[:, 0], np.abs(a[:, 1] - b[:, 1]) > 0.2
    top, bottom = np.maximum(a, b)[:, 2] + radius, np.minimum(a, b)[:, 2] - radius
    assert top[lying].max() - SEAT == pytest.approx(0.40)
    assert bottom[lying].min() == pytest.approx(SEAT)
    back = a[lying][0, 0]
    # an armrest's upper side, a push handle's axis and a tyre's outer side; left and right alike
    for side in (1.0, -1.0):
        y = side * (0.225 + 0.025)
        assert gap(chair, [0.0, y, SEAT + 0.23])[0] == pytest.approx(0.0, abs=1e-9)
        handle = [back - 0.05, side * (0.225 - 0.02), SEAT + 0.42]
        assert gap(chair, handle)[0] == pytest.approx(-0.016)
        axle = back + 0.03
        tyre = [axle + 0.28 * np.cos(np.pi / 4), side * (0.225 + 0.07), 0.305 + 0.28 / np.sqrt(2.0)]
        assert gap(chair, tyre)[0] == pytest.approx(-0.025)
    assert top[~lying].max() <= SEAT + 0.42 + 0.016 + 1e-9


@settings(max_examples=25, deadline=None)
@given(
    scale=st.floats(0.8, 1.15),
    hips=st.floats(0.25, 0.5),
    chest=st.floats(0.16, 0.36),
    gap_behind=st.floats(0.0, 0.1),
)
def test_a_chair_of_the_persons_size_touches_the_trunk_and_enters_nobody(
    scale: float, hips: float, chest: float, gap_behind: float
) -> None:
    m = BodyMeasures(
        shoulder_height=1.4 * scale,
        torso_length=0.52 * scale,
        leg_length=0.85 * scale,
        hip_width=hips,
        chest_depth=chest,
    )
    chair = chair_capsules(Wheelchair(back_gap=gap_behind), m)
    back = [c for c in chair if abs(c.a_B[1] - c.b_B[1]) > 0.1]
    trunk = Obstacles.resting(
        *capsule_arrays([c for c in body_capsules(m, "sitting") if c.body == "torso"])
    )
    along = np.linspace(0.0, 1.0, 41)[:, None]
    points = np.concatenate([c.a_B + along * (c.b_B - c.a_B) for c in back])
    room = find_proximity(points, trunk, 0.0).gap - back[0].radius
    assert room.min() == pytest.approx(gap_behind, abs=2e-3)
    # it ends below the shoulders, and a third of the way up from the seat stays free
    assert max(c.a_B[2] for c in back) < shoulder_joint(m, "sitting", "left")[2] - 0.1


def test_both_sides_are_mirror_images() -> None:
    a, b, radius = capsule_arrays(chair_capsules(Wheelchair(handle_height=0.5), M))
    points = np.random.default_rng(0).uniform([-0.6, -0.5, 0.0], [0.4, 0.5, 1.1], (200, 3))
    chair = Obstacles.resting(a, b, radius)
    mirrored = points * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(
        find_proximity(points, chair, 0.0).gap, find_proximity(mirrored, chair, 0.0).gap, atol=1e-12
    )


@given(st.sampled_from(["left", "right", "none"]))
def test_an_armrest_that_is_taken_away_leaves_the_rest(armrests: str) -> None:
    both, some = Wheelchair(), Wheelchair(armrests=armrests)
    kept = {"left": [1.0], "right": [-1.0], "none": []}[armrests]
    y = 0.5 * (M.hip_width + 0.05) + 0.025
    for side in (1.0, -1.0):
        inside = [0.1, side * y, SEAT + 0.23 * M.torso_length / 0.60 - 0.025]
        assert gap(both, inside)[0] == pytest.approx(-0.025)
        assert (gap(some, inside)[0] < 0.0) == (side in kept)
    assert len(chair_capsules(both, M)) - len(chair_capsules(some, M)) == 2 * (2 - len(kept))


@settings(max_examples=30, deadline=None)
@given(
    y=st.floats(-0.16, 0.16),
    height=st.floats(0.02, 0.32),
    rise=st.floats(-0.05, 0.05),
)
def test_no_node_goes_through_the_back(y: float, height: float, rise: float) -> None:
    chair = obstacles(Wheelchair())
    x, motion = np.array([[-0.30, y, SEAT + height]]), np.array([[0.25, 0.0, rise]])
    # `height` is where the path goes through the middle of the back: below the back it is free
    x[0, 2] -= rise * (chair.a[0, 0] - x[0, 0]) / motion[0, 0]
    found = find_contacts(x, motion, chair, 0.004, 0.02, np.zeros(1, dtype=bool))
    assert len(found.nodes) == 1


def test_arms_keep_their_distance_from_it() -> None:
    room = room_of_arms(Wheelchair(), M, HELD_OUT)
    assert 0.02 < room["left"] == pytest.approx(room["right"])
    hanging = ArmPose(abduction=np.deg2rad(12.0))
    room = room_of_arms(Wheelchair(), M, {"left": hanging, "right": HELD_OUT["right"]})
    assert room["left"] < 0.0 < room["right"]
    # without armrests, an arm that hangs down meets the wheel only
    bare = Wheelchair(armrests="none", wheel_diameter=0.5)
    assert room_of_arms(bare, M, {"left": hanging, "right": hanging})["left"] > room["left"]


def test_its_capsules_go_before_the_arms() -> None:
    body = capsule_arrays(body_capsules(M, "sitting"))
    both = seated_capsules(M, "sitting", Wheelchair())
    of_chair = [k for k, c in enumerate(both) if c.part == CHAIR]
    assert of_chair == list(range(of_chair[0], len(both) - 6))
    assert all(both[k].body == "torso" for k in of_chair)
    rest = [c for c in both if c.part != CHAIR]
    alone = seated_capsules(M, "sitting", None)
    for same in (capsule_arrays(rest), capsule_arrays(alone)):
        for expected, found in zip(body, same, strict=True):
            np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"armrests": "up"}, "armrests"),
        ({"seat_width": 0.0}, "seat_width"),
        ({"back_height": float("nan")}, "back_height"),
        ({"handle_length": -0.1}, "handle_length"),
        ({"wheel_diameter": True}, "wheel_diameter"),
    ],
)
def test_sizes_that_no_chair_has_are_refused(values: dict[str, object], key: str) -> None:
    with pytest.raises(UserError) as told:
        Wheelchair(**values)  # type: ignore[arg-type]
    assert told.value.key == key


def test_a_chair_that_does_not_fit_is_refused() -> None:
    with pytest.raises(UserError, match="hips"):
        chair_capsules(Wheelchair(seat_width=0.3), M)
    with pytest.raises(UserError, match="back_height"):
        chair_capsules(Wheelchair(back_height=0.03), M)
