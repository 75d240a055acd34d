"""Windows of sequences: past and future are those of the sequence, and changed as is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.learning.motion.sequence import PERIOD as SAMPLED
from drake_dress.learning.motion.windows import Augmentation, Batch, WindowSource
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.tokens import SLEEVE_COLUMNS, Windows, arm_tokens
from tests.learning.made import Data, carried, made
from tests.models.human.learned.drawn import lengths

STRIDE = round(PERIOD / SAMPLED)
NOTHING = Augmentation(
    noise=0.0,
    sleeve_noise=0.0,
    sleeve_off=0.0,
    sleeve_turned=0.0,
    noiseless=0.0,
    paced=0.0,
    pace=(0.0, 0.0),
    turned=0.0,
    hidden=0.0,
    lost=0.0,
    one_armed=0.0,
    late=0.0,
    bare=0.0,
)
seeds = st.integers(0, 2**32 - 1)


def in_world(batch: Batch) -> np.ndarray:
    """Returns the true joints (B,F+1,6,3), m, that a batch tells of, in the world."""
    arms = batch.arms.joints[:, -1:, :3] + batch.displacement
    both = batch.arms.frames.world(arms)
    half = len(both) // 2
    return np.concatenate([both[:half], both[half:]], axis=2)


def past(batch: Batch) -> np.ndarray:
    """Returns the joints (B,T,6,3), m, of the history, in the world."""
    half = len(batch.arms.joints) // 2
    return batch.arms.frames.world(batch.arms.joints)[:half]


@given(seeds, st.integers(38, 159))
@settings(max_examples=20)
def test_past_and_future_are_those_of_the_sequence(seed: int, now: int) -> None:
    data = made("free", 3)
    number = np.random.default_rng(seed).integers(3, size=4)
    batch = WindowSource(data, seed).at(number, np.full(4, float(now)))
    before = now + STRIDE * np.arange(1 - HISTORY, 1)
    after = now + STRIDE * np.arange(FUTURE + 1)
    np.testing.assert_allclose(past(batch), data.joint_position[number[:, None], before], atol=1e-9)
    np.testing.assert_allclose(
        in_world(batch), data.joint_position[number[:, None], after], atol=1e-9
    )
    np.testing.assert_allclose(batch.displacement[:, 0], 0.0, atol=1e-9)
    assert batch.seen.all()
    intent = data.intent[number]
    np.testing.assert_array_equal(
        batch.intent, np.concatenate([intent[:, now, 0], intent[:, now, 1]])
    )
    whole = np.concatenate([before, after[1:]])
    willed = np.concatenate([intent[:, whole, 0], intent[:, whole, 1]])
    np.testing.assert_array_equal(batch.willed, willed)


def test_tokens_are_those_that_a_run_makes_of_the_same_window() -> None:
    data = carried(1)
    batch = WindowSource(data, 0).at(np.arange(3), np.full(3, 60.0))
    rows = 60 + STRIDE * np.arange(1 - HISTORY, 1)
    joints, sleeves = data.joint_position[:, rows], data.sleeve[:, rows]
    seen, shown = np.ones(joints.shape[:3], dtype=bool), np.ones(sleeves.shape[:3], dtype=bool)
    expected = arm_tokens(Windows(joints, seen, sleeves, shown, PERIOD)).tokens
    np.testing.assert_array_equal(batch.arms.tokens, expected)


def test_sequences_in_the_precision_of_files_give_the_same_windows() -> None:
    data = carried(4)
    filed = Data(
        data.joint_position.astype(np.float32),
        data.sleeve.astype(np.float32),
        data.intent.astype(np.uint8),
    )
    at = np.arange(3), np.full(3, 60.25)
    one, two = WindowSource(data, 0).at(*at), WindowSource(filed, 0).at(*at)
    np.testing.assert_allclose(two.arms.tokens, one.arms.tokens, atol=1e-4)
    np.testing.assert_allclose(two.displacement, one.displacement, atol=1e-5)
    np.testing.assert_array_equal(two.willed, one.willed)
    assert two.displacement.dtype == np.float64
    assert two.willed.dtype == np.int64


@given(seeds, st.floats(0.5, 2.0))
@settings(max_examples=30)
def test_at_another_pace_persons_move_faster_by_as_much(seed: int, pace: float) -> None:
    """Between samples the sequence is interpolated."""
    data = carried(seed, samples=180)
    time = np.random.default_rng(seed).uniform(80.0, 81.0, 3)
    found = in_world(WindowSource(data, 0).at(np.arange(3), time, np.full(3, pace)))
    velocity = (data.joint_position[:, 1] - data.joint_position[:, 0]) / SAMPLED
    now = data.joint_position[:, 0] + time[:, None, None] * SAMPLED * velocity
    ahead = pace * PERIOD * np.arange(FUTURE + 1)[:, None, None]
    np.testing.assert_allclose(found, now[:, None] + ahead * velocity[:, None], atol=1e-9)


@given(seeds)
@settings(max_examples=20)
def test_windows_that_are_drawn_are_whole(seed: int) -> None:
    """At any pace they lie within their sequence, so that persons in it never stop."""
    how = replace(NOTHING, paced=0.7, pace=(-0.6, 0.6))
    batch = WindowSource(carried(seed), seed, how).drawn(40)
    for rows in (past(batch), in_world(batch)):
        steps = np.diff(rows, axis=1)
        np.testing.assert_allclose(steps, np.repeat(steps[:, :1], steps.shape[1], 1), atol=1e-9)
    speed = np.linalg.norm(np.diff(past(batch), axis=1)[:, 0, 0], axis=1) / PERIOD
    true = np.linalg.norm(np.diff(carried(seed).joint_position, axis=1)[:, 0, 0], axis=1) / SAMPLED
    paces = (speed[:, None] / true).ravel()
    assert ((paces > 0.5) & (paces < 1.9)).any()


def test_pace_that_does_not_fit_into_a_sequence_is_not_taken() -> None:
    data = carried(3, samples=100)
    how = replace(NOTHING, paced=1.0, pace=(0.5, 0.8))
    batch = WindowSource(data, 0, how).drawn(30)
    steps = np.linalg.norm(np.diff(past(batch), axis=1)[:, 0, 0], axis=1)
    true = np.linalg.norm(np.diff(data.joint_position, axis=1)[:, 0, 0], axis=1) * STRIDE
    assert np.abs(steps[:, None] - true).min(axis=1).max() < 1e-9


@pytest.mark.parametrize("every", [0.1, 0.5, 1.0])
def test_grid_has_every_whole_window_of_every_sequence(every: float) -> None:
    data = carried(0, samples=201)
    number, time = WindowSource(data, 0).grid(every)
    first, last = (HISTORY - 1) * STRIDE, 200 - FUTURE * STRIDE
    for k in range(3):
        mine = time[number == k]
        assert mine[0] == first
        np.testing.assert_allclose(np.diff(mine), every / SAMPLED)
        assert last - every / SAMPLED < mine[-1] <= last
    assert len(number) == 3 * len(mine)


def test_the_same_seed_draws_the_same_and_another_seed_another() -> None:
    data = carried(0)
    one, two, other = (
        WindowSource(data, s, Augmentation()).drawn(20) for s in ((1, 2), (1, 2), (1, 3))
    )
    np.testing.assert_array_equal(one.arms.tokens, two.arms.tokens)
    np.testing.assert_array_equal(one.displacement, two.displacement)
    assert not np.array_equal(one.arms.tokens, other.arms.tokens)


def test_noise_is_as_large_as_told_and_the_truth_has_none() -> None:
    data = carried(2)
    noise = 0.01
    batch = WindowSource(data, 0, noise=noise).at(np.tile(np.arange(3), 60), np.full(180, 60.0))
    clean = WindowSource(data, 0).at(np.tile(np.arange(3), 60), np.full(180, 60.0))
    off = past(batch) - past(clean)
    assert off.std() == pytest.approx(noise, rel=0.02)
    np.testing.assert_allclose(in_world(batch), in_world(clean), atol=1e-9)


def test_drawn_noise_spares_some_windows() -> None:
    data = carried(2, 1)
    how = replace(NOTHING, noise=0.004, noiseless=0.3)
    batch = WindowSource(data, 0, how).at(np.zeros(400, dtype=int), np.full(400, 60.0))
    clean = WindowSource(data, 0).at(np.zeros(1, dtype=int), np.full(1, 60.0))
    size = (past(batch) - past(clean)).std(axis=(1, 2, 3))
    none = size < 1e-9
    assert none.mean() == pytest.approx(0.3, abs=0.07)
    # the standard deviations are those of a normal distribution's size
    assert np.sqrt(np.mean(size[~none] ** 2)) == pytest.approx(0.004, rel=0.15)


@pytest.mark.parametrize("which", ["bare", "without", "no garment"])
def test_sleeves_are_not_shown_where_there_are_none_or_none_are_wanted(which: str) -> None:
    data = carried(0)
    if which == "no garment":
        data = Data(data.joint_position, np.full_like(data.sleeve, np.nan), data.intent)
    how = replace(NOTHING, bare=1.0) if which == "bare" else None
    batch = WindowSource(data, 0, how, with_sleeves=which != "without").drawn(10)
    np.testing.assert_array_equal(batch.arms.tokens[:, :, SLEEVE_COLUMNS], 0.0)
    shown = WindowSource(carried(0), 0).drawn(10).arms.tokens
    assert shown[:, :, SLEEVE_COLUMNS].any(axis=(1, 2)).all()


def test_share_of_windows_without_sleeves_is_as_told() -> None:
    how = replace(NOTHING, bare=0.4)
    batch = WindowSource(carried(0), 0, how).drawn(500)
    bare = ~batch.arms.tokens[:500, :, SLEEVE_COLUMNS].any(axis=(1, 2))
    assert bare.mean() == pytest.approx(0.4, abs=0.08)


def test_heading_is_off_by_as_much_as_told() -> None:
    how = replace(NOTHING, turned=0.2)
    data = carried(0, 1)
    at = np.zeros(500, dtype=int), np.full(500, 60.0)
    frames = WindowSource(data, 0, how).at(*at).arms.frames.matrix[:500]
    straight = WindowSource(data, 0).at(at[0][:1], at[1][:1]).arms.frames.matrix[0]
    turn = frames @ straight.T
    angle = np.arctan2(turn[:, 0, 1], turn[:, 0, 0])
    assert angle.std() == pytest.approx(0.2, rel=0.1)
    assert angle.mean() == pytest.approx(0.0, abs=0.04)


@given(seeds)
@settings(max_examples=10)
def test_hidden_arms_are_filled_in_and_the_truth_is_told_from_there(seed: int) -> None:
    data = carried(seed)
    how = replace(NOTHING, hidden=1.0, lost=0.0)
    source = WindowSource(data, seed, how)
    number = np.arange(60) % 3
    batch = source.at(number, np.full(60, 60.0))
    # exactly one arm of each window, by elbow, hand or both
    left, right = batch.seen[:60], batch.seen[60:]
    hidden = ~np.concatenate([left, right], axis=1)
    assert not hidden[:, [0, 3]].any()
    assert (hidden[:, :3].any(axis=1) != hidden[:, 3:].any(axis=1)).all()
    assert {tuple(sorted(set(np.flatnonzero(h) % 3))) for h in hidden} == {(1,), (2,), (1, 2)}
    clean = WindowSource(data, 0).at(number, np.full(60, 60.0))
    np.testing.assert_allclose(in_world(batch), in_world(clean), atol=1e-6)
    np.testing.assert_allclose(lengths(past(batch)), lengths(past(clean)), atol=1e-6)
    # who is carried along is filled in where he is, also if hidden all along
    np.testing.assert_allclose(past(batch), past(clean), atol=1e-6)


def test_joint_that_is_hidden_all_along_is_known_up_to_an_error() -> None:
    data = carried(0, 1)
    how = replace(NOTHING, hidden=1.0, lost=0.06)
    batch = WindowSource(data, 0, how).at(np.zeros(300, dtype=int), np.full(300, 60.0))
    clean = WindowSource(data, 0).at(np.zeros(1, dtype=int), np.full(1, 60.0))
    off = np.linalg.norm(past(batch)[:, 0] - past(clean)[:, 0], axis=2).max(axis=1)
    lost = off > 1e-9
    assert 0.1 < lost.mean() < 0.5
    assert 0.005 < np.median(off[lost]) < 0.05
    assert np.quantile(off[lost], 0.9) > 0.04
    changed = np.abs(lengths(past(batch)[:, 0]) - lengths(past(clean)[:, 0])).max(axis=1)
    # a hidden elbow beside a hand that is seen has the hand's distance, too
    assert (changed < 1e-6).mean() > 0.85


@pytest.mark.parametrize("name", ["one_armed", "late"])
def test_shares_of_arms_and_beginnings_that_are_not_seen_are_as_told(name: str) -> None:
    how = replace(NOTHING, one_armed=0.5) if name == "one_armed" else replace(NOTHING, late=0.5)
    source = WindowSource(carried(0), 0, how)
    batch = source.at(np.zeros(400, dtype=int), np.full(400, 60.0))
    assert np.isfinite(batch.arms.tokens).all()
    both = batch.seen[:400].all(axis=1) & batch.seen[400:].all(axis=1)
    if name == "one_armed":
        assert (~both).mean() == pytest.approx(0.5, abs=0.08)
        assert (batch.seen[:400].any(axis=1) | batch.seen[400:].any(axis=1)).all()
    else:
        # now, all is seen; before some moment the person stands
        assert both.all()
        rests = np.abs(np.diff(past(batch), axis=1)[:, 0]).max(axis=(1, 2)) < 1e-9
        assert rests.mean() == pytest.approx(0.5, abs=0.08)
        assert (np.abs(np.diff(past(batch), axis=1)[:, -4:]).max(axis=(2, 3)) > 1e-6).all()


def test_made_sequences_give_finite_windows_of_the_kinds_that_networks_take() -> None:
    batch = WindowSource(made("free", 3), 1, Augmentation()).drawn(64)
    assert batch.arms.tokens.shape == (128, HISTORY, 64)
    assert batch.arms.tokens.dtype == np.float32
    for part in (batch.arms.tokens, batch.displacement, batch.arms.joints):
        assert np.isfinite(part).all()
    assert set(np.unique(batch.intent)) <= {0, 1}


def test_sleeves_have_a_lasting_error() -> None:
    data = carried(0)
    how = replace(NOTHING, sleeve_off=0.02, sleeve_turned=0.3)
    at = np.zeros(300, dtype=int), np.full(300, 60.0)
    plain, off = (WindowSource(data, 0, h).at(*at).arms.tokens for h in (NOTHING, how))
    place, direction = slice(37, 40), slice(40, 43)
    # scaled by 3 per metre; the same over the whole window
    error = (off - plain)[:, :, place] / 3.0
    np.testing.assert_allclose(error, np.broadcast_to(error[:, :1], error.shape), atol=1e-5)
    assert 0.018 < error[:, 0].std() < 0.022
    np.testing.assert_allclose(np.linalg.norm(off[:, :, direction], axis=2), 1.0, atol=1e-5)
    cosine = (off[:, -1, direction] * plain[:, -1, direction]).sum(axis=1)
    assert 0.88 < cosine.mean() < 0.97
