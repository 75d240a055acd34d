"""The scenario's own controllers as a policy: what a run requests, an agent may request."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.controller_diagram import make_controller_diagram
from drake_dress.diagrams.release import release
from drake_dress.diagrams.sections.controller import local_setup
from drake_dress.gym.environment import DressingEnv
from drake_dress.gym.observations import Observation
from drake_dress.models.sides import SIDES

# Beyond an observation's time, s, which is rounded: what the controllers do at it is done then.
_ROUNDING = 1e-4


class ControllerPolicy:
    """Acts as `controller.method` of the environment's scenario says, from observations alone.

    The controllers are the systems of a run: the global one plans at its rate and with its delay,
    the local one, where the method has one, solves at its rate. They see the group `state` of an
    observation, and each act takes what they request after the local controller's delay.

    Call `reset` after each reset of the environment: a new episode may have another person and
    garment. At a control rate below the local controller's, its solves between two observations
    see the newer of the two.

    Args:
        env: with the group `state` among its observations, and an episode begun; wrapped or not.

    Raises:
        ValueError: it does not observe the state, or is no dressing.
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
        """Begins anew, with the person and garment of the environment's episode."""
        parts = self._env.parts
        self.close()
        local = local_setup(parts.setup.scenario.controller, parts.policy)
        self._has_local = local is not None
        # what the controllers request is used from their delay on
        self._delay = 0.0 if local is None else local.delay
        self._diagram = make_controller_diagram(parts)
        self._simulator = Simulator(self._diagram)
        self._root = self._simulator.get_mutable_context()
        self._begun = False

    def close(self) -> None:
        """Frees the memory of the controllers, and ends their thread."""
        if self._diagram is not None:
            del self._simulator, self._root
            release(self._diagram)
            self._diagram = None

    def act(self, observation: Observation) -> npt.NDArray[np.float32]:
        """Returns the action (2,3), m/s, that follows from an observation.

        Args:
            observation: of the episode, each once and in their order.

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
