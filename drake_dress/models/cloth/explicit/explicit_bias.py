"""The controller's garment: the paper's explicit iteration with bias, contact and derivatives.

Without contact (Eqs. delta-definiation and iterative-solver):

    A Δx = h M v + ½h² f,    A Δv = h f + ½h² df/dt,

with A = P = M + h² Σ w AᵀA for one iteration; for more, inner/ defines A. One iteration resists
rotation as if it were stretch: at h = 0.1 s a coat that the grippers turn hardly turns in the
prediction.

Contact and grasp prescribe motions instead of adding forces (paper-notes: the printed contact
force is an elastic bounce, and springs at the grippers report forces that do not exist):

1. Of the nodes that would enter a surface, only those that still do once resting nodes are held
   count as contacts.
2. All contact nodes stick, Δx = h u_surface − gap n, which takes the force r.
3. Nodes with r·n < 0 take off. Nodes with ‖r_T‖ > μ r_N slip: they keep their normal motion and
   feel friction along r_T, μ times the normal force that they then have. The rest stick. The
   reduced system (three rows for stick, one for slip) is solved for Δx; it stays bounded for tight
   sleeves and large steps. Nodes that would be pulled to a surface are then released, sticking
   nodes beyond the friction cone slip, and the system is solved again.
4. Sticking nodes take the velocity of the surface. Slipping nodes take its normal component and
   feel the same friction, unless it stops them within the step. All others follow
   A Δv = h f + ½h² df/dt. (With the velocity Δx/h instead, a node that starts to slide gains only
   half of its speed.)

`step` returns a tape, with which `vector_jacobian_product` (adjoint.py) computes the exact adjoint
of the step for fixed contact types: friction follows the sticking force, normals follow the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba as nb
import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import (
    ATTEMPTS,
    CLOSE,
    ENTERED,
    FEW,
    Contacts,
    find_contacts,
    known_contacts,
)
from drake_dress.models.cloth.contact.friction import (
    NO_CONTACT,
    Friction,
    find_modes,
    most_revisions,
    revise_modes,
)
from drake_dress.models.cloth.contact.modes import FREE, HELD, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.explicit.adjoint import Gradient, run_adjoint
from drake_dress.models.cloth.explicit.inner.conjugate_gradients import ConjugateGradients
from drake_dress.models.cloth.explicit.inner.direct import Direct
from drake_dress.models.cloth.explicit.inner.filtered import Filtered
from drake_dress.models.cloth.explicit.inner.interface import InnerIteration, StepSystem, Unknown
from drake_dress.models.cloth.explicit.inner.one_step import OneStep
from drake_dress.models.cloth.explicit.inner.stationary import Stationary
from drake_dress.models.cloth.finite import explain_not_finite
from drake_dress.models.cloth.forces import force_and_product
from drake_dress.models.cloth.layered import inverse_mass, pushed_nodes
from drake_dress.models.cloth.layers.separation import LayerSeparation, SeparationRecord
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import (
    bending_bound,
    bending_matrix,
    stretch_matrix,
)
from drake_dress.models.cloth.state import GRAVITY, SteppedCloth

INNER = ("one_step", "stationary", "conjugate_gradients", "direct")


@dataclass(frozen=True)
class ContactTypes:
    """Contact that is given instead of detected: which nodes touch which obstacle, and how.

    Attributes:
        nodes: (c,) ascending; owner: (c,) obstacles.
        mode: (c,) STICK, SLIP or, for nodes that take off, FREE; velocity_mode: (c,) the same for
            the velocity at the end of the step.
    """

    nodes: IntArray
    owner: IntArray
    mode: IntArray
    velocity_mode: IntArray


@dataclass(frozen=True)
class Tape:
    """Data of a step for its adjoint: n nodes, k of them held, c in contact.

    Attributes:
        x, v, obstacles: inputs of the step.
        system: the linear system; motion_unknown, change_unknown: for Δx and Δv; stick_unknown: for
            Δx with all contact nodes sticking, None without contact.
        contacts: nodes in contact; prescribed: (c,3) their Δx if they stick, m;
            target_change: (c,3) their Δv if they stick, m/s.
        friction: their modes and quantities derived from the sticking force.
        stick_reaction: (c,3) the force that sticking would take, N.
        motion, change: (n,3) Δx, Δv.
        separation: record of the layer separation that then changed Δx and Δv; None if off.
    """

    x: FloatArray
    v: FloatArray
    obstacles: Obstacles
    system: StepSystem
    motion_unknown: Unknown
    change_unknown: Unknown
    stick_unknown: Unknown | None
    contacts: Contacts
    prescribed: FloatArray
    target_change: FloatArray
    friction: Friction
    stick_reaction: FloatArray
    motion: FloatArray
    change: FloatArray
    separation: SeparationRecord | None
    held: IntArray

    @property
    def types(self) -> ContactTypes:
        """The contact types of this step, for use in another."""
        f = self.friction
        return ContactTypes(self.contacts.nodes, self.contacts.owner, f.mode, f.velocity_mode)

    @property
    def mode(self) -> IntArray:
        """(n,) FREE, STICK, SLIP or HELD of every node."""
        mode = np.zeros(len(self.x), dtype=np.int32)
        mode[self.contacts.nodes] = self.friction.mode
        mode[self.held] = HELD
        return mode


@dataclass(frozen=True)
class _Bound:
    """Constraints on c nodes in contact; see `Tape`. `binding` (c,3) is the λ that binds Δx."""

    prescribed: FloatArray
    target_change: FloatArray
    friction: Friction
    stick_reaction: FloatArray
    binding: FloatArray


@dataclass(frozen=True)
class _Free:
    """A step without contact: its system, the unknowns Δx and Δv, and g (n,3), kg m."""

    system: StepSystem
    motion: Unknown
    change: Unknown
    g: FloatArray


_NO_VECTORS = np.zeros((0, 3))
_NOTHING_BOUND = _Bound(_NO_VECTORS, _NO_VECTORS, NO_CONTACT, _NO_VECTORS, _NO_VECTORS)


@dataclass(frozen=True)
class ExplicitSettings:
    """Settings of the scheme with bias.

    Attributes:
        tolerance: relative tolerance of solves by conjugate gradients.
        iterations: inner iterations; 1 is the paper's one-step scheme.
        inner: inner iteration, one of `INNER`. By default `one_step` for 1 iteration and
            `conjugate_gradients` for more.
        self_collision: distance kept between layers of the garment, m; 0 lets them pass through
            each other. Layers are separated after the step (layers/). The adjoint keeps their
            pairs, weights and directions fixed.
        attachment_stiffness: stiffness of a spring from each held node to its gripper, N/m, as in
            the paper. By default (None) held nodes move with the gripper. Springs stretch by their
            force, and by v h more in motion.
    """

    tolerance: float = 1e-4
    iterations: int = 1
    inner: str | None = None
    self_collision: float = 0.0
    attachment_stiffness: float | None = None


class ExplicitBiasCloth(SteppedCloth):
    """Steps a garment with the paper's scheme, which has exact derivatives.

    Args:
        elements: rest shape, from `make_elements`.
        material: fabric. `damping` is not used; the scheme has its own damping.
        time_step: h, s. The motion stays bounded at large steps.
        held: (k,) nodes that move with the grippers.
        gravity: (3,) m/s².
        settings: solver settings.

    Raises:
        ValueError: `inner` is not one of `INNER`, `one_step` is given more than one iteration, or
            `attachment_stiffness` is not a number above 0.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material,
        time_step: float,
        held: npt.NDArray[np.integer],
        gravity: FloatArray = GRAVITY,
        settings: ExplicitSettings = ExplicitSettings(),
    ) -> None:
        super().__init__(elements, material, time_step, held, gravity)
        s = settings
        self.settings = s
        self._most_revisions = most_revisions(s.tolerance)
        self.layers = LayerSeparation(elements, s.self_collision) if s.self_collision else None
        self.held_mask = np.zeros(elements.node_count, dtype=np.bool_)
        self.held_mask[self.held] = True
        self.spring = s.attachment_stiffness
        if self.spring is not None and not 0.0 < self.spring < np.inf:
            raise ValueError(
                f"attachment_stiffness is {self.spring} N/m, expected a number above 0"
            )
        # Springs leave all nodes free.
        self._fixed = self.held if self.spring is None else self.held[:0]
        self.inner = self._make_inner(
            s.inner or ("one_step" if s.iterations == 1 else "conjugate_gradients"),
            s.iterations,
            s.tolerance,
        )

    def with_material(self, material: Material) -> ExplicitBiasCloth:
        """Returns the same garment with another fabric."""
        return ExplicitBiasCloth(
            self.elements, material, self.time_step, self.held, self.gravity, self.settings
        )

    def step(
        self,
        x: FloatArray,
        v: FloatArray,
        held_motion: FloatArray,
        obstacles: Obstacles,
        types: ContactTypes | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray, Tape]:
        """Returns position, velocity, reaction (n,3) after one step, and the tape.

        The reaction is the mean force of person and grippers on each node over the step, N.

        Args:
            x: (n,3) positions, m.
            v: (n,3) velocities, m/s.
            held_motion: (k,3) displacement of the held nodes over this step, m; with springs, from
                the nodes' positions to those of the grippers' ends after the step.
            obstacles: the person at the start of the step, with velocities.
            types: contact to use instead of detecting it (for derivative checks).

        Raises:
            ValueError: an input has the wrong shape, or something in it is not finite.
        """
        if held_motion.shape != (len(self.held), 3):
            raise ValueError(
                f"held_motion has shape {held_motion.shape}, expected ({len(self.held)}, 3)"
            )
        # Copies for the tape: the caller may change the arrays before the adjoint runs.
        x, v, held_motion = x.copy(), v.copy(), held_motion.copy()
        free = self._without_contact(x, v, held_motion)
        h, margin = self.time_step, self.material.margin
        if types is None:
            near = find_contacts(x, free.motion.free, obstacles, margin, h, self.held_mask)
        else:
            near = known_contacts(x, types.nodes, types.owner, obstacles, margin)
        stick_unknown = free.system.again(free.motion) if len(near.nodes) else None
        contacts, bound, motion, change = self._with_contact(free, stick_unknown, near, v, types)
        separation = None
        if self.layers is not None:
            separation = self._layers_apart(x, motion, contacts, bound.friction.mode)
        tape = Tape(
            x=x,
            v=v,
            obstacles=obstacles,
            system=free.system,
            motion_unknown=free.motion,
            change_unknown=free.change,
            stick_unknown=stick_unknown,
            contacts=contacts,
            prescribed=bound.prescribed,
            target_change=bound.target_change,
            friction=bound.friction,
            stick_reaction=bound.stick_reaction,
            motion=motion,
            change=change,
            separation=None if separation is None else separation[1],
            held=self.held,
        )
        reaction = self._reaction(free, motion, held_motion)
        reaction[contacts.nodes] = (2.0 / h**2) * bound.binding
        if separation is None:
            return x + motion, v + change, reaction, tape
        moved, record = separation
        pushed = pushed_nodes(record.rate_change)
        velocity = np.where(pushed[:, None], (motion + record.rate_change) / h, v + change)
        return x + moved, velocity, reaction, tape

    def _without_contact(self, x: FloatArray, v: FloatArray, held_motion: FloatArray) -> _Free:
        """Returns the step without contact; for the arguments see `step`."""
        h, m = self.time_step, self.material
        force, rate = force_and_product(
            self.elements, m.stretch_stiffness, m.bending_stiffness, x, v
        )
        system = self.inner.at(x)
        g, impulse = np.empty_like(x), np.empty_like(x)
        _right_hand_sides(self.mass, self.gravity, v, force, rate, h, g, impulse)
        if self.spring is not None:
            g[self.held] += (0.5 * h * h * self.spring) * held_motion
            impulse[self.held] += self.spring * (h * held_motion - 0.5 * h * h * v[self.held])
        fixed = slice(None) if self.spring is None else slice(0)
        motion, change = system.start(
            (g, held_motion[fixed]), (impulse, (held_motion / h - v[self.held])[fixed]), h * v
        )
        if not np.isfinite(motion.free).all():
            explain_not_finite(x, v, held_motion, self.held)
        return _Free(system, motion, change, g)

    def _with_contact(
        self,
        free: _Free,
        stick_unknown: Unknown | None,
        near: Contacts,
        v: FloatArray,
        types: ContactTypes | None,
    ) -> tuple[Contacts, _Bound, FloatArray, FloatArray]:
        """Returns the contacts, their constraints, and Δx and Δv, (n,3) m and m/s.

        Args:
            free: the step without contact.
            stick_unknown: Δx with all nodes near a surface sticking; None if there are none.
            near: the nodes near a surface.
            v: (n,3) velocities at the start, m/s.
            types: contact to use instead of detecting it.
        """
        kept, guess = np.ones(len(near.nodes), dtype=np.bool_), None
        if types is None and stick_unknown is not None:
            kept, guess = self._who_touches(free.system, stick_unknown, near)
        for attempt in range(ATTEMPTS):
            contacts, bound = near.chosen(kept), _NOTHING_BOUND
            if stick_unknown is not None:
                unknowns = stick_unknown, free.motion, free.change
                bound = self._bind(free.system, unknowns, contacts, v, guess, types)
            motion, change = free.system.finish(free.motion, free.change)
            if kept.all():
                break
            entered = ~kept & (_ahead(near, motion[near.nodes], self.time_step) < -ENTERED)
            if not entered.any():
                break
            kept = kept | entered if attempt + 2 < ATTEMPTS else np.ones_like(kept)
            guess = None
        return contacts, bound, motion, change

    def _layers_apart(
        self, x: FloatArray, motion: FloatArray, contacts: Contacts, contact_mode: IntArray
    ) -> tuple[FloatArray, SeparationRecord]:
        """Returns Δx with layers separated, and the record; see `LayerSeparation.correct`."""
        assert self.layers is not None
        mode = np.zeros(len(x), dtype=np.int32)
        mode[contacts.nodes] = contact_mode
        mode[self._fixed] = HELD
        barred = np.zeros_like(x)
        barred[contacts.nodes] = contacts.normal
        return self.layers.correct(x, motion, inverse_mass(self.mass, mode), barred)

    def _reaction(self, free: _Free, motion: FloatArray, held_motion: FloatArray) -> FloatArray:
        """Returns (n,3) the force of the grippers on the nodes, N."""
        h, reaction = self.time_step, np.zeros_like(motion)
        if self.spring is None:
            reaction[self.held] = (2.0 / h**2) * (free.system.held_rows(motion) - free.g[self.held])
        else:
            # P counts the spring's Δx twice; k (Δp − Δx) would report k v h in steady motion.
            reaction[self.held] = self.spring * (held_motion - 2.0 * motion[self.held])
        return reaction

    def vector_jacobian_product(
        self,
        tape: Tape,
        x_bar: FloatArray,
        v_bar: FloatArray,
        held_reaction_bar: FloatArray,
        by_material: bool = False,
        frozen_contact: bool = False,
    ) -> Gradient:
        """Returns the derivative of L with respect to the inputs of the taped step.

        Args:
            tape: tape of the step.
            x_bar: (n,3) derivative of L by the step's positions.
            v_bar: (n,3) derivative of L by the step's velocities.
            held_reaction_bar: (k,3) derivative of L by the reaction at the held nodes.
            by_material: whether to differentiate by the material's values, too; takes longer.
            frozen_contact: whether surfaces stay where nodes met them. This is not exact, but stays
                bounded over many steps in contact, where the exact derivative does not
                (adjoint.py). Derivatives by obstacles are then zero.

        Raises:
            ValueError: both `by_material` and `frozen_contact` are set.
        """
        if by_material and frozen_contact:
            raise ValueError("frozen_contact has no derivative by_material")
        return run_adjoint(self, tape, x_bar, v_bar, held_reaction_bar, by_material, frozen_contact)

    def _who_touches(
        self, system: StepSystem, unknown: Unknown, near: Contacts
    ) -> tuple[BoolArray, FloatArray | None]:
        """Returns (c,) which nodes near a surface touch it, and a guess of their binding forces.

        Without contact the whole garment falls, and at large steps far more nodes would enter than
        if resting nodes were held. So resting nodes are held first. Nodes that then stay outside
        are not contacts.
        """
        lying = near.gap <= CLOSE
        everyone = np.ones(len(lying), dtype=np.bool_)
        if not lying.any() or np.count_nonzero(~lying) <= FEW:
            return everyone, None
        system.touch(near.nodes)
        mode = np.where(lying, STICK, FREE).astype(np.int32)
        target = _closing(near, self.time_step)
        binding, there = system.hold(unknown, mode, near.normal, target)
        kept = lying | (_ahead(near, there, self.time_step) < 0.0)
        return kept, binding[kept]

    def _bind(
        self,
        system: StepSystem,
        unknowns: tuple[Unknown, Unknown, Unknown],
        contacts: Contacts,
        v: FloatArray,
        guess: FloatArray | None,
        types: ContactTypes | None,
    ) -> _Bound:
        """Binds the unknowns at the nodes in contact.

        Args:
            system: system of the step.
            unknowns: for Δx with all of them sticking, for Δx, for Δv.
            contacts: the c nodes.
            v: (n,3) velocities, m/s.
            guess: (c,3) guess of the binding forces of sticking nodes.
            types: contact to use instead of detecting it.
        """
        h, m, normal = self.time_step, self.material, contacts.normal
        stick_unknown, motion_unknown, change_unknown = unknowns
        prescribed = _closing(contacts, h)
        system.touch(contacts.nodes)
        everything = np.full(len(contacts.nodes), STICK, dtype=np.int32)
        stick_binding, _ = system.hold(stick_unknown, everything, normal, prescribed, guess=guess)
        stick_reaction = (2.0 / h**2) * stick_binding
        target_change = contacts.surface_velocity - v[contacts.nodes]
        friction = find_modes(
            stick_reaction,
            normal,
            m.friction,
            -self.mass[contacts.nodes, None] * target_change,
            h,
            None if types is None else (types.mode, types.velocity_mode),
        )
        binding = stick_binding
        for revision in range(self._most_revisions):
            binding, _ = system.hold(
                motion_unknown, friction.mode, normal, prescribed, friction.push, binding
            )
            last = types is not None or revision + 1 == self._most_revisions
            if last or not revise_modes(
                binding, normal, contacts.gap, m.friction, friction, slide=revision == 0
            ):
                break
        # A constant force r adds ½h² r to the motion and h r to the velocity.
        system.hold(
            change_unknown,
            friction.velocity_mode,
            normal,
            target_change,
            friction.push,
            (2.0 / h) * binding,
        )
        return _Bound(prescribed, target_change, friction, stick_reaction, binding)

    def _make_inner(self, name: str, iterations: int, tolerance: float) -> InnerIteration:
        e, m, h = self.elements, self.material, self.time_step
        if name not in INNER:
            raise ValueError(f"inner iteration is {name!r}, expected one of {', '.join(INNER)}")
        if name == "one_step" and iterations != 1:
            raise ValueError(f"one_step takes 1 iteration, not {iterations}")
        attached = np.zeros(e.node_count)
        if self.spring is not None:
            attached[self.held] = h**2 * self.spring
        mass, unit = (
            sp.diags(self.mass + attached),
            replace(m, stretch_stiffness=1.0, bending_stiffness=1.0),
        )
        stretch, bound = h**2 * stretch_matrix(e, unit), h**2 * bending_bound(e, unit)
        p = sp.csc_matrix(mass + m.stretch_stiffness * stretch + m.bending_stiffness * bound)
        shares = {
            "stretch_stiffness": stretch,
            "bending_stiffness": bound,
            "surface_density": sp.diags(e.node_area),
        }
        if name == "one_step":
            return OneStep(p, shares, self._fixed, tolerance)
        bending = h**2 * bending_matrix(e, unit)
        linear = mass + m.bending_stiffness * bending
        matrix = Filtered(e, m.stretch_stiffness, h, linear, bending)
        if name == "conjugate_gradients":
            return ConjugateGradients(matrix, p, self._fixed, tolerance, iterations)
        if name == "direct":
            return Direct(matrix, p, self._fixed)
        return Stationary(matrix, p, OneStep(p, shares, self._fixed, tolerance), iterations)


@nb.njit(cache=True, nogil=True)
def _right_hand_sides(mass, gravity, v, force, rate, h, motion, change):  # type: ignore[no-untyped-def]
    """Writes h M v + ½h² f to `motion`, h f + ½h² df/dt to `change` (n,3); `rate` is −df/dt."""
    for i in range(v.shape[0]):
        for c in range(3):
            total = force[i, c] + mass[i] * gravity[c]
            motion[i, c] = mass[i] * h * v[i, c] + 0.5 * h * h * total
            change[i, c] = h * total - 0.5 * h * h * rate[i, c]


def _closing(near: Contacts, time_step: float) -> FloatArray:
    """Returns Δx (c,3) of sticking nodes: it closes gaps and takes deep nodes out."""
    closing: FloatArray = time_step * near.surface_velocity - near.gap[:, None] * near.normal
    return closing


def _ahead(near: Contacts, motion: FloatArray, time_step: float) -> FloatArray:
    """Returns the gap (c,) that remains after `motion` (c,3), m."""
    return near.ahead(motion - time_step * near.surface_velocity)
