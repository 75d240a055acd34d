"""Observations of an agent: names, shapes, bounds and sources.

All positions are in the world frame W (z up, the person faces +x), SI units, left before right.
Observations are the inputs of the scenario's own controllers: estimates of garment and person, and
measurements of the grippers. The only exceptions are the forces on the person, which exist only in
simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from drake_dress.diagrams.scenario.schema import Camera
from drake_dress.gym.world import World
from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.progress import SleeveGauge
from drake_dress.models.dressing.stages import StageState

GROUPS = ("state", "force", "color", "depth")
Observation = dict[str, Any]

# Bounds of the spaces, to which values are clipped. A dressing stays far inside them.
_FARTHEST = 10.0  # m
_FASTEST = 10.0  # m/s
_STRONGEST = 1000.0  # N
_MOST_LINKED = 8
# Depth beyond which a camera measures nothing, m; see `diagrams/cameras.py`.
_DEEPEST = 5.0


class Observer:
    """Reads observations from a world.

    Args:
        groups: observed groups, some of `GROUPS`.
        node_count: number m of nodes of the controller's garment.
        cameras: cameras whose images are observed.
        duration: duration of an episode, s.
    """

    def __init__(
        self,
        groups: Sequence[str],
        node_count: int,
        cameras: Sequence[Camera],
        duration: float,
    ) -> None:
        self._groups = tuple(groups)
        self._cameras = tuple(cameras)
        bounds: dict[str, spaces.Space[Any]] = {}
        if "state" in groups:
            bounds |= _state_spaces(node_count, duration)
        if "force" in groups:
            bounds["gripper_force"] = _box(_STRONGEST, (2, 3))
            bounds["person_force"] = _box(_STRONGEST, (3,))
            bounds["contact_force"] = _box(_STRONGEST, (1,), 0.0)
        for camera in cameras:
            size = (camera.height, camera.width)
            if "color" in groups:
                bounds[f"{camera.name}_color"] = spaces.Box(0, 255, (*size, 3), np.uint8)
            if "depth" in groups:
                bounds[f"{camera.name}_depth"] = _box(_DEEPEST, (*size, 1), 0.0)
        self.space = spaces.Dict(bounds)

    def begin(self, world: World) -> None:
        """Starts an episode; call this before `read`."""
        self._world = world
        self._gauge = SleeveGauge(world.belief)
        self._stages = StageState()
        self._looks = 0

    def read(self, time_on: float) -> Observation:
        """Returns the current observation.

        Args:
            time_on: time for which both sleeves have stayed on, s.
        """
        seen: Observation = {}
        if "state" in self._groups:
            seen |= self._state(time_on)
        if "force" in self._groups:
            seen |= self._force()
        for camera in self._cameras:
            if "color" in self._groups:
                image = self._world.image(f"{camera.name}.color_image")
                seen[f"{camera.name}_color"] = np.ascontiguousarray(image[:, :, :3])
            if "depth" in self._groups:
                # depth is infinite where nothing is in range
                depth = self._world.image(f"{camera.name}.depth_image").astype(np.float32)
                seen[f"{camera.name}_depth"] = np.clip(depth, 0.0, _DEEPEST)
        return seen

    def _state(self, time_on: float) -> Observation:
        world = self._world
        x, joints = world.value("estimate.garment_position"), world.value("estimate.joint_position")
        sleeves = self._gauge.measure(x, joints)
        self._update_stages(x, joints)
        return {
            "garment_position": self._fitted("garment_position", x),
            "garment_velocity": self._fitted(
                "garment_velocity", world.value("estimate.garment_velocity")
            ),
            "joint_position": self._fitted("joint_position", joints),
            "gripper_position": self._fitted("gripper_position", world.grippers("position")),
            "gripper_velocity": self._fitted("gripper_velocity", world.grippers("velocity")),
            "dressing": self._fitted("dressing", sleeves.coordinates),
            "linking": np.clip(sleeves.linking, -_MOST_LINKED, _MOST_LINKED).astype(np.int32),
            "stage": np.array([int(stage) for stage in self._stages.stage]),
            "time": self._fitted("time", np.array([world.time])),
            "time_on": self._fitted("time_on", np.array([time_on])),
        }

    def _force(self) -> Observation:
        contact = -self._world.value("cheat_contact_force")
        size = np.linalg.norm(contact, axis=1).sum()
        return {
            "gripper_force": self._fitted("gripper_force", self._world.grippers("force")),
            "person_force": self._fitted("person_force", contact.sum(axis=0)),
            "contact_force": self._fitted("contact_force", np.array([size])),
        }

    def _update_stages(self, x: FloatArray, joints: FloatArray) -> None:
        """Updates the stages at the rate of the scenario's global controller."""
        parts, now = self._world.parts, self._world.time
        if now < self._looks * parts.setup.scenario.controller.global_mpc.period - 1e-9:
            return
        self._looks += 1
        self._stages, _ = parts.policy.planner.assign(self._stages, x, joints, now)

    def _fitted(self, name: str, values: FloatArray) -> npt.NDArray[np.float32]:
        box = self.space[name]
        assert isinstance(box, spaces.Box)
        return np.clip(values, box.low, box.high).astype(np.float32)


def _state_spaces(node_count: int, duration: float) -> dict[str, spaces.Space[Any]]:
    dressed = np.tile(np.array([2.0, _FARTHEST, np.pi], dtype=np.float32), (2, 1))
    least = np.tile(np.array([0.0, 0.0, -np.pi], dtype=np.float32), (2, 1))
    return {
        "garment_position": _box(_FARTHEST, (node_count, 3)),
        "garment_velocity": _box(_FASTEST, (node_count, 3)),
        "joint_position": _box(_FARTHEST, (6, 3)),
        "gripper_position": _box(_FARTHEST, (2, 3)),
        "gripper_velocity": _box(_FASTEST, (2, 3)),
        "dressing": spaces.Box(least, dressed, dtype=np.float32),
        "linking": spaces.Box(-_MOST_LINKED, _MOST_LINKED, (2,), np.int32),
        "stage": spaces.MultiDiscrete([3, 3]),
        "time": _box(duration, (1,), 0.0),
        "time_on": _box(duration, (1,), 0.0),
    }


def _box(high: float, shape: tuple[int, ...], low: float | None = None) -> spaces.Box:
    return spaces.Box(-high if low is None else low, high, shape, np.float32)
