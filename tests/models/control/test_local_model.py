"""The local model: who follows whom, and what its problem asks and forbids."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.constrained_ddp import solve_constrained_ddp
from drake_dress.models.control.local_model import (
    LocalParameters,
    Nominal,
    SleeveGoal,
    influence,
    input_matrix,
    is_coupled,
    local_problem,
)
from drake_dress.models.control.solution import Solution
from drake_dress.models.garment.geodesics import Reach

REACH = Reach(0.59, (0.54, 0.54), (0.15, 0.15), 0.5)
P = LocalParameters()


def still(spread: float = 0.4) -> Nominal:
    """Sleeves beside each other below their grippers, all at rest."""
    sleeve = np.array([[0.0, 0.5 * spread, 1.2], [0.0, -0.5 * spread, 1.2]])
    gripper = sleeve + [0.0, 0.0, 0.14]
    n = P.horizon
    return Nominal(
        np.tile(sleeve, (n + 1, 1, 1)), np.tile(gripper, (n + 1, 1, 1)), np.zeros((n, 2, 3))
    )


def goal(nominal: Nominal, side: int, way: np.ndarray, on_arm: bool = False) -> SleeveGoal:
    """Asks a sleeve to go `way` (3,), m, at once; its arm points along x."""
    axis = np.tile([1.0, 0.0, 0.0], (P.horizon + 1, 1))
    target = nominal.sleeve[:, side] + way
    return SleeveGoal(target, 1.0, on_arm, target, axis)


def solved(
    nominal: Nominal, goals: tuple[SleeveGoal, SleeveGoal], coupled: bool = False
) -> tuple[Solution, FloatArray, FloatArray]:
    p = local_problem(nominal, goals, coupled, REACH, P)
    s = solve_constrained_ddp(p)
    assert s.converged
    x = s.x.reshape(-1, 4, 3)
    return s, nominal.sleeve + x[:, :2], nominal.gripper + x[:, 2:]


def test_apart_each_sleeve_follows_its_own_gripper() -> None:
    b = input_matrix(still(), False, REACH, P) / P.time_step
    np.testing.assert_allclose(b, np.vstack([np.eye(6), np.eye(6)]))


@given(distance=st.floats(0.1, 1.0))
def test_influence_grows_from_nothing_to_a_half(distance: float) -> None:
    k = influence(distance, 0.5, 0.8)
    assert 0.0 <= k <= 0.5
    if distance <= 0.4:
        assert k == 0.0
    if distance >= 0.5:
        assert k == 0.5
    assert influence(distance + 0.01, 0.5, 0.8) >= k


def test_taut_a_motion_of_both_grippers_is_a_motion_of_both_sleeves() -> None:
    nominal = still(0.47)
    b = input_matrix(nominal, True, REACH, P) / P.time_step
    together = np.tile([0.3, -0.2, 0.1], 2)
    np.testing.assert_allclose(b @ together, np.tile([0.3, -0.2, 0.1], 4))
    # one gripper alone moves both sleeves, its own the more
    alone = (b @ np.concatenate([[1.0, 0.0, 0.0], np.zeros(3)])).reshape(4, 3)[:2, 0]
    assert alone[0] > alone[1] > 0.0


def test_coupling_has_hysteresis() -> None:
    between = 0.5 * (P.coupled_share + P.released_share) * REACH.between_sleeves
    assert not is_coupled(False, between, REACH, P)
    assert is_coupled(True, between, REACH, P)
    assert is_coupled(False, REACH.between_sleeves, REACH, P)
    assert not is_coupled(True, 0.5 * REACH.between_sleeves, REACH, P)


def test_a_sleeve_goes_where_it_is_asked() -> None:
    nominal = still()
    way = np.array([0.0, 0.0, 0.05])
    _, sleeve, _ = solved(nominal, (goal(nominal, 0, way), goal(nominal, 1, 0.0 * way)))
    np.testing.assert_allclose(sleeve[-1, 0], nominal.sleeve[-1, 0] + way, atol=6e-3)
    np.testing.assert_allclose(sleeve[:, 1], nominal.sleeve[:, 1], atol=1e-6)


def test_a_target_far_away_is_gone_for_as_fast_as_a_gripper_may() -> None:
    nominal = still()
    way = np.array([0.0, 0.0, 0.4])
    s, _, _ = solved(nominal, (goal(nominal, 0, way), goal(nominal, 1, 0.0 * way)))
    assert np.linalg.norm(s.v[0, :3]) == pytest.approx(P.max_speed)


@given(seed=st.integers(0, 2**31), coupled=st.booleans())
@settings(max_examples=25)
def test_no_bound_is_exceeded_by_a_start_within_them(seed: int, coupled: bool) -> None:
    rng = np.random.default_rng(seed)
    nominal = still(rng.uniform(0.3, 0.47))
    ways = rng.normal(0.0, 0.3, (2, 3))
    on_arm = rng.random(2) < 0.5
    goals = (
        goal(nominal, 0, ways[0] * ([1.0, 0.03, 0.03] if on_arm[0] else 1.0), bool(on_arm[0])),
        goal(nominal, 1, ways[1] * ([1.0, 0.03, 0.03] if on_arm[1] else 1.0), bool(on_arm[1])),
    )
    _, sleeve, gripper = solved(nominal, goals, coupled)
    room = 1e-6
    for i in (0, 1):
        far = np.linalg.norm(sleeve[:, i] - gripper[:, 1 - i], axis=1)
        assert far.max() < REACH.to_far_gripper[i] + room
        speed = np.linalg.norm(np.diff(gripper[:, i], axis=0), axis=1) / P.time_step
        assert speed.max() < P.max_speed + room
        if on_arm[i]:
            beside = (sleeve[:, i] - goals[i].target)[1:, 1:]
            assert np.linalg.norm(beside, axis=1).max() < P.beside + room
            sideways = np.diff(sleeve[:, i], axis=0)[:, 1:] / P.time_step
            assert np.linalg.norm(sideways, axis=1).max() < P.beside_speed + room
    assert np.linalg.norm(sleeve[:, 0] - sleeve[:, 1], axis=1).max() < REACH.between_sleeves + room
    apart = np.linalg.norm(gripper[:, 0] - gripper[:, 1], axis=1)
    assert apart.max() < REACH.between_grippers + room


def test_a_plan_that_is_right_is_left_alone() -> None:
    """Where the global plan already does what is asked, nothing is compensated."""
    n, h = P.horizon, P.time_step
    nominal = still()
    velocity = np.zeros((n, 2, 3))
    velocity[:, :, 0] = 0.05
    moved = np.concatenate([np.zeros((1, 2, 3)), h * np.cumsum(velocity, axis=0)])
    nominal = Nominal(nominal.sleeve + moved, nominal.gripper + moved, velocity)
    s, _, _ = solved(nominal, (goal(nominal, 0, np.zeros(3)), goal(nominal, 1, np.zeros(3))))
    np.testing.assert_allclose(s.x, 0.0, atol=1e-9)


def test_bounds_that_a_plan_exceeds_by_itself_are_left_to_it() -> None:
    """A sleeve on an arm is drawn aside, and the arm with it; so is a garment drawn wide."""
    n, h = P.horizon, P.time_step
    velocity = np.zeros((n, 2, 3))
    velocity[:, 0, 1] = 2.0 * P.beside_speed
    moved = np.concatenate([np.zeros((1, 2, 3)), h * np.cumsum(velocity, axis=0)])
    wide = still(REACH.between_grippers - 0.01)
    nominal = Nominal(wide.sleeve + moved, wide.gripper + moved, velocity, planned=True)
    goals = tuple(
        SleeveGoal(
            nominal.sleeve[:, i], 1.0, True, wide.sleeve[:, i], goal(wide, i, np.zeros(3)).axis
        )
        for i in (0, 1)
    )
    s, _, _ = solved(nominal, (goals[0], goals[1]), coupled=True)
    np.testing.assert_allclose(s.x, 0.0, atol=1e-9)
    # the same without a plan that knows better: held back
    s, sleeve, gripper = solved(replace(nominal, planned=False), (goals[0], goals[1]), coupled=True)
    assert np.abs(sleeve[:, 0, 1] - wide.sleeve[0, 0, 1]).max() < P.beside + 1e-6
    assert np.linalg.norm(gripper[:, 0] - gripper[:, 1], axis=1).max() < 0.5 + 1e-6
