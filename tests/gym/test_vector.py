"""The environment in processes side by side."""

from typing import Any

import numpy as np

from drake_dress.gym import make_vec
from tests.gym.small import COARSE, assert_same, episode, small_env


def test_another_process_gives_the_same_bits() -> None:
    envs = make_vec(2, overrides=COARSE)
    seeds: Any = [7, 7]  # Gymnasium types a single seed only
    try:
        rng = np.random.default_rng(7)
        seen, info = envs.reset(seed=seeds)
        together = [seen]
        for _ in range(3):
            action = rng.uniform(-0.2, 0.2, (2, 3)).astype(np.float32)
            seen, reward, *_ = envs.step(np.stack([action, action]))
            assert reward[0] == reward[1]
            together.append(seen)
    finally:
        envs.close()
    assert list(info["seed"]) == [7, 7]
    alone = episode(small_env(), seed=7, steps=3)
    for i in range(2):
        assert_same(alone, [{name: rows[i] for name, rows in seen.items()} for seen in together])
