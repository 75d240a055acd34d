"""Dressing as a Gymnasium environment (the `gym` extra).

    import gymnasium
    import drake_dress.gym  # registers the environment

    env = gymnasium.make("drake_dress/Dressing-v0", scenario="dummy_varied")
    observation, info = env.reset(seed=0)

`DressingEnv` is the environment, `RewardWeights` weighs its reward, and `ControllerPolicy` lets the
scenario's own controllers act in it. `docs/gym.md` has the layout of observations and actions. What
stands in `__all__` is public.
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
    """Returns environments that run side by side, each in a process of its own.

    It is `gymnasium.make_vec` with processes that are spawned: one forked from a process with
    threads, as Numba and linear algebra have them, may hang.

    Args:
        num_envs: how many.
        arguments: of `DressingEnv`.
    """
    return gymnasium.make_vec(
        ENV_ID,
        num_envs=num_envs,
        vectorization_mode="async",
        vector_kwargs={"context": "spawn"},
        **arguments,
    )


# `gymnasium.register` warns of a name that is registered twice, as when a module is loaded again.
if ENV_ID not in gymnasium.registry:
    gymnasium.register(id=ENV_ID, entry_point="drake_dress.gym.environment:DressingEnv")
