"""Replay of a log in Drake's Meshcat, with a time slider."""

from __future__ import annotations

import signal
import time as clock
from pathlib import Path

import numpy as np
from pydrake.geometry import Mesh, Meshcat, Rgba
from pydrake.math import RigidTransform

from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.models.arm.description import link_meshes
from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES
from drake_dress.report.arm_stand import STAND_COLOR, arm_stand
from drake_dress.report.arms import arm_poses
from drake_dress.report.log import RunLog
from drake_dress.report.person_skin import logged_skin
from drake_dress.report.scene import DressingScene, show_skin
from drake_dress.report.shapes import CHAIR_COLOR, limb_pose, limb_shape
from drake_dress.report.web_page import open_page

_SKIN = Rgba(0.87, 0.70, 0.58, 1.0)
_CHAIR = Rgba(*CHAIR_COLOR, 1.0)
_ARM = Rgba(0.90, 0.91, 0.92, 1.0)
_POLL_PERIOD = 0.03  # s
_TIME_SLIDER, _PLAY_BUTTON, _STOP_BUTTON = "Time (s)", "Play / pause", "Stop"


def show_replay(path: str | Path, port: int | None = None) -> int:
    """Shows a log in Meshcat on localhost until its Stop button or Ctrl-C; returns 0.

    Args:
        path: Path of the run.h5.
        port: Port of the page; None: the first free one from 7000.

    Raises:
        UserError: The log or the port cannot be used.
    """
    try:
        return _shown(path, port)
    except OSError as error:
        raise UserError(str(path), "", f"is damaged: {error}") from error


def _shown(path: str | Path, port: int | None) -> int:
    with RunLog.open(path) as log:
        if not len(log):
            print(f"{path}: nothing was logged", flush=True)
            return 0
        if log.killed:
            print(f"{path}: was left by a run that was killed; shown is what it had written")
        with caught_interrupt() as interrupt:
            meshcat = open_page(port)
            url = meshcat.web_url()
            print(f"{path}: {log.time[-1]:.1f} s at {url} (Stop or Ctrl-C ends)", flush=True)
            replay = MeshcatReplay(meshcat, log)
            while not (replay.stopped or interrupt.wait(_POLL_PERIOD)):
                replay.update()
    # Ctrl-C is the normal way to end; other signals are not.
    return 0 if interrupt.number == signal.SIGINT else interrupt.status


class MeshcatReplay:
    """Draws the sample of a log at the time of the page's slider.

    Args:
        meshcat: Meshcat to draw in; a slider and two buttons are added to it.
        log: Log with at least one sample.

    Attributes:
        sample: Index of the sample shown.
        scene: Scene that draws garment, grippers and stages.
    """

    def __init__(self, meshcat: Meshcat, log: RunLog) -> None:
        self._meshcat = meshcat
        self._log = log
        self._skin = logged_skin(log, drawn_in=False)
        self.scene = DressingScene(meshcat, np.asfortranarray(log.faces.T), "dressing")
        self.sample = -1
        self._playing = False
        self._clicks = 0
        self._last_update = clock.monotonic()
        start, end = float(log.time[0]), float(log.time[-1])
        step = max(1e-3, (end - start) / 1000.0)
        self._end = end
        # A slider needs a range even if the log has a single sample.
        meshcat.AddSlider(
            _TIME_SLIDER, start, max(end, start + step), step, start, "ArrowLeft", "ArrowRight"
        )
        meshcat.AddButton(_PLAY_BUTTON, "Space")
        meshcat.AddButton(_STOP_BUTTON, "Escape")
        meshcat.SetProperty("/Background", "top_color", [0.93, 0.95, 0.97])
        meshcat.SetProperty("/Background", "bottom_color", [1.0, 1.0, 1.0])
        self._add_bodies()
        center = log.joint_position[0].mean(axis=0)
        meshcat.SetCameraPose(center + [2.2, 1.0, 0.5], center)
        self.update()

    @property
    def stopped(self) -> bool:
        """Whether the Stop button was pressed."""
        return self._meshcat.GetButtonClicks(_STOP_BUTTON) > 0

    def update(self) -> None:
        """Advances time while playing; draws the sample nearest to the slider if it has changed."""
        now = clock.monotonic()
        passed, self._last_update = now - self._last_update, now
        clicks = self._meshcat.GetButtonClicks(_PLAY_BUTTON)
        if clicks != self._clicks:
            self._playing = not self._playing
            self._clicks = clicks
        time = self._meshcat.GetSliderValue(_TIME_SLIDER)
        if self._playing:
            time = time + passed if time < self._end else float(self._log.time[0])
            self._meshcat.SetSliderValue(_TIME_SLIDER, min(time, self._end))
        sample = int(np.argmin(np.abs(self._log.time - time)))
        if sample != self.sample:
            self._show(sample)
            self.sample = sample

    def _add_bodies(self) -> None:
        a, b, radius = self._log.capsules
        for k, (r_a, r_b) in enumerate(radius):
            shape, _ = limb_shape(a[0, k], b[0, k], (float(r_a), float(r_b)))
            color = _CHAIR if self._log.of_chair[k] else _SKIN
            self._meshcat.SetObject(f"dressing/person/{k}", shape, color)
        poses = arm_poses(self._log, np.array([0]))[0]
        for arm, base in enumerate(poses[:, 0]):
            self._add_stand(f"dressing/arms/{arm}/stand", base)
            for k, meshes in enumerate(link_meshes()):
                for j, (path, X_LM) in enumerate(meshes):
                    name = f"dressing/arms/{arm}/{k}/{j}"
                    self._meshcat.SetObject(name, Mesh(str(path)), _ARM)
                    self._meshcat.SetTransform(name, RigidTransform(X_LM))

    def _add_stand(self, name: str, base: FloatArray) -> None:
        """Adds the column from the floor, at z = 0, to an arm's base X_WB (4,4)."""
        stand = arm_stand(RigidTransform(base))
        if stand is not None:
            shape, pose = stand
            self._meshcat.SetObject(name, shape, Rgba(*STAND_COLOR, 1.0))
            self._meshcat.SetTransform(name, pose)

    def _show(self, i: int) -> None:
        log = self._log
        self.scene.show_garment(log.garment_position(i))
        self.scene.show_grippers(np.stack([log.gripper_position[side][i] for side in SIDES]))
        self.scene.show_stage(log.stage[i])
        if log.forecast is not None:
            self.scene.show_forecast(log.forecast.joint_position[i], log.forecast.radius[i])
        first, second, _ = log.capsules
        for k, (a, b) in enumerate(zip(first[i], second[i], strict=True)):
            self._meshcat.SetTransform(f"dressing/person/{k}", limb_pose(a, b))
        if self._skin is not None and self._skin.is_known(i):
            show_skin(self._meshcat, "dressing/skin", self._skin.vertices(i), self._skin.faces)
        for arm, poses in enumerate(arm_poses(log, np.array([i]))[0]):
            for k, X in enumerate(poses):
                self._meshcat.SetTransform(f"dressing/arms/{arm}/{k}", RigidTransform(X))
