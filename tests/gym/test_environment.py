import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import error
from gymnasium.utils.env_checker import check_env

from drake_dress.errors import UserError
from drake_dress.gym import ENV_ID, DressingEnv
from drake_dress.gym.world import World
from drake_dress.models.dressing.progress import SleeveGauge, SleeveProgress
from tests.gym.small import COARSE, assert_same, episode, small_env

REST = np.zeros((2, 3), dtype=np.float32)


@pytest.fixture(scope="module")
def env() -> DressingEnv:
    return small_env(["duration=0.2"])


def test_gymnasium_finds_nothing_wrong() -> None:
    groups = ["state", "force", "color", "depth"]
    env = gymnasium.make(ENV_ID, overrides=COARSE, observe=groups, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_the_same_seed_and_actions_give_the_same_bits(env: DressingEnv) -> None:
    first = episode(env, seed=3)
    assert_same(first, episode(env, seed=3))
    # another diagram
    assert_same(first, episode(small_env(["duration=0.2"]), seed=3))


def test_a_diagram_is_built_anew_only_where_the_draw_differs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    built: list[Any] = []

    def build(*given: Any) -> World:
        built.append(given)
        return World(*given)

    monkeypatch.setattr("drake_dress.gym.environment.World", build)
    still, varied = small_env(), small_env(["variation.start_offset=0.05"])
    for seed in (1, 2):
        still.reset(seed=seed)
    assert len(built) == 1
    for seed in (1, 1, 2):
        varied.reset(seed=seed)
    assert len(built) == 3


def test_seeds_vary_the_episode_and_not_the_spaces() -> None:
    env = DressingEnv("dummy_varied", COARSE)
    seen, counts = [], []
    for seed in (0, 2):
        observation, info = env.reset(seed=seed)
        assert info["seed"] == seed
        assert env.observation_space.contains(observation)
        seen.append(observation)
        counts.append(len(env.parts.garments.plant.rest_position))
    assert counts[0] != counts[1]
    for name in ("garment_position", "joint_position", "gripper_position"):
        assert np.abs(seen[0][name] - seen[1][name]).max() > 0.005


def test_episodes_without_a_seed_differ_and_none_is_one_that_is_reported(env: DressingEnv) -> None:
    env.reset(seed=5)
    seeds = [env.reset()[1]["seed"] for _ in range(3)]
    assert len(set(seeds)) == 3
    assert min(seeds) >= 2**32
    env.reset(seed=5)
    assert [env.reset()[1]["seed"] for _ in range(3)] == seeds


def test_an_episode_is_truncated_at_the_scenarios_duration(env: DressingEnv) -> None:
    env.reset(seed=0)
    for step in range(1, 11):
        _, _, terminated, truncated, info = env.step(REST)
        assert not terminated
        assert truncated == (step == 10)
    assert info["ended_by"] == "time"
    assert info["time"] == pytest.approx(0.2)
    with pytest.raises(error.ResetNeeded):
        env.step(REST)


def test_the_control_rate_sets_how_long_an_action_holds() -> None:
    env = small_env(["duration=0.2"], control_rate=10.0)
    env.reset(seed=0)
    assert not env.step(REST)[3]
    assert env.step(REST)[3]
    assert env.metadata["render_fps"] == pytest.approx(10.0)


def test_grippers_move_as_they_are_asked_within_what_the_governor_allows() -> None:
    env = small_env()
    begin = env.reset(seed=0)[0]["gripper_position"]
    asked = np.array([[-0.1, 0.0, 0.0]] * 2, dtype=np.float32)
    for _ in range(50):
        seen, *_ = env.step(asked)
    # for 1 s, less the time to come to speed
    np.testing.assert_allclose(seen["gripper_position"] - begin, asked, atol=0.012)
    # a corner of the action space is faster than a gripper may be
    for _ in range(25):
        seen, *_ = env.step(np.full((2, 3), 0.25, dtype=np.float32))
        assert np.linalg.norm(seen["gripper_velocity"], axis=1).max() <= 0.25
    assert np.linalg.norm(seen["gripper_velocity"], axis=1).min() > 0.1


def test_the_governors_stop_ends_an_episode_and_costs() -> None:
    # less than the coat's weight: the governor cannot but stop
    env = small_env(["safety.force_limit=1"], reward={"failure": 3.0, "gripper_force": 0.0})
    env.reset(seed=0)
    for _ in range(100):
        _, _, terminated, truncated, info = env.step(REST)
        if terminated:
            break
    assert terminated
    assert not truncated
    assert info["ended_by"] == "governor stopped the grippers"
    assert info["reward"]["failure"] == -3.0
    assert not info["is_success"]


def test_sleeves_that_stay_on_end_an_episode_with_success(monkeypatch: pytest.MonkeyPatch) -> None:
    env = small_env(stay=0.1, reward={"success": 4.0})
    env.reset(seed=0)
    # on for one step, then for the five that it takes
    s = iter([1.95, 1.85, *[1.95] * 9])  # one of them slips once
    monkeypatch.setattr(
        SleeveGauge,
        "measure",
        lambda *_: SleeveProgress(
            np.array([[2.0, 0.0, 0.0], [next(s), 0.0, 0.0]]), np.array([1, -1]), np.zeros(2)
        ),
    )
    env._observer.read = lambda time_on: {"time_on": time_on}  # type: ignore[method-assign]
    steps, terminated = 0, False
    while not terminated:
        seen, _, terminated, _, info = env.step(REST)
        steps += 1
    assert steps == 7
    assert seen["time_on"] == pytest.approx(0.1)
    assert info["is_success"]
    assert info["reward"]["success"] == 4.0


def test_a_simulation_that_breaks_down_ends_an_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    env = small_env()
    last, _ = env.reset(seed=0)

    def broken(*_: object) -> None:
        raise ValueError("garment at 0.010 s: not finite")

    monkeypatch.setattr("drake_dress.gym.world.Simulator.AdvanceTo", broken)
    seen, reward, terminated, _, info = env.step(REST)
    assert terminated
    assert info["ended_by"] == "garment at 0.010 s: not finite"
    assert reward == -5.0
    assert_same([seen], [last])


def test_rendering_shows_the_garment_and_changes_nothing() -> None:
    plain = episode(small_env(), seed=1, steps=3)
    env = small_env(render_mode="rgb_array", render_size=(64, 48))
    env.reset(seed=1)
    frame = env.render()
    assert frame is not None
    assert frame.shape == (48, 64, 3)
    red, blue = frame[:, :, 0].astype(int), frame[:, :, 2].astype(int)
    assert 0.02 < np.mean(blue > red + 60) < 0.5
    assert_same(plain, episode(env, seed=1, steps=3))
    env.render()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"scenario": "dumy_standing"}, "did you mean dummy_standing"),
        ({"overrides": ["plant.spacng=1"]}, "--set: plant.spacng"),
        ({"overrides": ["station.kind=hardware", "station.arms.model=panda"]}, "station.kind: is"),
        ({"observe": "state"}, "observe: is 'state', expected a list"),
        ({"observe": ["touch"]}, "expected a list of some of state, force, color, depth"),
        ({"observe": []}, "observe: is"),
        ({"control_rate": 30.0}, "control_rate: is 30.0 Hz, expected a period that is a multiple"),
        ({"control_rate": 0.0}, "control_rate: is 0.0 Hz"),
        ({"control_rate": float("nan")}, "control_rate: is nan Hz"),
        ({"stay": -1.0}, "stay: is -1.0 s"),
        ({"render_mode": "human"}, "render_mode: is 'human', expected rgb_array or None"),
        ({"render_size": (1, 1)}, "render_size: is"),
        ({"reward": {"hope": 1.0}}, "reward: hope: is no weight"),
    ],
)
def test_arguments_that_cannot_be_used_are_told(arguments: dict[str, object], told: str) -> None:
    with pytest.raises(UserError, match=told):
        DressingEnv(**arguments)  # type: ignore[arg-type]


def test_actions_and_options_that_cannot_be_used_are_told(env: DressingEnv) -> None:
    env.reset(seed=0)
    for action in (np.zeros(6), np.full((2, 3), np.nan)):
        with pytest.raises(UserError, match=r"step: action: is .* expected \(2,3\) finite"):
            env.step(action)
    with pytest.raises(UserError, match="reset: options: has light, expected none"):
        env.reset(options={"light": 1})


def test_nothing_can_be_asked_of_an_environment_that_was_not_reset() -> None:
    env = small_env(render_mode="rgb_array")
    for ask in (lambda: env.step(REST), env.render, lambda: env.parts):
        with pytest.raises(error.ResetNeeded):
            ask()


def test_a_scenario_may_be_a_file(tmp_path: Path) -> None:
    file = tmp_path / "short.yaml"
    file.write_text("duration: 1.0\n")
    env = DressingEnv(file)
    time = env.observation_space["time"]
    assert isinstance(time, gymnasium.spaces.Box)
    assert time.high[0] == 1.0
