"""One garment among bodies in MuJoCo: its model, and a step from a given state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.matrices import bending_bound, stretch_matrix
from drake_dress.models.cloth.mujoco.approach import stop_at_the_surface
from drake_dress.models.cloth.mujoco.bodies import HEAVY, Bodies
from drake_dress.models.cloth.mujoco.garment import model_xml, touching_edges
from drake_dress.models.cloth.mujoco.settings import MujocoSettings, import_mujoco
from drake_dress.models.cloth.mujoco.touching import Touching, touching
from drake_dress.models.cloth.state import ClothState, SteppedCloth

# Share of the inertia that the implicit integration of the fabric adds on which contact counts.
# With none, a sleeve of 1500 N/m that is pulled over a forearm with 15 N sinks in by 10 mm, with
# this share by 3 mm, in equally many iterations. With five times as much the solver takes three
# times as many.
_SHARE = 0.012


@dataclass(frozen=True)
class MujocoInfo:
    """Information on the solve of a step: contacts, and iterations of the constraint solver."""

    contacts: int
    iterations: int


class Simulator:
    """MuJoCo's model and data of a garment among bodies.

    Args:
        cloth: the garment.
        settings: solver settings.
        shapes: (count,3) of the bodies, from `shapes_of`.
    """

    def __init__(self, cloth: SteppedCloth, settings: MujocoSettings, shapes: FloatArray) -> None:
        self._mujoco = mujoco = import_mujoco()
        # Warnings would go to a log file in the current folder; MjData counts them.
        mujoco.set_mju_user_warning(lambda message: None)
        self.shapes = shapes
        e, held = cloth.elements, cloth.held
        self._rest, self._held, self._h = e.rest_position, held, cloth.time_step
        self._friction = cloth.material.friction
        self._edge = touching_edges(e, held)
        self._model: Any = mujoco.MjModel.from_xml_string(
            model_xml(e, cloth.material, held, self._h, cloth.gravity, settings, shapes)
        )
        self._data: Any = mujoco.MjData(self._model)
        self._bodies = Bodies(self._model, shapes)
        nodes = self._model.flex_vertbodyid[: e.node_count]
        axes = np.arange(3)
        self._dof = self._model.body_dofadr[nodes][:, None] + axes
        self._q = self._model.jnt_qposadr[self._model.body_jntadr[nodes]][:, None] + axes
        self._set_masses(cloth, nodes)

    def _set_masses(self, cloth: SteppedCloth, nodes: npt.NDArray[np.integer]) -> None:
        """Sets the masses of the nodes, and what holds up the heavy bodies."""
        mass = cloth.mass.copy()
        mass[self._held] = HEAVY
        self._model.body_mass[nodes] = mass
        self._mujoco.mj_setConst(self._model, self._data)
        self._model.body_invweight0[nodes, 0] = 1.0 / _contact_inertia(cloth, mass)
        # Tolerances are relative to the mean inertia, which the heavy bodies would distort.
        self._model.stat.meaninertia = float(np.median(cloth.mass))
        self._support = np.zeros(self._model.nv)
        self._support[self._bodies.linear] = -HEAVY * cloth.gravity
        self._support[self._dof[self._held]] = -HEAVY * cloth.gravity

    def advance(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        force: FloatArray | None,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns positions and velocities (n,3) after a step, and the cloth's pull on held nodes.

        Args:
            state: present state.
            obstacles: bodies at the start of the step.
            held_velocity: (k,3) m/s.
            force: (n,3) further forces on the nodes, N, if any.

        Raises:
            ValueError: there are more contacts than fit in memory.
        """
        mujoco, data = self._mujoco, self._data
        # so that nothing of an earlier step is left
        mujoco.mj_resetData(self._model, data)
        self._bodies.place(self._model, data, obstacles)
        data.qpos[self._q] = state.x - self._rest
        start = state.v.copy()
        start[self._held] = held_velocity
        data.qvel[self._dof] = start
        data.qacc_warmstart[self._dof] = state.acceleration
        data.qfrc_applied[:] = self._support
        if force is not None:
            given = force.copy()
            given[self._held] = 0.0
            data.qfrc_applied[self._dof] += given
        mujoco.mj_step1(self._model, data)
        stop_at_the_surface(data, self._h)
        mujoco.mj_step2(self._model, data)
        full = (mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL)
        if any(data.warning[kind].number for kind in full):
            raise ValueError(f"MuJoCo has no memory for {data.ncon} contacts or more")
        v = data.qvel[self._dof]
        pull = HEAVY * (v[self._held] - held_velocity) / self._h
        x = self._rest + data.qpos[self._q]
        x[self._held], v[self._held] = state.x[self._held] + self._h * held_velocity, held_velocity
        return x, v, pull

    def touching(self) -> Touching:
        """Returns the contact of nodes and bodies in the last step."""
        return touching(
            self._mujoco, self._model, self._data, self._dof, self._edge, self._friction
        )

    def info(self) -> MujocoInfo:
        """Returns information on the last step."""
        return MujocoInfo(int(self._data.ncon), int(self._data.solver_niter[0]))


def _contact_inertia(cloth: SteppedCloth, mass: FloatArray) -> FloatArray:
    """Returns (n,) the inertia of the nodes to which the compliance of contact is related, kg.

    MuJoCo takes the mass. The fabric is integrated implicitly, which adds h (h + damping) K to the
    inertia with which a node resists, thousands of times its mass.
    """
    e, m, h = cloth.elements, cloth.material, cloth.time_step
    stiffness = stretch_matrix(e, m).diagonal() + bending_bound(e, m).diagonal()
    inertia: FloatArray = mass + _SHARE * h * (h + m.damping) * stiffness
    return inertia
