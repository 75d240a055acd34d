"""Whole sequences: persons stay persons, and a seed gives the same bits again."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from drake_dress.learning.motion.moving_person import MovingPerson
from drake_dress.learning.motion.scenes import make_sequence
from drake_dress.learning.motion.sequence import COUNT, KINDS, PERIOD, Kind, Sequence

FEW = 3


@cache
def made(kind: Kind, number: int, seed: int = 11) -> Sequence:
    return make_sequence(kind, seed, number)


def few(kind: Kind) -> list[Sequence]:
    return [made(kind, n) for n in range(FEW)]


@pytest.mark.parametrize("kind", KINDS)
def test_limbs_keep_their_lengths_and_nobody_leaps(kind: Kind) -> None:
    for s in few(kind):
        assert s.joints.shape == (COUNT, 6, 3)
        for a, b in ((0, 1), (1, 2), (3, 4), (4, 5)):
            length = np.linalg.norm(s.joints[:, a] - s.joints[:, b], axis=-1)
            assert np.ptp(length) < 1e-9
        speed = np.linalg.norm(np.diff(s.joints, axis=0), axis=-1) / PERIOD
        # 2.5 m/s by will, beside a walk of 1.5 m/s
        assert speed.max() < 4.5


@pytest.mark.parametrize("kind", KINDS)
def test_joints_stay_within_their_limits(kind: Kind, monkeypatch: pytest.MonkeyPatch) -> None:
    beyond, seen = [], []

    def looked(mover: MovingPerson) -> None:
        angles = np.array([arm.angles for arm in mover.arms])
        limits = mover.person.limits
        beyond.append(np.maximum(limits[:, 0] - angles, angles - limits[:, 1]).max())
        seen.append(angles)

    trembling = MovingPerson.trembling

    def watched(mover: MovingPerson, time: float, more: np.ndarray | None = None) -> np.ndarray:
        looked(mover)
        return trembling(mover, time, more)

    monkeypatch.setattr(MovingPerson, "trembling", watched)
    for number in range(FEW):
        make_sequence(kind, 11, number)
    assert len(seen) == FEW * COUNT
    assert max(beyond) <= 0.0
    # the coat may not come near one of them
    assert max(np.ptp(seen[n * COUNT : (n + 1) * COUNT], axis=0).max() for n in range(FEW)) > 0.01


def test_a_passive_person_moves_without_intent() -> None:
    assert not any(s.intent.any() for s in few("passive"))
    assert all(np.ptp(s.joints[:, [2, 5]], axis=0).max() > 0.005 for s in few("passive"))


@pytest.mark.parametrize("kind", ["active", "free"])
def test_a_hand_at_rest_does_not_move_by_will(kind: Kind) -> None:
    for s in few(kind):
        speed = np.linalg.norm(np.diff(s.joints[:, [2, 5]], axis=0), axis=-1) / PERIOD
        slow = np.concatenate([speed, speed[-1:]]) < 0.005
        # at rest, as a person with a tremor never is, for half a second
        long = np.array(
            [[slow[max(0, k - 5) : k + 5, i].all() for i in (0, 1)] for k in range(COUNT)]
        )
        assert not s.intent[long].any()


@pytest.mark.parametrize("kind", ["active", "free"])
def test_other_persons_move_by_will_and_rest(kind: Kind) -> None:
    shares = [s.intent.mean() for s in few(kind)]
    assert 0.05 < np.mean(shares) < 0.98


def test_directions_of_sleeves_are_units_and_there_are_none_without_a_garment() -> None:
    for kind in ("passive", "active"):
        for s in few(kind):
            np.testing.assert_allclose(np.linalg.norm(s.sleeves[..., 3:], axis=-1), 1.0)
    for s in few("free"):
        assert np.isnan(s.sleeves).all()
        assert not s.on.any()


def test_an_arm_in_its_sleeve_is_near_it() -> None:
    for kind in ("passive", "active"):
        for s in few(kind):
            for i in (0, 1):
                shoulder, elbow, hand = (s.joints[:, 3 * i + j] for j in range(3))
                center = s.sleeves[:, i, :3]
                off = np.minimum(_away(center, hand, elbow), _away(center, elbow, shoulder))
                # 9 cm, a tremor, and what an arm moves in a tenth of a second
                assert off[s.on[:, i] == 1].max(initial=0.0) < 0.2
                assert not s.on[:, i].any() or np.mean(off[s.on[:, i] == 1] < 0.1) > 0.9


def _away(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    way = b - a
    share = np.clip(((point - a) * way).sum(-1) / (way * way).sum(-1), 0.0, 1.0)
    away: np.ndarray = np.linalg.norm(point - a - share[:, None] * way, axis=-1)
    return away


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_gives_the_same_bits_and_another_number_another_sequence(kind: Kind) -> None:
    again, other = make_sequence(kind, 11, 0), made(kind, 1)
    for name, array in vars(made(kind, 0)).items():
        assert array.tobytes() == getattr(again, name).tobytes()
    assert not np.array_equal(made(kind, 0).joints, other.joints)
    assert not np.array_equal(made(kind, 0).joints, make_sequence(kind, 12, 0).joints)
