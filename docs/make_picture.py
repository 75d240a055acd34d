"""Makes the README picture from a log: python docs/make_picture.py run.h5 OUT.png [TIME …]."""

from __future__ import annotations

import sys

import matplotlib.image
import numpy as np

from drake_dress.report.arms import arm_poses
from drake_dress.report.log import RunLog
from drake_dress.report.stills import CameraPose, render_still

SIZE = (400, 480)


def main(arguments: list[str]) -> None:
    """Renders the log at the given times, s, side by side; three even times without any."""
    path, picture, *times = arguments
    with RunLog.open(path) as log:
        wanted = [float(t) for t in times] or list(np.linspace(0.0, log.time[-1], 3))
        a, b, radius = log.capsules
        frames = []
        for t in wanted:
            i = int(np.argmin(np.abs(log.time - t)))
            target = log.joint_position[i].mean(axis=0) - [0.1, 0.0, 0.1]
            eye = target + 3.3 * np.array([0.35, 0.92, 0.25])
            frames.append(
                render_still(
                    log.faces,
                    log.garment_position(i),
                    (a[i], b[i], radius),
                    np.stack([log.gripper_position[side][i] for side in ("left", "right")]),
                    CameraPose(tuple(eye), tuple(target)),
                    SIZE,
                    arms=arm_poses(log, np.array([i]))[0],
                )
            )
    matplotlib.image.imsave(picture, np.concatenate(frames, axis=1))


if __name__ == "__main__":
    main(sys.argv[1:])
