"""The one-iteration scheme of `explicit_bias` for many garments of one mesh at once.

Each garment of a batch is stepped as `ExplicitBiasCloth` steps it, contact and friction included
(see the module docstring there). What differs is how linear systems are solved. There, forces of
the contact nodes are sought, with a factor of P; here, motions of all nodes: every garment has its
own contacts and may have its own fabric, so all share one inverse of P (`inverse`), and iterations
do the rest (`projected_cg` and, with friction, `oblique`). A garment without contact, in a batch of
one fabric, is solved by the inverse alone.

Kernels run on the CPU and on CUDA alike. Sums are in a fixed order, so a step repeats bit for bit,
and a garment's result does not depend on the others of its batch. A garment by itself on a CPU core
is stepped faster by `ExplicitBiasCloth`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import warp as wp

from drake_dress.models.cloth.batch import friction_kernels
from drake_dress.models.cloth.batch.adjoint import pull_back
from drake_dress.models.cloth.batch.arrays import (
    SharedTensors,
    array_out,
    kind_of,
    scalars_in,
    vectors_in,
)
from drake_dress.models.cloth.batch.bodies import Bodies, make_bodies
from drake_dress.models.cloth.batch.contact_kernels import prescribe_held
from drake_dress.models.cloth.batch.contact_step import (
    bind_change,
    bind_motion,
    find_contact,
    take_back,
)
from drake_dress.models.cloth.batch.device import find_device
from drake_dress.models.cloth.batch.element_kernels import (
    hinge_response,
    right_hand_sides,
    triangle_response,
)
from drake_dress.models.cloth.batch.engine import make_engine, solve_kinds
from drake_dress.models.cloth.batch.parameters import (
    Parameters,
    make_parameters,
    replace_parameters,
    share_one_system,
)
from drake_dress.models.cloth.batch.projected_cg import DIRECT, ITERATE, skip_where
from drake_dress.models.cloth.batch.tape import ContactTypes, Gradient, Tape
from drake_dress.models.cloth.contact.detection import ATTEMPTS
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, FloatArray, IntArray
from drake_dress.models.cloth.implicit import GRAVITY
from drake_dress.models.cloth.material import Material


@dataclass(frozen=True)
class Fabric:
    """Values (B,) that replace those of the materials for one step; None keeps a value.

    Attributes:
        stretch_stiffness: N/m. bending_stiffness: N·m. surface_density: kg/m².
        friction: dimensionless.
    """

    stretch_stiffness: Any = None
    bending_stiffness: Any = None
    surface_density: Any = None
    friction: Any = None


class BatchCloth:
    """Steps B garments of one mesh, with derivatives, in float64.

    Limits: one iteration a step; held nodes are prescribed, not on springs; capsules and
    half-spaces only; no separation of layers; no derivative by the motion of obstacles
    (`ExplicitBiasCloth` has all of these). An instance holds work arrays, some 35 vectors for each
    node: use it from one thread at a time.

    Args:
        elements: the rest shape.
        material: one for all garments, or B; then garments need conjugate gradients even without
            contact, more the farther their stiffness and density lie apart.
        time_step: h, s.
        held: (k,) nodes that move with the grippers, the same in all garments.
        batch: B.
        device: `cpu`, `cuda` or `cuda:N`.
        gravity: (3,) m/s².
        iterations: 1; the accelerated inner iteration of `ExplicitBiasCloth` is not offered.
        tolerance: relative residual at which iterations stop.
        max_iterations: after which they stop in any case.

    Raises:
        UserError: there is no such device.
        ValueError: not one or B materials, no garment, or more iterations.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material | Sequence[Material],
        time_step: float,
        held: IntArray,
        batch: int,
        device: str = "cpu",
        gravity: FloatArray = GRAVITY,
        iterations: int = 1,
        tolerance: float = 1e-4,
        max_iterations: int = 200,
    ) -> None:
        if batch < 1:
            raise ValueError(f"batch is {batch}, expected 1 or more garments")
        materials = [material] * batch if isinstance(material, Material) else list(material)
        if len(materials) != batch:
            raise ValueError(f"material has {len(materials)} entries, expected 1 or {batch}")
        if iterations != 1:
            raise ValueError(f"iterations is {iterations}, expected 1")
        self.elements = elements
        self.materials = tuple(materials)
        self.time_step = float(time_step)
        self.held = np.asarray(held, dtype=np.int32)
        self.batch = batch
        self.device = find_device(device)
        self._engine = make_engine(
            elements,
            materials,
            self.time_step,
            self.held,
            gravity,
            self.device,
            tolerance,
            max_iterations,
        )
        self._parameters = make_parameters(materials, self.device)
        self._iterate = solve_kinds(self._engine, ITERATE)
        self._base_solve = self._iterate
        if share_one_system(materials):
            self._base_solve = solve_kinds(self._engine, DIRECT)

    def bodies(self, obstacles: Obstacles | Sequence[Obstacles]) -> Bodies:
        """Returns obstacles on the device, for several steps with the same.

        Args:
            obstacles: one for all garments or one for each, of equal counts; no closed meshes.

        Raises:
            ValueError: they do not fit, see `make_bodies`.
        """
        return make_bodies(obstacles, self.batch, self.device)

    def step(
        self,
        x: Any,
        v: Any,
        held_motion: Any,
        obstacles: Obstacles | Sequence[Obstacles] | Bodies,
        types: ContactTypes | None = None,
        fabric: Fabric | None = None,
    ) -> tuple[Any, Any, Any, Tape]:
        """Returns position, velocity, reaction (B,n,3) after one step, and the tape.

        The arrays may be NumPy, torch (float64, on the device, shared if contiguous) or Warp
        (vec3d (B,n), on the device, shared); results are of the kind of `x`. The reaction is the
        mean force of person and grippers on each node over the step, N.

        Args:
            x: (B,n,3) positions, m.
            v: (B,n,3) velocities, m/s.
            held_motion: (B,k,3) displacement of the held nodes over this step, m.
            obstacles: the persons at the start of the step, with velocities.
            types: contact to hold instead of finding it (for derivative checks).
            fabric: values (B,) that replace those of the materials in this step.

        Raises:
            ValueError: an array has a wrong shape, type or device, or the obstacles do not fit.
        """
        engine, h = self._engine, self.time_step
        kind = kind_of(x)
        f = fabric or Fabric()
        shared = SharedTensors.of(
            x=x,
            v=v,
            stretch_stiffness=f.stretch_stiffness,
            bending_stiffness=f.bending_stiffness,
            surface_density=f.surface_density,
            friction=f.friction,
        )
        bodies: Any = obstacles
        if isinstance(obstacles, (Obstacles, Sequence)):
            bodies = self.bodies(obstacles)
        parameters, base_solve = self._fabric(fabric)
        p_of = [engine.system, parameters]
        shape = (self.batch, engine.node_count)
        x = vectors_in(x, "x", *shape, self.device)
        v = vectors_in(v, "v", *shape, self.device)
        held_motion = vectors_in(
            held_motion, "held_motion", self.batch, len(self.held), self.device
        )
        types = self._checked(types, bodies)
        g, pull = self._right_hand_sides(parameters, x, v)

        # without contact, then with it
        mode, prescribed, motion = engine.integers(), engine.vectors(), engine.vectors()
        engine.launch(prescribe_held, [engine.held_index, held_motion, mode, prescribed, motion])
        engine.solver.solve(parameters, base_solve, mode, g, motion)
        stick_mode, contact = wp.clone(mode), None
        found = find_contact(engine, parameters, bodies, x, motion, g, stick_mode, types)
        if found is not None:
            near, touches, spared = found
            free = motion
            for attempt in range(ATTEMPTS):
                # As much as needed is solved anew: the garments keep their numbers.
                start, followed = wp.clone(free), wp.clone(prescribed)
                contact, motion = bind_motion(
                    engine, parameters, near, touches, stick_mode, followed, v, g, start, types
                )
                everyone = attempt + 2 == ATTEMPTS
                if spared is None or attempt + 1 == ATTEMPTS:
                    break
                if not take_back(engine, near, motion, spared, stick_mode, everyone):
                    break

        # reaction and velocities
        reaction, change, x_next, v_next = (engine.vectors() for _ in range(4))
        engine.launch(
            friction_kernels.finish_motion,
            [*p_of, engine.held_index, x, v, g, motion, h, reaction, change, x_next],
        )
        kinds = base_solve
        if contact is not None:
            engine.launch(
                friction_kernels.bound_reaction,
                [*p_of, contact.near, contact.friction, g, motion, reaction, contact.multiplier],
            )
            kinds = skip_where(contact.touches, base_solve)
            bind_change(engine, parameters, contact, pull, change)
        engine.solver.solve(parameters, kinds, mode, pull, change)
        engine.launch(friction_kernels.add, [v, change, v_next])
        tape = Tape(
            kind, x, v, parameters, bodies, base_solve, mode, contact, motion, change, shared
        )
        return array_out(x_next, kind), array_out(v_next, kind), array_out(reaction, kind), tape

    def vector_jacobian_product(
        self,
        tape: Tape,
        x_bar: Any,
        v_bar: Any,
        held_reaction_bar: Any,
        by_fabric: bool = False,
    ) -> Gradient:
        """Returns the derivative of L with respect to the inputs of the taped step.

        Args:
            tape: of the step.
            x_bar: (B,n,3) ∂L/∂ of the step's positions.
            v_bar: (B,n,3) ∂L/∂ of the step's velocities.
            held_reaction_bar: (B,k,3) ∂L/∂ of the reaction at the held nodes.
            by_fabric: also by stiffnesses, density and friction of each garment.

        Raises:
            RuntimeError: a tensor that the step took was written to in place since.
            ValueError: an array has a wrong shape, type or device.
        """
        tape.shared.check()
        n, b, device = self._engine.node_count, self.batch, self.device
        x_bar = vectors_in(x_bar, "x_bar", b, n, device)
        v_bar = vectors_in(v_bar, "v_bar", b, n, device)
        reaction_bar = vectors_in(held_reaction_bar, "held_reaction_bar", b, len(self.held), device)
        return pull_back(self._engine, tape, x_bar, v_bar, reaction_bar, by_fabric)

    def _fabric(self, fabric: Fabric | None) -> tuple[Parameters, wp.array]:
        """Returns the parameters of a step and how garments without contact are solved."""
        if fabric is None:
            return self._parameters, self._base_solve
        given = {
            "stretch": fabric.stretch_stiffness,
            "bending": fabric.bending_stiffness,
            "density": fabric.surface_density,
            "friction": fabric.friction,
        }
        arrays = {
            name: scalars_in(value, name, self.batch, self.device)
            for name, value in given.items()
            if value is not None
        }
        only_friction = set(arrays) <= {"friction"}
        base_solve = self._base_solve if only_friction else self._iterate
        return replace_parameters(self._parameters, **arrays), base_solve

    def _checked(self, types: ContactTypes | None, bodies: Bodies) -> ContactTypes | None:
        """Returns given contact types as integers, once they fit."""
        if types is None:
            return None
        given = {f.name: np.asarray(getattr(types, f.name), dtype=np.int32) for f in fields(types)}
        expected = (self.batch, self._engine.node_count)
        for name, array in given.items():
            if array.shape != expected:
                raise ValueError(f"types.{name} has shape {array.shape}, expected {expected}")
        if given["owner"].max(initial=-1) >= bodies.count:
            raise ValueError(
                f"types.owner names body {given['owner'].max()}, expected less than {bodies.count}"
            )
        return ContactTypes(**given)

    def _right_hand_sides(
        self, parameters: Parameters, x: wp.array, v: wp.array
    ) -> tuple[wp.array, wp.array]:
        """Returns h M v + ½h² f and h f + ½h² df/dt."""
        engine = self._engine
        stress, rate = engine.element_vectors(), engine.element_vectors()
        engine.launch_elements(
            triangle_response, hinge_response, [engine.mesh, parameters, x, v, stress, rate]
        )
        g, pull = engine.vectors(), engine.vectors()
        engine.launch(
            right_hand_sides,
            [engine.mesh, parameters, v, stress, rate, engine.gravity, self.time_step, g, pull],
        )
        return g, pull
