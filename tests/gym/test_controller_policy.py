import gymnasium
import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.assemble import parts, wired
from drake_dress.diagrams.scenario import apply_variation, load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.gym import ControllerPolicy
from drake_dress.models.sides import SIDES
from drake_dress.shipped import shipped_scenario
from tests.gym.small import COARSE, small_env

SOURCE = shipped_scenario("dummy_standing")


def _requests_of_a_run(overrides: list[str], times: list[float]) -> np.ndarray:
    """Returns (T,2,3) what the controllers of a run request, m/s."""
    scenario = apply_variation(load_scenario(SOURCE, overrides))
    dressing = wired(parts(read_setup(scenario, SOURCE)))
    simulator = Simulator(dressing.diagram)
    name = "plan_follower" if dressing.local is None else "local_controller"
    asking = dressing.diagram.GetSubsystemByName(name)
    found = []
    for time in times:
        simulator.AdvanceTo(time)
        at = asking.GetMyContextFromRoot(simulator.get_context())
        ports = [asking.GetOutputPort(f"{side}_velocity_request") for side in SIDES]
        found.append([port.Eval(at) for port in ports])
    return np.array(found)


@pytest.mark.parametrize("method", ["global", "full"])
def test_it_requests_what_the_controllers_of_a_run_request(method: str) -> None:
    overrides = [*COARSE, f"controller.method={method}"]
    env = small_env([f"controller.method={method}"])
    seen, _ = env.reset(seed=0)
    policy = ControllerPolicy(env)
    actions = []
    for _ in range(35):
        action = policy.act(seen)
        assert action in env.action_space
        actions.append(action)
        seen, *_ = env.step(action)
    times = [0.1, 0.44, 0.6]
    expected = _requests_of_a_run(overrides, [time + 0.005 for time in times])
    found = np.array([actions[round(time / env.control_period)] for time in times])
    assert not found[0].any()
    assert np.linalg.norm(expected[1:], axis=2).max() > 0.03
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_it_comes_nearer_to_the_hand() -> None:
    env = small_env(["duration=4"])
    seen, _ = env.reset(seed=0)
    policy = ControllerPolicy(env)
    terms, ended = [], False
    while not ended:
        seen, _, terminated, ended, info = env.step(policy.act(seen))
        assert not terminated
        terms.append(info["reward"]["approach"])
    assert sum(terms) > 0.05


def test_an_environment_that_it_cannot_act_in_is_told() -> None:
    blind = small_env(observe=["force"])
    blind.reset(seed=0)
    with pytest.raises(ValueError, match="does not observe the group state"):
        ControllerPolicy(blind)
    with pytest.raises(ValueError, match="is a CartPoleEnv, expected a DressingEnv"):
        ControllerPolicy(gymnasium.make("CartPole-v1"))
