"""Brings the left armhole to its hand by a proportional policy: gym_episode.py [VIDEO_FOLDER]."""

import sys
from typing import Any

import gymnasium
import numpy as np
from gymnasium.wrappers import RecordVideo

import drake_dress.gym

GAIN, FASTEST, LEFT_HAND = 1.0, 0.1, 2  # 1/s, m/s, row of joint_position


def main(video: list[str]) -> None:
    """Runs an episode of 3 s and prints the final distance of the armhole from the hand."""
    env: gymnasium.Env = gymnasium.make(
        drake_dress.gym.ENV_ID,
        scenario="dummy_varied",
        overrides=["plant.fidelity=quick", "duration=3"],
        control_rate=25.0,
        render_mode="rgb_array" if video else None,
    )
    if video:
        env = RecordVideo(env, video[0])
    seen, _ = env.reset(seed=1)
    world: Any = env.unwrapped
    armhole = world.parts.garments.belief.loops["left_armhole"]
    total, ended = 0.0, False
    while not ended:
        way = seen["joint_position"][LEFT_HAND] - seen["garment_position"][armhole].mean(axis=0)
        velocity = np.clip(GAIN * way, -FASTEST, FASTEST)  # for both, to keep the coat's shape
        seen, reward, terminated, truncated, _ = env.step(np.tile(velocity, (2, 1)))
        total, ended = total + float(reward), terminated or truncated
    print(f"armhole {100.0 * np.linalg.norm(way):.0f} cm from the hand, reward {total:+.3f}")
    env.close()


if __name__ == "__main__":
    main(sys.argv[1:])
