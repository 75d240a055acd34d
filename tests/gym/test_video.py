"""Episode videos, by Gymnasium's own wrapper."""

from pathlib import Path

import imageio_ffmpeg
import numpy as np
from gymnasium.wrappers import RecordVideo

from tests.gym.small import small_env


def test_a_recorded_episode_has_a_frame_for_each_observation(tmp_path: Path) -> None:
    env = RecordVideo(
        small_env(
            ["duration=0.4"], control_rate=10.0, render_mode="rgb_array", render_size=(64, 48)
        ),
        str(tmp_path / "videos"),
        episode_trigger=lambda _: True,
    )
    env.reset(seed=0)
    truncated = False
    while not truncated:
        *_, truncated, _ = env.step(np.full((2, 3), 0.2, dtype=np.float32))
    env.close()
    (file,) = (tmp_path / "videos").glob("*.mp4")
    frames = imageio_ffmpeg.read_frames(str(file))
    meta = next(frames)
    assert meta["size"] == (64, 48)
    assert meta["fps"] == 10.0
    pictures = [np.frombuffer(frame, np.uint8).astype(int) for frame in frames]
    assert len(pictures) == 5
    # the coat moves
    assert np.abs(pictures[0] - pictures[-1]).max() > 50
