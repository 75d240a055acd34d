"""Drawn persons and coats fit together."""

import numpy as np

from drake_dress.learning.motion.bodies import draw_person, draw_reach


def test_a_comfortable_pose_is_within_the_limits() -> None:
    postures = set()
    for seed in range(50):
        person = draw_person(np.random.default_rng(seed))
        low, high = person.limits[:, 0], person.limits[:, 1]
        assert (low < high).all()
        assert (low <= person.comfort).all()
        assert (person.comfort <= high).all()
        assert (person.effort > 0.0).all()
        postures.add(person.posture)
    assert postures == {"standing", "sitting"}


def test_persons_differ_in_size_like_adults() -> None:
    lengths = [draw_person(np.random.default_rng(s)).arms[0].length for s in range(50)]
    assert 0.38 < min(lengths) < 0.55
    assert 0.65 < max(lengths) < 0.85


def test_the_same_draws_give_the_same_person_and_coat() -> None:
    one, two = (draw_person(np.random.default_rng(7)) for _ in range(2))
    assert one.measures == two.measures
    np.testing.assert_array_equal(one.comfort, two.comfort)
    assert draw_reach(np.random.default_rng(7)) == draw_reach(np.random.default_rng(7))


def test_coats_differ_and_their_distances_are_those_of_coats() -> None:
    reaches = [draw_reach(np.random.default_rng(s)) for s in range(4)]
    assert len({r.between_sleeves for r in reaches}) == 4
    for r in reaches:
        assert 0.3 < r.between_sleeves < 1.0
        assert max(r.to_near_gripper) < min(r.to_far_gripper)
