"""Dressing as a Gymnasium environment (the `gym` extra).

    import gymnasium
    import drake_dress.gym  # registers the environment

    env = gymnasium.make("drake_dress/Dressing-v0", scenario="dummy_varied")
    observation, info = env.reset(seed=0)

`DressingEnv` is the environment, `RewardWeights` sets the weights of its reward, and
`ControllerPolicy` runs the scenario's own controllers in it. `docs/gym.md` describes observations
and actions. The names in `__all__` are public.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from drake_dress.gym.controller_policy import ControllerPolicy
from drake_dress.gym.environment import DressingEnv
from drake_dress.gym.reward import RewardWeights

__all__ = ["ENV_ID", "ControllerPolicy", "DressingEnv", "RewardWeights", "make_vec"]

ENV_ID = "drake_dress/Dressing-v0"


def make_vec(num_envs: int, **arguments: Any) -> gymnasium.vector.VectorEnv[Any, Any, Any]:
    """Returns environments that run in parallel, each in its own process.

    Like `gymnasium.make_vec`, but processes are spawned: Numba and linear algebra use threads, and
    a process forked from one with threads may hang.

    Args:
        num_envs: number of environments.
        arguments: arguments of `DressingEnv`.
    """
    return gymnasium.make_vec(
        ENV_ID,
        num_envs=num_envs,
        vectorization_mode="async",
        vector_kwargs={"context": "spawn"},
        **arguments,
    )


# `gymnasium.register` warns if a name is registered twice, for example when a module is reloaded.
if ENV_ID not in gymnasium.registry:
    gymnasium.register(id=ENV_ID, entry_point="drake_dress.gym.environment:DressingEnv")
