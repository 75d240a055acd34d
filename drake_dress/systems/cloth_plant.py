"""The simulated garment as a Drake system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.grasp import Pressing, not_pressing, press
from drake_dress.models.cloth.contact.modes import FREE, HELD
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.contact.wrenches import body_wrenches
from drake_dress.models.cloth.layered import Integrator, LayeredCloth
from drake_dress.models.cloth.releasable import ReleasableCloth
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.effects.mounts import Mounts, MountState, displaced, limb_forces
from drake_dress.models.sides import SIDES
from drake_dress.systems.garment_steps import Steps, StepsHere, StepsInWorker, Surroundings
from drake_dress.systems.person_bodies import PersonBodies

# Penetration of the garment into the person in a rehearsal, m.
_REHEARSED_DEPTH = 2e-3
# Factor by which a rehearsal flattens the garment, so that its layers touch.
_REHEARSED_FLATNESS = 0.02


class ClothPlant(LeafSystem):
    """The true garment: finer mesh and time step than the controller's, and its own integrator.

    .. pydrake_system::

        name: ClothPlant
        input_ports:
        - body_poses
        - body_spatial_velocities
        - left_gripper_position
        - left_gripper_velocity
        - right_gripper_position
        - right_gripper_velocity
        - release (optional)
        output_ports:
        - garment_position
        - garment_velocity
        - contact
        - contact_force
        - left_gripper_force
        - right_gripper_force
        - person_forces
        - grippers_open

    garment_position, garment_velocity: (3n,) row-major (n,3), m, m/s, world. contact: (n,) 0 none,
    1 stick, 2 slip. contact_force: (3n,) of the person on the garment, N. *_gripper_force: (3,)
    of the garment on the gripper, N. person_forces: list of ExternallyAppliedSpatialForce, one for
    each body in contact. release: (1,) above 0.5 both grippers let go, for good. grippers_open:
    (1,) whether they have. All outputs depend on discrete state only.

    Held cloth is displaced by a person who moves into it (`contact/grasp.py`).

    The garment lags bodies and grippers by one step: a step that starts at k·h, from their motion
    at that time, ends at (k + 1)·h. Meanwhile it may run in parallel with the rest of the diagram.

    Args:
        cloth: The integrator; its held nodes are those of the left, then of the right gripper.
        held_count: Number of nodes held by the left and by the right gripper.
        start: (n,3) garment at time 0, m.
        start_grippers: (2,3) p_WG of left and right at time 0, m.
        person: The person's capsules and the plant's bodies that they are fixed in.
        grasp_stiffness: Stiffness of a gripper's arm and grasp against the person, N/m.
        mounts: Compliance of grippers and limbs; rigid by default. Measured gripper and limb
            positions do not include their deflection.
        in_worker: Whether a worker process computes the steps, on another core.
    """

    def __init__(
        self,
        cloth: Integrator,
        held_count: tuple[int, int],
        start: FloatArray,
        start_grippers: FloatArray,
        person: PersonBodies,
        grasp_stiffness: float,
        mounts: Mounts | None = None,
        in_worker: bool = False,
    ) -> None:
        super().__init__()
        self.cloth = cloth
        self._n = cloth.elements.node_count
        self.start_position = np.array(start)
        self._side = np.repeat([0, 1], held_count)
        self._offset = start[cloth.held] - start_grippers[self._side]
        self._person = person
        self._surroundings = Surroundings(person.radius, len(cloth.held))
        self._steps: Steps = (StepsInWorker if in_worker else StepsHere)(cloth, self._surroundings)
        # inputs of the step in progress
        self._begun: tuple[ClothState, FloatArray] | None = None

        self._mounts = mounts or Mounts([])
        self._grasp_stiffness = grasp_stiffness
        self._moved_mass = self._mounts.moved_mass(cloth, self._side)

        self._declare_state()
        self._declare_inputs()
        self._declare_outputs()
        self.DeclarePeriodicDiscreteUpdateEvent(cloth.time_step, 0.0, self._update)

    def _declare_state(self) -> None:
        """Declares the state carried from step to step: garment, forces, mounts."""
        n, held_count = self._n, len(self.cloth.held)
        self._x = self.DeclareDiscreteState(self.start_position.ravel())
        self._v = self.DeclareDiscreteState(np.zeros(3 * n))
        self._mode = self.DeclareDiscreteState(np.zeros(n))
        self._owner = self.DeclareDiscreteState(np.full(n, -1.0))
        self._reaction = self.DeclareDiscreteState(np.zeros(3 * n))
        self._solver = self.DeclareDiscreteState(np.full(2 * (n + 1), -1.0))
        self._tangled = self.DeclareDiscreteState(np.zeros(n))
        self._acceleration = self.DeclareDiscreteState(np.zeros(3 * n))
        # Moment about the body's origin, then force, of the garment on each body.
        self._wrench = self.DeclareDiscreteState(np.zeros(6 * len(self._person.index)))
        # force of the person on the held nodes, N
        self._pressing = self.DeclareDiscreteState(np.zeros(3 * held_count))
        self._mount = self.DeclareDiscreteState(MountState.at_rest(self._person.limb_count).flat())
        self._open = self.DeclareDiscreteState([0.0])
        # surroundings of the step in progress; NaN before the first step
        self._around = self.DeclareDiscreteState(np.full(self._surroundings.size, np.nan))

    def _declare_inputs(self) -> None:
        self._poses = self.DeclareAbstractInputPort("body_poses", Value[list[RigidTransform]]())
        self._velocities = self.DeclareAbstractInputPort(
            "body_spatial_velocities", Value[list[SpatialVelocity]]()
        )
        self._grip = [
            (
                self.DeclareVectorInputPort(f"{side}_gripper_position", 3),
                self.DeclareVectorInputPort(f"{side}_gripper_velocity", 3),
            )
            for side in SIDES
        ]
        self._release = self.DeclareVectorInputPort("release", 1)

    def _declare_outputs(self) -> None:
        """Declares the output ports, which depend on discrete state only."""
        n, ticket = self._n, {self.xd_ticket()}
        self.DeclareVectorOutputPort("garment_position", 3 * n, self._calc(self._x), ticket)
        self.DeclareVectorOutputPort("garment_velocity", 3 * n, self._calc(self._v), ticket)
        self.DeclareVectorOutputPort("contact", n, self._calc_contact, ticket)
        self.DeclareVectorOutputPort("contact_force", 3 * n, self._calc_contact_force, ticket)
        for i, side in enumerate(SIDES):
            self.DeclareVectorOutputPort(
                f"{side}_gripper_force", 3, self._calc_gripper_force(i), ticket
            )
        self.DeclareAbstractOutputPort(
            "person_forces",
            lambda: Value[list[ExternallyAppliedSpatialForce]]([]),
            self._calc_person_forces,
            ticket,
        )
        self.DeclareVectorOutputPort("grippers_open", 1, self._calc(self._open), ticket)

    def obstacles(self, context: Context) -> Obstacles:
        """Returns the person's capsules in the world, from the body input ports."""
        return self._person.obstacles(self._poses.Eval(context), self._velocities.Eval(context))

    def rehearse(self, context: Context) -> None:
        """Steps the garment on the person, then flattened, held and let go.

        This compiles all kernels and makes all factors.
        """
        bodies = self.obstacles(context)
        if not bodies.count:
            return
        still = np.zeros((len(self.cloth.held), 3))
        near = find_proximity(self.start_position, bodies, self.cloth.material.margin)
        first = int(np.argmin(near.gap))
        down = (near.gap[first] + _REHEARSED_DEPTH) * near.normal[first]
        state = ClothState.at_rest(self.start_position - down)
        for _ in range(2):
            self._steps.begin(state, self._surroundings.flat(bodies, still))
            state = self._steps.end()
        flat = ClothState.at_rest(self.start_position)
        if getattr(self.cloth, "has_layers", isinstance(self.cloth, LayeredCloth)):
            # layers in contact, and some marked as possibly crossed
            x = self.start_position.copy()
            thin = int(np.argmin(np.ptp(x, axis=0)))
            x[:, thin] = x[:, thin].mean() + _REHEARSED_FLATNESS * (x[:, thin] - x[:, thin].mean())
            flat = ClothState.at_rest(x)
            flat.tangled[: len(flat.x) // 2] = 1
        for held in (still, still[:0]) if isinstance(self.cloth, ReleasableCloth) else (still,):
            self._steps.begin(flat, self._surroundings.flat(bodies, held))
            self._steps.end()

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        # between the end of a step and the start of the next, do only what cannot be done while a
        # step is in progress
        h = self.cloth.time_step
        target = np.stack([p.Eval(context) + h * v.Eval(context) for p, v in self._grip])
        bodies = self.obstacles(context)
        lets_go = self._release.HasValue(context) and self._release.Eval(context)[0] > 0.5
        if lets_go or self._are_open(context):
            self._update_free(context, discrete, bodies)
            return
        if self._mounts.rigid:
            taken, pressing = self._taken(target, bodies)
            after = self._stepped(context)
        else:
            after = self._stepped(context)
            mount = self._mounted(context, after)
            bodies = displaced(bodies, self._person.limb_of, mount.limb, mount.limb_rate)
            taken, pressing = self._taken(target + mount.held, bodies)
            discrete.set_value(self._mount, mount.flat())
        velocity = (taken - after.x[self.cloth.held]) / h
        self._go_on(context, discrete, after, self._surroundings.flat(bodies, velocity), pressing)

    def _update_free(self, context: Context, discrete: DiscreteValues, bodies: Obstacles) -> None:
        """Updates the state once the grippers have let go."""
        after = _let_go(self._stepped(context))
        if not self._mounts.rigid:
            mount = self._mounted(context, after)
            bodies = displaced(bodies, self._person.limb_of, mount.limb, mount.limb_rate)
            discrete.set_value(self._mount, mount.flat())
        discrete.set_value(self._open, [1.0])
        around = self._surroundings.flat(bodies, np.zeros((0, 3)))
        self._go_on(context, discrete, after, around, not_pressing(len(self.cloth.held)))

    def _are_open(self, context: Context) -> bool:
        """Returns whether both grippers have let go."""
        return bool(context.get_discrete_state(self._open).value()[0] > 0.5)

    def _go_on(
        self,
        context: Context,
        discrete: DiscreteValues,
        after: ClothState,
        around: FloatArray,
        pressing: Pressing,
    ) -> None:
        """Starts the next step, from `after` and with `around`, and stores the state."""
        self._begin(after, around)
        discrete.set_value(self._around, around)
        discrete.set_value(self._x, after.x.ravel())
        discrete.set_value(self._v, after.v.ravel())
        discrete.set_value(self._mode, after.mode.astype(np.float64))
        discrete.set_value(self._owner, after.owner.astype(np.float64))
        discrete.set_value(self._reaction, after.reaction.ravel())
        discrete.set_value(self._solver, after.solver.ravel().astype(np.float64))
        discrete.set_value(self._tangled, after.tangled.astype(np.float64))
        discrete.set_value(self._acceleration, after.acceleration.ravel())
        discrete.set_value(self._pressing, pressing.force.ravel())
        discrete.set_value(self._wrench, self._wrenches(context, after, pressing).ravel())

    def _taken(self, target: FloatArray, bodies: Obstacles) -> tuple[FloatArray, Pressing]:
        """Returns the held nodes' target positions (k,3), m, and how bodies press on them.

        Args:
            target: (2,3) positions of the grippers, m.
            bodies: Capsules at the start of the step.
        """
        taken = target[self._side] + self._offset
        bodies = _after(bodies, self.cloth.time_step)
        pressing = press(taken, self._side, bodies, self._grasp_stiffness)
        return taken + pressing.displacement[self._side], pressing

    def _stepped(self, context: Context) -> ClothState:
        """Returns the garment after the step in progress, or as it is if there is none."""
        n = self._n
        # copies, since kernels would be compiled again for read-only arrays
        state = ClothState(
            context.get_discrete_state(self._x).value().reshape(n, 3).copy(),
            context.get_discrete_state(self._v).value().reshape(n, 3).copy(),
            context.get_discrete_state(self._mode).value().astype(np.int32),
            context.get_discrete_state(self._reaction).value().reshape(n, 3).copy(),
            context.get_discrete_state(self._owner).value().astype(np.int32),
            context.get_discrete_state(self._solver).value().reshape(2, n + 1).astype(np.int32),
            context.get_discrete_state(self._tangled).value().astype(np.int32),
            context.get_discrete_state(self._acceleration).value().reshape(n, 3).copy(),
        )
        around = context.get_discrete_state(self._around).value()
        if not np.isfinite(around).all():
            return state
        if not self._is_under_way(state, around):
            # the step in progress belongs to another context
            self._begin(state, around.copy())
        self._begun = None
        try:
            return self._steps.end()
        except ValueError as error:
            raise ValueError(f"garment at {context.get_time():.3f} s: {error}") from error

    def _begin(self, state: ClothState, around: FloatArray) -> None:
        self._steps.begin(state, around)
        self._begun = state, around

    def _is_under_way(self, state: ClothState, around: FloatArray) -> bool:
        """Returns whether the last step was started with these arguments."""
        if self._begun is None:
            return False
        begun, with_this = self._begun
        return np.array_equal(around, with_this) and all(
            np.array_equal(getattr(begun, k), value) for k, value in vars(state).items()
        )

    def _mounted(self, context: Context, state: ClothState) -> MountState:
        """Returns the deflection of grippers and limbs at the end of this step."""
        pulled = [-state.reaction[self.cloth.held[self._side == i]].sum(axis=0) for i in (0, 1)]
        if self._are_open(context):
            pulled = [np.zeros(3), np.zeros(3)]
        mount = MountState.of(context.get_discrete_state(self._mount).value())
        force = limb_forces(self._person.limb_of, len(mount.limb), state.owner, state.reaction)
        h = self.cloth.time_step
        return self._mounts.step(mount, np.stack(pulled), force, h, self._moved_mass)

    def _wrenches(self, context: Context, after: ClothState, pressing: Pressing) -> FloatArray:
        """Returns (bodies,6) moment about the body origin, then force, by the garment, world."""
        origin = self._person.origins(self._poses.Eval(context))
        owner, reaction = after.owner, after.reaction
        if (pressing.owner >= 0).any():
            owner, reaction = owner.copy(), reaction.copy()
            owner[self.cloth.held], reaction[self.cloth.held] = pressing.owner, pressing.force
        return body_wrenches(self._person.body_of, origin, after.x, owner, reaction)

    def _calc(self, index: Any) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state(index).value())

        return calc

    def _calc_contact(self, context: Context, output: BasicVector) -> None:
        mode = context.get_discrete_state(self._mode).value()
        output.SetFromVector(np.where(mode <= 2, mode, 0.0))

    def _calc_contact_force(self, context: Context, output: BasicVector) -> None:
        reaction = context.get_discrete_state(self._reaction).value().reshape(self._n, 3).copy()
        if not self._are_open(context):
            reaction[self.cloth.held] = (
                context.get_discrete_state(self._pressing).value().reshape(-1, 3)
            )
        output.SetFromVector(reaction.ravel())

    def _calc_gripper_force(self, side: int) -> Callable[[Context, BasicVector], None]:
        nodes = self.cloth.held[self._side == side]

        def calc(context: Context, output: BasicVector) -> None:
            if self._are_open(context):
                output.SetFromVector(np.zeros(3))
                return
            reaction = context.get_discrete_state(self._reaction).value().reshape(self._n, 3)
            pressing = context.get_discrete_state(self._pressing).value().reshape(-1, 3)
            pulled = -reaction[nodes].sum(axis=0)
            output.SetFromVector(pulled + pressing[self._side == side].sum(axis=0))

        return calc

    def _calc_person_forces(self, context: Context, output: Value) -> None:
        wrench = context.get_discrete_state(self._wrench).value().reshape(-1, 6)
        forces = []
        for k, index in enumerate(self._person.index):
            if not np.any(wrench[k]):
                continue
            applied = ExternallyAppliedSpatialForce()
            applied.body_index = BodyIndex(index)
            applied.p_BoBq_B = np.zeros(3)
            applied.F_Bq_W = SpatialForce(tau=wrench[k, :3], f=wrench[k, 3:])
            forces.append(applied)
        output.set_value(forces)


def _after(bodies: Obstacles, h: float) -> Obstacles:
    """Returns the capsules `h` s later, with zero velocity."""
    end = bodies.velocity + np.cross(bodies.angular_velocity, bodies.b - bodies.a)
    return Obstacles.resting(bodies.a + h * bodies.velocity, bodies.b + h * end, bodies.radius)


def _let_go(state: ClothState) -> ClothState:
    """Returns the state without the grippers' forces on the nodes that they held so far."""
    held = state.mode == HELD
    if not held.any():
        return state
    mode, reaction = state.mode.copy(), state.reaction.copy()
    mode[held], reaction[held] = FREE, 0.0
    return replace(state, mode=mode, reaction=reaction)
