"""Steps a garment in MuJoCo, with the interface of the other integrators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import HELD
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.finite import explain_not_finite
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import bending_bound, stretch_matrix
from drake_dress.models.cloth.mujoco.bodies import HEAVY, Bodies, check_shapes
from drake_dress.models.cloth.mujoco.garment import model_xml
from drake_dress.models.cloth.mujoco.settings import (
    DEFAULT_SETTINGS,
    MujocoSettings,
    import_mujoco,
)
from drake_dress.models.cloth.mujoco.touching import Touching, touching
from drake_dress.models.cloth.state import (
    GRAVITY,
    NO_ADDITIONS,
    Additions,
    ClothState,
    SteppedCloth,
)

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


class MujocoCloth(SteppedCloth):
    """A garment as MuJoCo's flex: its elasticity, contact, friction and self-collision.

    The step is a function of its arguments alone: positions and velocities of all nodes and bodies
    and the solver's warm start are set before each. Held nodes and bodies move as prescribed
    (`bodies.py`). Compared with `ImplicitCloth`, cloth under compression does not buckle below the
    mesh size, contact and friction are slightly soft, triangles touch the person and not only
    nodes, and layers keep twice the margin apart. Layers that approach by more than 4 mm in a step
    may pass through each other, and are not led back. There are no derivatives.

    Args:
        elements: rest shape, from `make_elements`.
        material: fabric.
        time_step: h, s.
        held: (k,) nodes whose motion is prescribed.
        gravity: (3,) m/s².
        additions: permanent additions of effects, without fibres.
        settings: solver settings.

    Raises:
        UserError: MuJoCo is not installed.
        ValueError: fibres are added.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material,
        time_step: float,
        held: npt.NDArray[np.integer],
        gravity: FloatArray = GRAVITY,
        additions: Additions = NO_ADDITIONS,
        settings: MujocoSettings = DEFAULT_SETTINGS,
    ) -> None:
        super().__init__(elements, material, time_step, held, gravity, additions)
        if additions.fibres is not None:
            raise ValueError("MuJoCo's fabric is isotropic, expected no fibres")
        import_mujoco()
        self._settings = settings
        # made at the first step, for the number of bodies that it has
        self._simulator: _Simulator | None = None

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, MujocoInfo]:
        """Returns the state one time step later, and information on the solve.

        Args:
            state: present state.
            obstacles: the person at the start of the step, with velocities.
            held_velocity: (k,3) velocity of the held nodes over this step, m/s.
            influences: forces on the nodes; nothing else is supported.
            guess: not used.

        Raises:
            ValueError: an input is not finite, or is not supported; the message names it.
        """
        _check_influences(influences)
        if self._simulator is None or self._simulator.body_count != obstacles.count:
            check_shapes(obstacles)
            self._simulator = _Simulator(self, self._settings, obstacles.count)
        finite = np.isfinite(state.x).all() and np.isfinite(state.v).all()
        if not (finite and np.isfinite(held_velocity).all()):
            explain_not_finite(state.x, state.v, held_velocity, self.held)
        x, v, pull = self._simulator.advance(state, obstacles, held_velocity, influences.force)
        if not np.isfinite(x).all():
            explain_not_finite(state.x, state.v, held_velocity, self.held)
        found = self._simulator.touching()
        reaction, mode, owner = found.force, found.mode, found.owner
        # a gripper moves the node's own mass, and bears what cloth and other forces do to it
        acceleration = (held_velocity - state.v[self.held]) / self.time_step - self.gravity
        reaction[self.held] = self.mass[self.held, None] * acceleration - pull
        if influences.force is not None:
            reaction[self.held] -= influences.force[self.held]
        mode[self.held], owner[self.held] = HELD, -1
        gained = (v - state.v) / self.time_step
        gained[self.held] = 0.0
        after = ClothState(x, v, mode, reaction, owner, state.solver, state.tangled, gained)
        return after, self._simulator.info()


def _check_influences(given: Influences) -> None:
    for name in ("friction", "adhesion", "stretch_factor", "bonds"):
        if getattr(given, name) is not None:
            raise ValueError(f"MuJoCo's garment has no {name} that differs from node to node")


def _contact_inertia(cloth: MujocoCloth, mass: FloatArray) -> FloatArray:
    """Returns (n,) the inertia of the nodes to which the compliance of contact is related, kg.

    MuJoCo takes the mass. The fabric is integrated implicitly, which adds h (h + damping) K to the
    inertia with which a node resists, thousands of times its mass.
    """
    e, m, h = cloth.elements, cloth.material, cloth.time_step
    stiffness = stretch_matrix(e, m).diagonal() + bending_bound(e, m).diagonal()
    inertia: FloatArray = mass + _SHARE * h * (h + m.damping) * stiffness
    return inertia


class _Simulator:
    """MuJoCo's model and data of a garment among `body_count` bodies."""

    def __init__(self, cloth: MujocoCloth, settings: MujocoSettings, body_count: int) -> None:
        self._mujoco = mujoco = import_mujoco()
        # Warnings would go to a log file in the current folder; MjData counts them.
        mujoco.set_mju_user_warning(lambda message: None)
        self.body_count = body_count
        e, held = cloth.elements, cloth.held
        self._rest, self._held, self._h = e.rest_position, held, cloth.time_step
        self._friction = cloth.material.friction
        self._triangle = e.triangle[~np.isin(e.triangle, held).any(axis=1)]
        self._model: Any = mujoco.MjModel.from_xml_string(
            model_xml(e, cloth.material, held, self._h, cloth.gravity, settings, body_count)
        )
        self._data: Any = mujoco.MjData(self._model)
        self._bodies = Bodies(self._model, body_count)
        nodes = self._model.flex_vertbodyid[: e.node_count]
        axes = np.arange(3)
        self._dof = self._model.body_dofadr[nodes][:, None] + axes
        self._q = self._model.jnt_qposadr[self._model.body_jntadr[nodes]][:, None] + axes
        self._set_masses(cloth, nodes)

    def _set_masses(self, cloth: MujocoCloth, nodes: npt.NDArray[np.integer]) -> None:
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
        """
        mujoco, data = self._mujoco, self._data
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
        mujoco.mj_step(self._model, data)
        v = data.qvel[self._dof]
        pull = HEAVY * (v[self._held] - held_velocity) / self._h
        x = self._rest + data.qpos[self._q]
        x[self._held], v[self._held] = state.x[self._held] + self._h * held_velocity, held_velocity
        return x, v, pull

    def touching(self) -> Touching:
        """Returns the contact of nodes and bodies in the last step."""
        return touching(
            self._mujoco, self._model, self._data, self._dof, self._triangle, self._friction
        )

    def info(self) -> MujocoInfo:
        """Returns information on the last step."""
        return MujocoInfo(int(self._data.ncon), int(self._data.solver_niter[0]))
