"""The scenario's own controllers as a policy for the environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.assemble import control_setup
from drake_dress.diagrams.controller_diagram import make_controller_diagram
from drake_dress.diagrams.release import release
from drake_dress.gym.environment import DressingEnv
from drake_dress.gym.observations import Observation
from drake_dress.models.sides import SIDES

# Time by which the controllers are advanced past an observation's rounded time, s, so that their
# events at that time are done.
_ROUNDING = 1e-4


class ControllerPolicy:
    """Acts like `controller.method` of the environment's scenario, from observations alone.

    The controllers are the systems of a run. The global controller plans at its rate and with its
    delay; the local controller, if the method has one, solves at its rate. They receive the group
    `state` of an observation. `act` returns what they request after the local controller's delay.

    Call `reset` after each reset of the environment, since a new episode may have another person
    and garment. If the control rate is below the local controller's, its solves between two
    observations use the newer one.

    Args:
        env: environment, wrapped or not, that observes the group `state` and has been reset.

    Raises:
        ValueError: `env` is not a `DressingEnv`, or does not observe the group `state`.
    """

    def __init__(self, env: gymnasium.Env[Observation, npt.NDArray[np.float32]]) -> None:
        inner = env.unwrapped
        if not isinstance(inner, DressingEnv):
            raise ValueError(f"env is a {type(inner).__name__}, expected a DressingEnv")
        if "garment_position" not in inner.observation_space.spaces:
            raise ValueError("env does not observe the group state, which the controllers see")
        self._env = inner
        self._diagram: Any = None
        self.reset()

    def reset(self) -> None:
        """Restarts the controllers with the person and garment of the environment's episode."""
        self.close()
        control = control_setup(self._env.parts)
        local = control.local
        self._has_local = local is not None
        # requests take effect after the local controller's delay
        self._delay = 0.0 if local is None else local.delay
        self._diagram = make_controller_diagram(control)
        self._simulator = Simulator(self._diagram)
        self._root = self._simulator.get_mutable_context()
        self._begun = False

    def close(self) -> None:
        """Frees the memory of the controllers and ends their thread."""
        if self._diagram is not None:
            del self._simulator, self._root
            release(self._diagram)
            self._diagram = None

    def act(self, observation: Observation) -> npt.NDArray[np.float32]:
        """Returns the controllers' action (2,3), m/s, for an observation.

        Args:
            observation: next observation of the episode; pass each one once and in order.

        Raises:
            ValueError: the policy is closed.
        """
        if self._diagram is None:
            raise ValueError("the policy is closed, expected reset() first")
        self._fix("joint_position", observation["joint_position"])
        for name in ("garment_position", "garment_velocity"):
            self._fix(name, observation[name])
        if self._has_local:
            for i, side in enumerate(SIDES):
                self._fix(f"{side}_gripper_position", observation["gripper_position"][i])
        if not self._begun:
            self._simulator.Initialize()
            self._begun = True
        self._simulator.AdvanceTo(float(observation["time"][0]) + self._delay + _ROUNDING)
        requests = [
            self._diagram.GetOutputPort(f"{side}_velocity_request").Eval(self._root)
            for side in SIDES
        ]
        return np.array(requests, dtype=np.float32)

    def _fix(self, name: str, values: npt.NDArray[np.float32]) -> None:
        self._diagram.GetInputPort(name).FixValue(self._root, values.astype(np.float64).ravel())
