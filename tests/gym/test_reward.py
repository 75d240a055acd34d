import itertools

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.gym.reward import Loads, RewardWeights, reward_terms
from drake_dress.models.dressing.progress import SleeveProgress
from tests.drawing import drawn_seed

STILL = Loads(np.zeros((2, 2)), np.zeros(2), 0.01)


def _drawn_state(rng: np.random.Generator) -> SleeveProgress:
    s, l, theta = rng.uniform(0, 2, 2), rng.uniform(0, 0.1, 2), rng.uniform(-3, 3, 2)
    return SleeveProgress(
        np.stack([s, l, theta], axis=1),
        rng.integers(-1, 2, 2).astype(np.int32),
        rng.uniform(0, 1, 2),
    )


def _shaped(weights: RewardWeights, path: list[SleeveProgress]) -> float:
    steps = (reward_terms(weights, a, b, STILL, False, False) for a, b in itertools.pairwise(path))
    return sum(terms["progress"] + terms["approach"] for terms in steps)


def test_progress_adds_up_to_the_same_whichever_way_was_taken() -> None:
    rng = np.random.default_rng(drawn_seed())
    weights = RewardWeights(progress=1.3, approach=0.7)
    begin, end = _drawn_state(rng), _drawn_state(rng)
    ways = [[begin, *(_drawn_state(rng) for _ in range(n)), end] for n in (0, 1, 30)]
    sums = [_shaped(weights, way) for way in ways]
    np.testing.assert_allclose(sums, sums[0], atol=1e-12)
    assert _shaped(weights, [begin, end, begin]) == pytest.approx(0.0, abs=1e-12)


def test_a_sleeve_beside_its_arm_has_no_progress() -> None:
    weights = RewardWeights(approach=0.0)
    before = SleeveProgress(np.zeros((2, 3)), np.zeros(2, dtype=int), np.ones(2))
    beside = SleeveProgress(np.array([[1.9, 0.1, 0.0]] * 2), np.array([0, 1]), np.ones(2))
    terms = reward_terms(weights, before, beside, STILL, False, False)
    assert terms["progress"] == pytest.approx(1.9)


def test_forces_cost_by_their_impulse_beyond_what_is_free() -> None:
    weights = RewardWeights(gripper_force=2.0, person_force=3.0, free_force=5.0)
    state = SleeveProgress(np.zeros((2, 3)), np.zeros(2, dtype=int), np.ones(2))
    loads = Loads(np.array([[4.0, 9.0], [6.0, 5.0]]), np.array([1.0, 2.0]), 0.01)
    terms = reward_terms(weights, state, state, loads, False, False)
    assert terms["gripper_force"] == pytest.approx(-2.0 * 0.01 * (4.0 + 1.0))
    assert terms["person_force"] == pytest.approx(-3.0 * 0.01 * 3.0)
    # the same forces for as long, sampled twice as often
    finer = Loads(loads.gripper_force.repeat(2, 0), loads.contact_force.repeat(2), 0.005)
    assert reward_terms(weights, state, state, finer, False, False) == pytest.approx(terms)


def test_success_is_given_and_failure_taken() -> None:
    weights = RewardWeights(success=7.0, failure=3.0)
    state = SleeveProgress(np.zeros((2, 3)), np.zeros(2, dtype=int), np.ones(2))
    assert sum(reward_terms(weights, state, state, STILL, True, False).values()) == 7.0
    assert sum(reward_terms(weights, state, state, STILL, False, True).values()) == -3.0


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"progres": 1.0}, r"reward: progres: is no weight, expected one of progress, "),
        ({"force": -1.0}, r"reward: force: is no weight"),
        ({"success": -1.0}, r"reward: success: is -1.0, expected a finite number, 0 or more"),
        ({"approach": float("nan")}, r"reward: approach: is nan, expected"),
        ([1.0], r"reward: is \[1.0\], expected RewardWeights or a mapping"),
    ],
)
def test_a_weight_that_cannot_be_used_is_told(given: object, told: str) -> None:
    with pytest.raises(UserError, match=told):
        RewardWeights.of(given)  # type: ignore[arg-type]
