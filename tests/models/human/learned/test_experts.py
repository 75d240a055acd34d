"""Weights go to the expert that did best, and regions grow until they hold what they should."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.learned.experts import (
    GROUPS,
    ExpertMemory,
    ExpertSettings,
)
from drake_dress.models.human.learned.network import COVERED

ROWS, STEP, LASTING = 21, 0.1, 2.0
SETTINGS = ExpertSettings()
EXPERTS = len(SETTINGS.trust)
ALL = np.ones(EXPERTS)
seeds = st.integers(0, 2**32 - 1)


def following(
    memory: ExpertMemory,
    off: np.ndarray,
    count: int,
    begin: int = 0,
    radius: float = 0.1,
    mean_off: float = 0.0,
    joints: np.ndarray | None = None,
) -> ExpertMemory:
    """Returns the memory after forecasts of a person at rest, by experts that are `off` (E,), m."""
    joints = np.zeros((6, 3)) if joints is None else joints
    positions = np.tile(off[:, None, None, None], (1, ROWS, 6, 3)) / np.sqrt(3.0)
    mean = np.full((ROWS, 6, 3), mean_off / np.sqrt(3.0))
    for k in range(begin, begin + count):
        memory = memory.compared(k * STEP, joints, STEP, SETTINGS)
        memory = memory.remembering(k * STEP, positions, mean, np.full((ROWS, 6), radius), LASTING)
    return memory


def weights(memory: ExpertMemory, allowed: np.ndarray = ALL) -> np.ndarray:
    return memory.weights(SETTINGS, allowed, ROWS)


@given(seeds, st.integers(0, 40), st.integers(0, 3))
def test_weights_are_shares_and_an_expert_that_is_not_allowed_has_none(
    seed: int, count: int, without: int
) -> None:
    memory = following(
        ExpertMemory(), np.random.default_rng(seed).uniform(0.0, 0.3, EXPERTS), count
    )
    allowed = ALL.copy()
    allowed[without] = 0.0
    for which in (ALL, allowed):
        found = weights(memory, which)
        assert found.shape == (EXPERTS, ROWS, 6)
        assert (found >= 0.0).all()
        np.testing.assert_allclose(found.sum(axis=0), 1.0)
        assert not found[which == 0.0].any()


def test_before_anything_is_compared_experts_are_trusted_as_set() -> None:
    found = weights(ExpertMemory())
    np.testing.assert_allclose(found[:, 0, 0], SETTINGS.trust)
    np.testing.assert_allclose(found, np.tile(found[:, :1, :1], (1, ROWS, 6)))
    # without one, the others share its part
    found = weights(ExpertMemory(), np.append(ALL[1:], 0.0))
    others = np.array(SETTINGS.trust[:-1])
    np.testing.assert_allclose(found[:-1, 0, 0], others / others.sum())


@pytest.mark.parametrize(("first", "then"), [(0, EXPERTS - 1), (EXPERTS - 1, 0), (1, 2)])
def test_weights_go_to_the_expert_that_is_better_and_back(first: int, then: int) -> None:
    off = np.full(EXPERTS, 0.1)
    off[first] = 0.02
    memory = following(ExpertMemory(), off, 60)
    assert weights(memory)[first].min() > 0.9
    # past losses are forgotten
    off = np.full(EXPERTS, 0.1)
    off[then] = 0.02
    memory = following(memory, off, 400, begin=60)
    assert weights(memory)[then].min() > 0.9


def test_an_expert_that_is_a_little_better_wins_in_time() -> None:
    memory = following(ExpertMemory(), np.where(np.arange(EXPERTS) == 0, 0.02, 0.025), 150)
    assert weights(memory)[0].min() > 0.5


def test_experts_that_err_to_opposite_sides_are_combined() -> None:
    """One errs twice as far as the other: a third of it and two thirds of the other are right."""
    positions = np.zeros((EXPERTS, ROWS, 6, 3))
    positions[0, ..., 0], positions[1, ..., 0], positions[2:, ..., 1] = -0.04, 0.02, 0.3
    memory = ExpertMemory()
    for k in range(120):
        memory = memory.compared(k * STEP, np.zeros((6, 3)), STEP, SETTINGS)
        memory = memory.remembering(k * STEP, positions, positions[0], np.ones((ROWS, 6)), LASTING)
    found = weights(memory)
    np.testing.assert_allclose(found[0], 1 / 3, atol=0.05)
    np.testing.assert_allclose(found[1], 2 / 3, atol=0.05)
    assert np.abs((found[..., None] * positions).sum(axis=0)).max() < 0.01


@given(seeds)
def test_small_gains_are_taken_for_chance(seed: int) -> None:
    """Experts err alike but for a hundredth, which few comparisons may favour by chance."""
    rng = np.random.default_rng(seed)
    memory = ExpertMemory()
    for k in range(40):
        off = rng.choice([-0.1, 0.1]) * rng.uniform(0.99, 1.01, EXPERTS)
        memory = following(memory, off, 1, k)
    found = weights(memory)
    np.testing.assert_allclose(found, weights(ExpertMemory()), atol=0.02)


def test_an_expert_that_is_not_trusted_at_all_is_never_used() -> None:
    settings = ExpertSettings(trust=(0.0, 0.5, 0.0, 0.0, 0.0, 0.5))
    off = np.full(EXPERTS, 0.1)
    off[0] = 0.0
    found = following(ExpertMemory(), off, 60).weights(settings, ALL, ROWS)
    assert not found[[0, 2, 3, 4]].any()


def test_experts_that_do_equally_well_stay_as_trusted() -> None:
    memory = following(ExpertMemory(), np.full(EXPERTS, 0.05), 100)
    np.testing.assert_allclose(weights(memory)[:, 0, 0], SETTINGS.trust, rtol=1e-9)


def test_each_arm_and_each_range_of_horizons_has_weights_of_its_own() -> None:
    memory = ExpertMemory()
    positions = np.full((EXPERTS, ROWS, 6, 3), 0.2)
    positions[2, :, :3] = 0.0  # the left arm is known by expert 2
    positions[1, :, 3:] = 0.0  # the right one by 1
    positions[:, 11:] = 0.2
    positions[0, 11:] = 0.0  # later, both by 0
    for k in range(80):
        memory = memory.compared(k * STEP, np.zeros((6, 3)), STEP, SETTINGS)
        memory = memory.remembering(
            k * STEP, positions, np.zeros((ROWS, 6, 3)), np.ones((ROWS, 6)), LASTING
        )
    best = weights(memory).argmax(axis=0)
    np.testing.assert_array_equal(best[:11, :3], 2)
    np.testing.assert_array_equal(best[:11, 3:], 1)
    np.testing.assert_array_equal(best[11:], 0)
    assert GROUPS[1] == 10


@pytest.mark.parametrize("seen", [0, 1])
def test_what_is_not_seen_is_not_compared(seen: int) -> None:
    off = np.where(np.arange(EXPERTS) == 2, 0.02, 0.1)
    hidden = np.zeros((6, 3))
    of_seen, of_other = slice(3 * seen, 3 * seen + 3), slice(3 - 3 * seen, 6 - 3 * seen)
    hidden[of_other] = np.nan
    memory = following(ExpertMemory(), off, 60, joints=hidden)
    found = weights(memory)
    assert found[2, :, of_seen].min() > 0.9
    np.testing.assert_allclose(found[:, :, of_other], weights(ExpertMemory())[:, :, of_other])
    assert memory.size[1 - seen] == 1.0
    assert memory.size[seen] < 1.0
    blind = following(ExpertMemory(), off, 60, joints=np.full((6, 3), np.nan))
    assert (blind.products == 0.0).all()


def test_forecasts_of_other_times_and_those_too_old_are_not_compared() -> None:
    memory = following(ExpertMemory(), np.full(EXPERTS, 0.1), 1)
    for time in (0.0, 0.05, 2.1, -0.1):
        assert memory.compared(time, np.ones((6, 3)), STEP, SETTINGS) is memory
    assert memory.compared(2.0, np.ones((6, 3)), STEP, SETTINGS) is not memory
    memory = following(memory, np.full(EXPERTS, 0.1), 60, begin=1)
    assert len(memory.past) == round(LASTING / STEP) + 1


@pytest.mark.parametrize(("off", "size"), [(0.5, SETTINGS.largest), (0.0, SETTINGS.smallest)])
def test_regions_grow_when_joints_fall_outside_and_shrink_when_all_are_inside(
    off: float, size: float
) -> None:
    memory, sizes = ExpertMemory(), [np.ones(2)]
    for k in range(60):
        memory = following(memory, np.zeros(EXPERTS), 1, k, mean_off=off)
        sizes.append(memory.size)
    steps = np.diff(np.array(sizes), axis=0)
    assert (np.sign(size - 1.0) * steps >= 0.0).all()
    # and no further than their limits
    memory = following(memory, np.zeros(EXPERTS), 900, 60, mean_off=off)
    np.testing.assert_allclose(memory.size, size)


def test_regions_find_the_size_that_holds_what_they_should() -> None:
    """Errors are those of a normal distribution; regions were too small by half."""
    rng = np.random.default_rng(0)
    scale, memory, inside = 0.02, ExpertMemory(), []
    small = 0.5 * scale * 2.5  # 90 % of the lengths of normal vectors are below 2.5
    positions = np.zeros((EXPERTS, ROWS, 6, 3))
    for k in range(1500):
        joints = scale * rng.normal(size=(6, 3))
        memory = memory.compared(k * STEP, joints, STEP, SETTINGS)
        radius = np.repeat(memory.size, 3) * np.full((ROWS, 6), small)
        memory = memory.remembering(k * STEP, positions, positions[0], radius, LASTING)
        inside.append(np.linalg.norm(joints, axis=1) <= radius[0])
    assert np.mean(inside[500:]) == pytest.approx(COVERED, abs=0.02)
    np.testing.assert_allclose(memory.size, 2.0, rtol=0.15)


@given(seeds)
def test_memory_is_its_own_copy_and_is_never_changed(seed: int) -> None:
    memory = following(ExpertMemory(), np.random.default_rng(seed).uniform(0.0, 0.2, EXPERTS), 10)
    before = [a.copy() for a in (memory.products, memory.count, memory.size)]
    later = following(memory, np.full(EXPERTS, 0.3), 5, begin=10, mean_off=0.5)
    assert copy.deepcopy(memory) is memory
    for old, now, new in zip(
        before,
        (memory.products, memory.count, memory.size),
        (later.products, later.count, later.size),
        strict=True,
    ):
        np.testing.assert_array_equal(now, old)
        assert not np.array_equal(new, old)
    assert len(memory.past) == 10
