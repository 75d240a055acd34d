"""The learned predictor as a whole, with drawn weights: laws that hold whatever was learned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.learned import network
from drake_dress.models.human.learned.diffusion import SAMPLES
from drake_dress.models.human.learned.experts import ExpertSettings
from drake_dress.models.human.learned.forecast import Forecast, PersonHistory
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.predictor import (
    EXPERTS,
    LearnedPredictor,
    PredictorMemory,
)
from tests.models.human.learned.drawn import (
    SWAPPED,
    Scene,
    about_vertical,
    drawn_networks,
    drawn_scene,
    lengths,
    mirrored,
)

PREDICTOR = LearnedPredictor(drawn_networks(0))
STRANGE = LearnedPredictor(drawn_networks(0, limit=1e-6))
ROWS = FUTURE + 1
seeds = st.integers(0, 2**32 - 1)


def followed(
    predictor: LearnedPredictor, scene: Scene, count: int = 3
) -> tuple[Forecast, PredictorMemory]:
    """Returns the last of `count` forecasts of a scene, one period apart, and the memory."""
    memory = predictor.begin()
    for k in range(count):
        now = slice(k, k + HISTORY)
        history = PersonHistory(k * PERIOD, scene.joints[now], scene.sleeves[now])
        found, memory = predictor.forecast(history, memory)
    return found, memory


def partly_seen(seed: int, share: float, steps: int = HISTORY) -> Scene:
    """Returns a scene in which joints and sleeves are missing here and there."""
    rng = np.random.default_rng(seed)
    scene = drawn_scene(seed, steps)
    joints, sleeves = scene.joints.copy(), scene.sleeves.copy()
    hidden = rng.random((steps, 6)) > share
    hidden[rng.integers(steps), rng.integers(6)] = False
    joints[hidden] = np.nan
    sleeves[rng.random((steps, 2)) > share] = np.nan
    return Scene(joints, sleeves)


@given(seeds, st.floats(0.0, 1.0))
@settings(max_examples=30)
def test_forecast_is_finite_and_limbs_keep_their_lengths(seed: int, share: float) -> None:
    """Whatever is seen, if it is one joint once."""
    found, _ = PREDICTOR.forecast(partly_seen(seed, share).history(4.0), PREDICTOR.begin())
    assert found.mean.shape == (ROWS, 6, 3)
    assert found.radius.shape == (ROWS, 6)
    assert found.samples.shape == (SAMPLES, ROWS, 6, 3)
    assert (found.start, found.step) == (4.0, PERIOD)
    for part in (found.mean, found.radius, found.samples, found.intent):
        assert np.isfinite(part).all()
    assert (found.radius > 0.0).all()
    assert ((found.intent > 0.0) & (found.intent < 1.0)).all()
    for part in (found.mean, found.samples):
        size = lengths(part)
        np.testing.assert_allclose(size, np.broadcast_to(size.reshape(-1, 5)[0], size.shape))


@given(seeds)
@settings(max_examples=20)
def test_limbs_are_as_long_as_the_persons(seed: int) -> None:
    scene = drawn_scene(seed)
    found, _ = PREDICTOR.forecast(scene.history(), PREDICTOR.begin())
    expected = np.broadcast_to(lengths(scene.joints[-1]), (ROWS, 5))
    np.testing.assert_allclose(lengths(found.mean), expected, atol=1e-9)


def check_turned(predictor: LearnedPredictor, scene: Scene, yaw: float, count: int) -> None:
    """Checks that a turned and shifted scene has the turned and shifted forecast."""
    shift = np.array([1.3, -0.4, 0.2])
    found, _ = followed(predictor, scene, count)
    moved, _ = followed(predictor, scene.moved(yaw, shift), count)
    turn = about_vertical(yaw).T
    np.testing.assert_allclose(moved.mean, found.mean @ turn + shift, atol=1e-3)
    np.testing.assert_allclose(moved.samples, found.samples @ turn + shift, atol=2e-3)
    np.testing.assert_allclose(moved.radius, found.radius, rtol=1e-3)
    np.testing.assert_allclose(moved.intent, found.intent, atol=1e-4)


@given(seeds, st.integers(0, 3), st.floats(0.6, 1.0))
@settings(max_examples=20)
def test_moved_and_turned_scene_has_the_moved_and_turned_forecast(
    seed: int, quarters: int, share: float
) -> None:
    """By quarter turns: the damped velocity is a median of each coordinate."""
    check_turned(PREDICTOR, partly_seen(seed, share, HISTORY + 2), 0.5 * np.pi * quarters, 3)


@given(seeds, st.floats(-3.0, 3.0), st.floats(0.6, 1.0))
@settings(max_examples=20)
def test_what_is_learned_is_turned_by_any_angle(seed: int, yaw: float, share: float) -> None:
    learned = replace(PREDICTOR, experts=ExpertSettings(trust=(0.1, 0.0, 0.0, 0.1, 0.4, 0.4)))
    check_turned(learned, partly_seen(seed, share), yaw, 1)


@given(seeds, st.floats(0.6, 1.0))
@settings(max_examples=20)
def test_mirrored_scene_has_the_mirrored_forecast(seed: int, share: float) -> None:
    scene = partly_seen(seed, share, HISTORY + 2)
    found, _ = followed(PREDICTOR, scene)
    image, _ = followed(PREDICTOR, scene.mirrored())
    np.testing.assert_allclose(image.mean, mirrored(found.mean), atol=1e-4)
    np.testing.assert_allclose(image.samples, mirrored(found.samples), atol=1e-3)
    np.testing.assert_allclose(image.radius, found.radius[:, SWAPPED], rtol=1e-3)
    np.testing.assert_allclose(image.intent, found.intent[::-1], atol=1e-4)
    np.testing.assert_array_equal(image.seen, found.seen[SWAPPED])


@given(seeds, st.sampled_from([(1,), (2,), (1, 2), (4, 5)]))
@settings(max_examples=20)
def test_hidden_joints_are_where_the_person_can_have_them(
    seed: int, which: tuple[int, ...]
) -> None:
    scene = drawn_scene(seed)
    joints = scene.joints.copy()
    joints[8:, which] = np.nan
    found, _ = PREDICTOR.forecast(Scene(joints, scene.sleeves).history(), PREDICTOR.begin())
    np.testing.assert_array_equal(np.flatnonzero(~found.seen), which)
    np.testing.assert_allclose(lengths(found.mean[0]), lengths(scene.joints[0]), atol=1e-6)
    # a hidden arm has hardly moved in a second
    assert np.linalg.norm(found.mean[0] - scene.joints[-1], axis=1).max() < 0.5


@pytest.mark.parametrize(("limit", "moves"), [(1e3, True), (1e-6, False)])
def test_hidden_joints_follow_the_network_if_the_input_is_familiar(
    limit: float, moves: bool
) -> None:
    """Other experts cannot be compared with what they will do; here, all trust is in rest."""
    networks = drawn_networks(0, limit)
    motion = dict(networks.motion)
    motion["displacement.bias"] = motion["displacement.bias"] + np.float32(0.1)
    trust = ExpertSettings(trust=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    predictor = LearnedPredictor(replace(networks, motion=motion), trust)
    scene = drawn_scene(9)
    joints = scene.joints.copy()
    joints[-3:, [1, 2]] = np.nan
    found, _ = predictor.forecast(Scene(joints, scene.sleeves).history(), predictor.begin())
    way = np.linalg.norm(found.mean[-1] - found.mean[0], axis=1)
    assert way[[0, 3, 4, 5]].max() < 1e-6
    assert (way[[1, 2]].min() > 0.02) == moves


@given(seeds)
@settings(max_examples=10)
def test_unfamiliar_input_is_left_to_the_linear_predictor(seed: int) -> None:
    scene = drawn_scene(seed, HISTORY + 2)
    found, strange = followed(PREDICTOR, scene)[0], followed(STRANGE, scene)[0]
    assert not found.is_linear
    assert strange.is_linear
    # whatever the network says
    networks = drawn_networks(0, limit=1e-6)
    other = dict(networks.motion)
    other["displacement.bias"] = other["displacement.bias"] + np.float32(0.3)
    again = followed(LearnedPredictor(replace(networks, motion=other)), scene)[0]
    np.testing.assert_allclose(again.mean, strange.mean, atol=1e-9)
    assert np.abs(strange.mean - found.mean).max() > 1e-4


@pytest.mark.parametrize("count", [1, network.FEWEST - 1, network.FEWEST])
def test_who_was_seen_for_a_moment_only_is_left_to_the_linear_predictor(count: int) -> None:
    """Regions are then its own, and samples as far apart, whatever the network says."""
    networks = drawn_networks(0)
    motion = dict(networks.motion)
    motion["displacement.bias"] = motion["displacement.bias"] + np.float32(0.3)
    motion["radius.bias"] = motion["radius.bias"] + np.float32(30.0)
    scene = drawn_scene(2)
    joints = scene.joints.copy()
    joints[: HISTORY - count] = np.nan
    found, other = (
        LearnedPredictor(n).forecast(Scene(joints, scene.sleeves).history(), PREDICTOR.begin())[0]
        for n in (networks, replace(networks, motion=motion))
    )
    assert found.is_linear == other.is_linear == (count < network.FEWEST)
    if not found.is_linear:
        assert other.radius.min() > found.radius.max()
        return
    expected = np.tile(network.linear_radius(networks.motion), (1, 2))
    for forecast in (found, other):
        np.testing.assert_allclose(forecast.radius, expected, rtol=1e-6)
    np.testing.assert_allclose(other.mean, found.mean, atol=1e-9)


def test_the_same_input_gives_the_same_bits() -> None:
    scene = partly_seen(1, 0.8, HISTORY + 6)
    first, second = (followed(PREDICTOR, scene, 6)[0] for _ in range(2))
    for name in ("mean", "radius", "samples", "intent", "seen"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_network_is_trusted_first_and_row_0_is_about_now() -> None:
    scene = drawn_scene(2)
    found, _ = PREDICTOR.forecast(scene.history(), PREDICTOR.begin())
    assert EXPERTS[np.argmax(PREDICTOR.experts.trust)] == "network"
    np.testing.assert_allclose(found.mean[0], scene.joints[-1], atol=0.02)


def far_off(limit: float) -> LearnedPredictor:
    """Returns a predictor of which all that is learned is far off."""
    networks = drawn_networks(0, limit)
    motion = dict(networks.motion)
    motion["displacement.bias"] = motion["displacement.bias"] + np.float32(0.2)
    motion["linear.map"] = motion["linear.map"] + np.float32(0.2)
    return LearnedPredictor(replace(networks, motion=motion))


@pytest.mark.parametrize("limit", [1e3, 1e-6])
def test_forecasts_follow_the_expert_that_knows_this_person(limit: float) -> None:
    """The network is far off, and loses its weight; of a person at rest the map is right."""
    predictor, scene = far_off(limit), drawn_scene(4)
    rest = Scene(np.tile(scene.joints[:1], (80, 1, 1)), np.tile(scene.sleeves[:1], (80, 1, 1)))
    found, memory = followed(predictor, rest, 60)
    weights = memory.experts.weights(predictor.experts, np.ones(len(EXPERTS)), ROWS)
    assert weights[EXPERTS.index("network")].max() < 0.05
    assert np.abs(found.mean - scene.joints[0]).max() < 0.03


def test_forecasts_of_a_stranger_err_no_more_than_the_best_expert() -> None:
    """Network and map are far off, of a person who moves; they are combined with the others."""
    predictor, scene = far_off(1e3), drawn_scene(4, HISTORY + 80)
    memory, errors = predictor.begin(), []
    for k in range(60):
        now = slice(k, k + HISTORY)
        history = PersonHistory(k * PERIOD, scene.joints[now], scene.sleeves[now])
        found, memory = predictor.forecast(history, memory)
        true = scene.joints[k + HISTORY - 1 : k + HISTORY + FUTURE]
        ways = np.concatenate([memory.experts.past[-1].positions, found.mean[None]])
        errors.append(np.linalg.norm(ways - true, axis=3).mean(axis=(1, 2)))
    *experts, own = np.mean(errors[40:], axis=0)
    assert own < 1.02 * min(experts)
    assert own < 0.5 * experts[EXPERTS.index("network")]
    weights = memory.experts.weights(predictor.experts, np.ones(len(EXPERTS)), ROWS)
    for name in ("linear", "network"):
        assert weights[EXPERTS.index(name)].max() < 0.15
        assert weights[EXPERTS.index(name), 11:].max() < 0.01


def test_memory_of_the_pose_tells_where_a_joint_hidden_all_along_was() -> None:
    scene = drawn_scene(5, HISTORY + 25)
    joints = scene.joints.copy()
    joints[HISTORY:, [1, 2]] = np.nan
    true, memory = lengths(scene.joints[0]), PREDICTOR.begin()
    for k in range(25):
        rows = slice(k, k + HISTORY)
        history = PersonHistory(k * PERIOD, joints[rows], scene.sleeves[rows])
        found, memory = PREDICTOR.forecast(history, memory)
        np.testing.assert_allclose(lengths(found.mean[0]), true, atol=0.01)
    assert len(memory.poses) == FUTURE + 1
    # without memory the arm has a usual length
    alone, _ = PREDICTOR.forecast(history, PREDICTOR.begin())
    assert np.abs(lengths(alone.mean[0]) - true)[1:3].max() > 0.01


def test_samples_are_about_the_mean_and_off_as_their_latents_say() -> None:
    """The latent that is set is the height of the hand in the next step."""
    networks = drawn_networks(0)
    motion = dict(networks.motion)
    for name in ("start.mean.weight", "start.spread.weight", "denoise.noise.weight"):
        motion[name] = 0.0 * motion[name]
    motion["start.spread.bias"] = np.full(24, -3.0, dtype=np.float32)
    motion["start.mean.bias"] = np.zeros(24, dtype=np.float32)
    scene, hands = drawn_scene(2), [2, 5]

    def sampled() -> tuple[np.ndarray, np.ndarray]:
        predictor = LearnedPredictor(replace(networks, motion=motion))
        found, _ = predictor.forecast(scene.history(), predictor.begin())
        return found.samples.mean(axis=0)[:, hands, 2], found.mean[:, hands, 2]

    about, mean = sampled()
    np.testing.assert_allclose(about, mean, atol=2e-3)
    for size in (-4.0, 4.0):
        motion["start.mean.bias"][8] = size
        about, mean = sampled()
        assert (np.sign(size) * (about - mean)[1] > 0.01).all()
        np.testing.assert_allclose(np.delete(about - mean, 1, axis=0), 0.0, atol=2e-3)


@given(seeds)
@settings(max_examples=10)
def test_memory_is_not_changed_by_the_next_forecast(seed: int) -> None:
    scene = drawn_scene(seed, HISTORY + 3)
    _, memory = followed(PREDICTOR, scene, 3)
    history = PersonHistory(3 * PERIOD, scene.joints[3:], scene.sleeves[3:])
    first, _ = PREDICTOR.forecast(history, memory)
    second, _ = PREDICTOR.forecast(history, memory)
    np.testing.assert_array_equal(first.mean, second.mean)
    np.testing.assert_array_equal(first.radius, second.radius)


def test_sleeves_matter_to_the_network() -> None:
    scene = drawn_scene(6)
    bare = Scene(scene.joints, np.full_like(scene.sleeves, np.nan))
    found, other = (PREDICTOR.forecast(s.history(), PREDICTOR.begin())[0] for s in (scene, bare))
    assert np.abs(found.intent - other.intent).max() > 1e-5
    assert np.abs(found.mean - other.mean).max() > 1e-6
