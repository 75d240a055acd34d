"""One simulated dressing for an agent, from a scenario with its variation drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.agent_diagram import make_agent_diagram
from drake_dress.diagrams.arms import ArmReachError
from drake_dress.diagrams.assemble import Parts, parts
from drake_dress.diagrams.garment import build_garment_like
from drake_dress.diagrams.release import release
from drake_dress.diagrams.scenario import Scenario, apply_variation
from drake_dress.diagrams.setup import Garments, read_setup
from drake_dress.errors import UserError
from drake_dress.gym.reward import Loads
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.control.safety import Verdict
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class Advance:
    """Result of simulating one control step.

    Attributes:
        loads: forces during the step.
        verdict: (2,) flags that the safety governor set during the step, for left and right.
        fault: why the simulation cannot continue; None if it can.
    """

    loads: Loads
    verdict: IntArray
    fault: str | None = None

    @property
    def stopped(self) -> bool:
        """Whether the governor stopped the grippers because a force was too high for too long."""
        return bool(np.any(self.verdict & int(Verdict.STOPPED)))


class World:
    """The diagram of a drawn scenario, and its simulator.

    Args:
        drawn: scenario with its variation drawn.
        nominal: scenario before the draw; its controller's mesh is shared by all draws.
        source: file of the scenario.

    Raises:
        UserError: the garment or the arms cannot be used, or the grippers start where they must
            not be.
    """

    def __init__(self, drawn: Scenario, nominal: Scenario, source: Path) -> None:
        self._drawn = drawn
        self.parts = _parts(drawn, nominal, source)
        self._agent = make_agent_diagram(self.parts)
        self._station = self.parts.station.diagram
        self._plant_period = drawn.plant.time_step
        self._command = self._agent.diagram.GetInputPort("velocity")
        self._simulator = Simulator(self._agent.diagram)
        self._steps = 0
        self.restart()

    def restart(self) -> None:
        """Restarts the simulation with the same drawn scenario."""
        self._simulator.reset_context(self._agent.diagram.CreateDefaultContext())
        self._root = self._simulator.get_mutable_context()
        self._inside = self._station.GetMyContextFromRoot(self._root)
        self._command.FixValue(self._root, np.zeros(6))
        self._simulator.Initialize()
        self._steps = 0

    def close(self) -> None:
        """Frees the memory of the diagram; the world cannot be used afterwards."""
        diagram = self._agent.diagram
        # simulator and contexts first: they use the diagram
        self.__dict__.clear()
        release(diagram)

    def is_of(self, drawn: Scenario) -> bool:
        """Returns whether this is the world of a drawn scenario, so that it can be restarted.

        The seed itself must match only if the run draws from it later, as a tremor does.
        """
        own = self._drawn
        draws = own.person.behaviour.tremor is not None
        return replace(drawn, seed=own.seed) == own and (drawn.seed == own.seed or not draws)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._steps * self._plant_period

    @property
    def truth(self) -> GarmentMesh:
        """The plant's garment at rest."""
        return self.parts.garments.plant

    @property
    def belief(self) -> GarmentMesh:
        """The controller's garment at rest."""
        return self.parts.garments.belief

    def value(self, port: str) -> FloatArray:
        """Returns a copy of the value of a vector port of the station, in rows of three."""
        values = self._station.GetOutputPort(port).Eval(self._inside)
        return np.array(values, dtype=np.float64).reshape(-1, 3)

    def grippers(self, quantity: str) -> FloatArray:
        """Returns (2,3) measured `position`, `velocity` or `force` of both grippers; SI units."""
        ports = [f"{side}_gripper.{quantity}_measured" for side in SIDES]
        return np.concatenate([self.value(port) for port in ports])

    def image(self, port: str) -> npt.NDArray[np.generic]:
        """Returns a copy of the camera image (height, width, channels) at a port of the station."""
        return np.array(self._station.GetOutputPort(port).Eval(self._inside).data)

    def advance(self, velocity: FloatArray, steps: int) -> Advance:
        """Simulates plant steps with a constant velocity request.

        Args:
            velocity: (2,3) requested velocity of left and right gripper, m/s.
            steps: number of plant steps.
        """
        self._command.FixValue(self._root, velocity.ravel())
        pull, contact = np.zeros((steps, 2)), np.zeros(steps)
        verdict = np.zeros(2, dtype=np.int32)
        governor = self._agent.governor
        asked = governor.GetOutputPort("verdict")
        fault: str | None = None
        for k in range(steps):
            self._steps += 1
            try:
                self._simulator.AdvanceTo(self.time)
            except ValueError as error:
                # the garment's step raises it if nodes are not finite
                fault = " ".join(str(error).split())
                break
            pull[k] = np.linalg.norm(self.grippers("force"), axis=1)
            contact[k] = np.linalg.norm(self.value("cheat_contact_force"), axis=1).sum()
            at = governor.GetMyContextFromRoot(self._root)
            verdict |= asked.Eval(at).astype(np.int32)
            fault = self.parts.station.fault(self._root)
            if fault is not None:
                break
        return Advance(Loads(pull, contact, self._plant_period), verdict, fault)


def draw(nominal: Scenario, seed: int) -> Scenario:
    """Returns the scenario of an episode, with the variation that its seed draws."""
    return apply_variation(replace(nominal, seed=seed))


def _parts(drawn: Scenario, nominal: Scenario, source: Path) -> Parts:
    setup = read_setup(drawn, source)
    belief = build_garment_like(
        drawn.garment, nominal.garment, nominal.controller.spacing, source.parent
    )
    try:
        return parts(replace(setup, garments=Garments(setup.garments.plant, belief)))
    except ArmReachError as error:
        raise UserError(str(source), "station.arms", f"seed {drawn.seed}: {error}") from error
