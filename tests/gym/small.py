"""Environments whose garment is coarse, so that tests are quick."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_dress.gym import DressingEnv
from drake_dress.gym.observations import Observation

COARSE = ("plant.spacing=0.05", "plant.self_collision=false")


def small_env(overrides: Sequence[str] = (), **arguments: Any) -> DressingEnv:
    """Returns an environment with a coarse garment; arguments are those of `DressingEnv`."""
    return DressingEnv(overrides=[*COARSE, *overrides], **arguments)


def episode(env: Any, seed: int, steps: int = 5) -> list[Observation]:
    """Returns what is observed with actions that are drawn from the seed."""
    rng = np.random.default_rng(seed)
    seen = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        seen.append(env.step(rng.uniform(-0.2, 0.2, (2, 3)).astype(np.float32))[0])
    return seen


def assert_same(first: list[Observation], second: list[Observation]) -> None:
    """Asserts that observations agree bit for bit."""
    assert len(first) == len(second)
    for a, b in zip(first, second, strict=True):
        assert a.keys() == b.keys()
        for name in a:
            np.testing.assert_array_equal(a[name], b[name], err_msg=name)
