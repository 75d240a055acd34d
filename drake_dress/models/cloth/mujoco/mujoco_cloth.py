"""Steps a garment in MuJoCo, with the interface of the other integrators."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import HELD
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.finite import explain_not_finite
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.bodies import check_shapes, shapes_of
from drake_dress.models.cloth.mujoco.settings import (
    DEFAULT_SETTINGS,
    MujocoSettings,
    import_mujoco,
)
from drake_dress.models.cloth.mujoco.simulator import MujocoInfo, Simulator
from drake_dress.models.cloth.state import (
    GRAVITY,
    NO_ADDITIONS,
    Additions,
    ClothState,
    SteppedCloth,
)


class MujocoCloth(SteppedCloth):
    """A garment as MuJoCo's flex: its elasticity, contact, friction and self-collision.

    The step is a function of its arguments alone: positions and velocities of all nodes and bodies
    and the solver's warm start are set before each. Held nodes and bodies move as prescribed
    (`bodies.py`). Compared with `ImplicitCloth`, cloth under compression does not buckle below the
    mesh size, contact and friction are slightly soft, edges touch the person and not only
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
        # made at the first step, for the bodies that it has, and anew for others
        self._simulator: Simulator | None = None

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
        check_shapes(obstacles)
        shapes = shapes_of(obstacles)
        if self._simulator is None or not np.array_equal(self._simulator.shapes, shapes):
            self._simulator = Simulator(self, self._settings, shapes)
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
