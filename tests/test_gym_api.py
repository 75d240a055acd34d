"""Registration of the environment."""

import gymnasium

from drake_dress import gym


def test_the_environment_is_registered_once_however_often_it_is_imported() -> None:
    env = gymnasium.make(gym.ENV_ID, scenario="dummy_sitting", observe=["state"])
    assert isinstance(env.unwrapped, gym.DressingEnv)
    assert gymnasium.spec(gym.ENV_ID).entry_point == "drake_dress.gym.environment:DressingEnv"
