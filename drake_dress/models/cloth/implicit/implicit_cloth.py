"""The plant's garment: a linearly implicit scheme with contact and dry friction at the nodes.

With w the mean velocity over a step and θ the fraction of the step at which forces are taken,

    (M / θ + (θ h² + hβ) K₊) w = M v / θ + h f(x),  x' = x + h w,  v' = v + (w − v) / θ,

with K₊ the positive semi-definite part of the exact stiffness. θ = 1 is the step of Baraff and
Witkin (1998), whose damping grows with h. Near 1/2 it is of second order and damps little, so steps
may be longer. Unlike in the controller's scheme, position and velocity are consistent, stretched
cloth stiffens against sideways motion, and rotation is not resisted. Contact sets velocities, so a
landing does not bounce: bound nodes have v' = w, with M in place of M / θ. Sticking nodes move with
the surface. Slipping nodes keep their normal velocity and feel friction of μ times their normal
force; see `implicit_contact.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.buckling import Buckling
from drake_dress.models.cloth.contact.corners import held_off_corners
from drake_dress.models.cloth.contact.detection import (
    Proximity,
    cannot_land,
    find_proximity,
    nothing_near,
)
from drake_dress.models.cloth.contact.modes import FREE, HELD, RAIL, SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.factor.masked import Factor, SymbolicFactor
from drake_dress.models.cloth.filtered_cg import Preconditioner, Stop, SystemMatrix
from drake_dress.models.cloth.filtered_stiffness import (
    normal_response,
    prepare_filtered,
)
from drake_dress.models.cloth.finite import explain_not_finite
from drake_dress.models.cloth.forces import bending_force, internal_force
from drake_dress.models.cloth.implicit.implicit_contact import ImplicitContact
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.layers.bonds import NO_BONDS, ActingBonds
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import (
    Csr,
    bending_bound,
    bending_matrix,
    stretch_matrix,
)
from drake_dress.models.cloth.state import (
    GRAVITY,
    NO_ADDITIONS,
    Additions,
    ClothState,
    SteppedCloth,
)

_REFACTOR_AFTER = 40
# Resistance of friction, as a share of P's diagonal, above which a slipping node is left out of the
# factor: P⁻¹ is far too soft around it otherwise. Two sleeves on arms took 46 iterations a step
# without this, 33 with it.
_FIRM = 0.03
# Factor on the tolerance of the passes before the last, since they only find the modes.
_COARSER = 6.0
# Maximum number of additional solves for nodes that would end inside a body.
_LANDING_PASSES = 3
# Maximum number of additional solves while pairs of layers pull.
_PARTING_PASSES = 3
# Share of the nodes in contact whose mode may still change without another pass.
_TOLERATED_CHANGES = 0.02


@dataclass(frozen=True)
class StepInfo:
    """Information on the solve of a step."""

    passes: int
    cg_iterations: int
    relative_residual: float
    refactored: bool


@dataclass
class _Problem:
    """The problem of a step, and the progress of its solution.

    Attributes:
        state: state at the start of the step.
        obstacles: the person at that time.
        driven: (n,3) impulse of elastic forces, weight and influences, N s.
        block: result of `prepare_filtered`.
        facing, light: results of `normal_response`.
        near: nearest surfaces of the nodes; contact: contact with them.
        bonds: pairs of layers.
        inertia: (n,) M / θ of nodes that the last pass solved as free, M of others, kg.
        pushed: (n,3) momentum plus `driven` and the impulse of layers, N s.
        velocity: (n,3) m/s, of the last pass; impulse: (n,3) that it requires of contact, N s.
        passes, iterations: numbers so far; residual: of the last pass.
    """

    state: ClothState
    obstacles: Obstacles
    driven: FloatArray
    block: FloatArray
    facing: FloatArray
    light: FloatArray
    near: Proximity
    contact: ImplicitContact
    bonds: ActingBonds
    inertia: FloatArray = field(init=False)
    pushed: FloatArray = field(init=False)
    velocity: FloatArray = field(init=False)
    impulse: FloatArray = field(init=False)
    passes: int = 0
    iterations: int = 0
    residual: float = 0.0

    def __post_init__(self) -> None:
        self.impulse = np.empty_like(self.state.v)


@dataclass(frozen=True)
class ImplicitSettings:
    """Settings of the linearly implicit scheme.

    Attributes:
        tolerance: residual at which conjugate gradients stop, relative to the momentum plus what
            gravity adds to it in a step.
        max_iterations: maximum iterations of conjugate gradients per pass.
        max_passes: maximum passes of the active-set iteration per step. The next step corrects
            the remaining error.
        sample_elements: whether edge midpoints and face centroids have contact, in addition to
            nodes.
        most_cone_passes: maximum additional solves while nodes stick beyond the friction cone.
        implicitness: θ, above 0.5 up to 1. 1 is implicit Euler; smaller values damp less.
        buckling_wavelength: shortest wrinkle that the mesh can represent, in spacings. Compression
            that would buckle at shorter wavelengths is relaxed (`Buckling`). 0 turns this off.
    """

    tolerance: float = 5e-3
    max_iterations: int = 40
    max_passes: int = 2
    sample_elements: bool = True
    most_cone_passes: int = 3
    implicitness: float = 1.0
    buckling_wavelength: float = 0.0


class ImplicitCloth(SteppedCloth):
    """Steps a garment with the linearly implicit scheme: accurate, without derivatives.

    Args:
        elements: rest shape, from `make_elements`.
        material: fabric.
        time_step: h, s.
        held: (k,) nodes whose motion is prescribed.
        gravity: (3,) m/s².
        additions: permanent additions of effects.
        settings: solver settings.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material,
        time_step: float,
        held: npt.NDArray[np.integer],
        gravity: FloatArray = GRAVITY,
        additions: Additions = NO_ADDITIONS,
        settings: ImplicitSettings = ImplicitSettings(),
    ) -> None:
        super().__init__(elements, material, time_step, held, gravity, additions)
        self._settings = settings
        self._edge = elements.edge if settings.sample_elements else None
        self._triangle = elements.triangle if settings.sample_elements else None

        self._buckling = None
        if settings.buckling_wavelength > 0.0:
            self._buckling = Buckling(elements, material, settings.buckling_wavelength)

        implicitness, fibres = settings.implicitness, additions.fibres
        self._inertia = self.mass / implicitness
        scale = time_step * (implicitness * time_step + material.damping)
        bending = bending_matrix(elements, material)
        mass = sp.diags(self._inertia)
        stiffness_bound = stretch_matrix(elements, material) + bending_bound(elements, material)
        if fibres is not None:
            stiffness_bound = stiffness_bound + fibres.matrix(elements.node_count)
        p = sp.csc_matrix(mass + scale * stiffness_bound)
        self._symbolic = SymbolicFactor(p)
        self._firm = _FIRM * p.diagonal()
        self._system = SystemMatrix(
            Csr.of(mass + scale * bending), 1.0 / p.diagonal(), elements, scale, fibres
        )
        self._scale, self._bending = scale, scale * bending.diagonal()
        # the last factor: another state may be able to use it
        self._factor: Factor | None = None

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, StepInfo]:
        """Returns the state one time step later, and information on the solve.

        Args:
            state: present state.
            obstacles: the person at the start of the step, with velocities.
            held_velocity: (k,3) velocity of the held nodes over this step, m/s.
            influences: other effects on the garment.
            guess: (n,3) estimate of the mean velocity over the step, m/s; free fall by default.

        Raises:
            ValueError: an input is not finite; the message names it.
        """
        p = self._problem(state, obstacles, held_velocity, influences)
        mode = p.contact.mode
        p.velocity = self._start(p, held_velocity, guess)
        factor, refactored, memory = self._renewed_factor(
            state.solver[0], mode, p.contact.resistance
        )
        self._solve(p, factor)

        h, v = self.time_step, state.v
        end = state.x + h * p.velocity
        if not np.isfinite(end).all():
            explain_not_finite(state.x, v, held_velocity, self.held)
        if p.residual > max(0.1, self._settings.tolerance):
            memory[0] = -1
        reaction = p.contact.impulse(p.velocity, p.impulse) / h
        # rails are for this step only
        mode[mode == RAIL] = SLIP
        touching = (mode == STICK) | (mode == SLIP)
        # θ for nodes that were solved as free, 1 for bound ones
        share = (self.mass / p.inertia)[:, None]
        after = ClothState(
            end,
            p.velocity if self._settings.implicitness == 1.0 else v + (p.velocity - v) / share,
            mode,
            reaction,
            np.where(touching, p.near.owner, -1).astype(np.int32),
            np.stack([memory, state.solver[1]]),
        )
        return after, StepInfo(p.passes, p.iterations, p.residual, refactored)

    def displaced(
        self, state: ClothState, displacement: FloatArray, obstacles: Obstacles
    ) -> FloatArray:
        """Returns nodes (n,3), m, displaced as far as the fabric yields without force.

        The displacement d' is that of a step that begins with the velocity d / h and in
        equilibrium, M (d' − d) + θ (θ h² + hβ) K₊ d' = 0: what stretches the fabric is left out,
        and what folds it sharply. Held nodes stay, bodies are not entered, without friction.

        Args:
            state: present state; its velocity does not matter.
            displacement: d (n,3), m.
            obstacles: the person, at rest.
        """
        force, _ = self._elastic(self.elements, state.x)
        weight = self.mass[:, None] * self.gravity
        free = replace(ClothState.at_rest(state.x), v=displacement / self.time_step)
        still = np.zeros((len(self.held), 3))
        balance = Influences(force=-(force + weight), friction=np.zeros(len(state.x)))
        return self.step(replace(free, solver=state.solver), obstacles, still, balance)[0].x

    def _problem(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences,
    ) -> _Problem:
        """Returns the problem of a step, prepared for its first pass."""
        m, h, x, v = self.material, self.time_step, state.x, state.v
        e = influences.stiffened(self.elements)
        force, block = self._elastic(e, x)
        force += self.mass[:, None] * self.gravity
        fibres = self.additions.fibres
        if fibres is not None:
            fibres.add_force(x, force)
            self._system.prepare_fibres(x)
        if influences.force is not None:
            force += influences.force
        bonds = ActingBonds(influences.bonds or NO_BONDS, len(x), h)
        facing, light = normal_response(e, block, self._scale, self._inertia + self._bending)

        if cannot_land(x, v, held_velocity, obstacles, h):
            near = nothing_near(len(x))
        else:
            near = find_proximity(x, obstacles, m.margin, self._edge, self._triangle)
            near = held_off_corners(near, x, obstacles, m.margin)
        law = influences.contact_law(m.friction, len(x))
        contact = ImplicitContact(near, state, self.held, h, self.gravity, law)
        p = _Problem(state, obstacles, h * force, block, facing, light, near, contact, bonds)
        self._make_ready(p)
        return p

    def _make_ready(self, p: _Problem) -> None:
        """Updates matrix and momentum to the current modes and pairs of layers."""
        self._system.set_bonds(p.bonds.now)
        p.inertia = self._bound_inertia(p.contact.mode)
        p.pushed = p.inertia[:, None] * p.state.v + p.driven + p.bonds.drive

    def _solve(self, p: _Problem, factor: Factor) -> None:
        """Finds velocities and impulses with consistent modes and pairs of layers."""
        cones, landings, partings = (
            self._settings.most_cone_passes,
            _LANDING_PASSES,
            _PARTING_PASSES,
        )
        contact = p.contact
        several = contact.is_near or len(p.bonds) > 0
        while True:
            if p.passes > 0:
                self._make_ready(p)
            last = p.passes + 1 >= (self._settings.max_passes if several else 1)
            self._pass(
                p, factor, self._settings.tolerance if last else _COARSER * self._settings.tolerance
            )
            # Layers push and do not pull.
            glued = (not last or partings > 0) and p.bonds.update(p.velocity)
            if not last:
                changed = contact.update(p.velocity, p.impulse)
                few = changed <= _TOLERATED_CHANGES * np.count_nonzero(contact.mode)
                if glued or not few or p.residual > self._settings.tolerance:
                    continue
            elif glued:
                partings -= 1
                continue
            # Sticking nodes beyond the friction cone have to slip.
            elif cones > 0 and contact.slip_out_of_cone(p.velocity, p.impulse):
                cones -= 1
                continue
            # No node may end inside the person because its landing was missed.
            if landings == 0 or not contact.is_near or not self._stop_entering(p):
                return
            landings -= 1

    def _pass(self, p: _Problem, factor: Factor, tolerance: float) -> None:
        """Solves for the current modes and pairs of layers."""
        contact = p.contact
        contact.prescribe(p.velocity)
        bound = contact.mode.any()
        iterations, p.residual = self._system.solve(
            # without bound nodes, P alone conserves momentum, however soon iterations end
            Preconditioner(
                factor,
                (p.facing, p.bonds.now.stiffened(p.facing, p.light)) if bound else None,
            ),
            p.block,
            contact.bound(),
            p.pushed + contact.drive(),
            p.velocity,
            Stop(
                tolerance,
                self._settings.max_iterations,
                p.inertia[:, None] * (p.state.v + self.time_step * self.gravity),
            ),
            p.impulse,
        )
        p.impulse -= p.pushed
        p.iterations += iterations
        p.passes += 1

    def _stop_entering(self, p: _Problem) -> bool:
        margin = self.material.margin
        return p.contact.stop_entering(p.state.x, p.velocity, p.impulse, p.obstacles, margin)

    def _elastic(self, elements: Elements, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns the internal force (n,3), N, and the data for products with K₊."""
        m = self.material
        if self._buckling is None:
            force = internal_force(elements, m.stretch_stiffness, m.bending_stiffness, x)
            return force, prepare_filtered(elements, m.stretch_stiffness, x)
        force, e = self._buckling.force(elements, x), elements
        if m.bending_stiffness > 0.0:
            bending_force(x, e.hinge_lanes, e.bend_lanes, m.bending_stiffness, force)
        return force, self._buckling.prepare(e, x)

    def _bound_inertia(self, mode: IntArray) -> FloatArray:
        """Returns (n,), kg, M / θ of free nodes and M of bound ones, and sets it in the system."""
        if self._settings.implicitness == 1.0:
            return self.mass
        inertia = np.where(mode == FREE, self._inertia, self.mass)
        self._system.set_diagonal(inertia + self._bending)
        return inertia

    def _start(
        self, p: _Problem, held_velocity: FloatArray, guess: FloatArray | None
    ) -> FloatArray:
        """Returns the initial guess of conjugate gradients: steady motion, free fall or `guess`.

        A hanging garment keeps its velocity, a falling one gains θ h g; the one with the smaller
        residual is taken. Starting a hanging coat from free fall doubled the iterations.
        """
        v, mode, normal = p.state.v, p.contact.mode, p.near.normal
        fall = self._settings.implicitness * self.time_step * self.gravity
        other = v + fall if guess is None else guess.copy()
        best, least = v, np.inf
        for start in (v.copy(), other):
            start[self.held] = held_velocity
            size = self._system.residual2(start, p.block, p.pushed, mode, normal)
            # a start that is not finite is taken, too: the end of the step reports it
            if not size >= least:
                best, least = start, size
        return best

    def _renewed_factor(
        self, memory: IntArray, mode: IntArray, resistance: FloatArray
    ) -> tuple[Factor, bool, IntArray]:
        """Returns a factor of P without the fixed nodes, a new one if the last has become stale.

        Also returns whether it is new, and the row of `ClothState.solver` for the next step.

        Args:
            memory: (n+1,) row of `ClothState.solver`.
            mode: (n,) modes of the nodes.
            resistance: (n,) resistance of friction to slipping nodes, kg.
        """
        masked = (mode == STICK) | (mode == HELD) | (resistance > self._firm)
        age, last = int(memory[0]), memory[1:] == 1
        stale = age < 0
        if not stale:
            different = int(np.count_nonzero(masked != last))
            allowed = max(15, int(0.15 * np.count_nonzero(masked)))
            stale = different > allowed or (different > 0 and age >= _REFACTOR_AFTER)
        left_out = masked if stale else last
        if self._factor is None or not np.array_equal(self._factor.masked, left_out):
            self._factor = self._symbolic.factorize(left_out)
        following = np.empty(len(mode) + 1, dtype=np.int32)
        following[0], following[1:] = 0 if stale else age + 1, left_out
        return self._factor, stale, following


def with_position(state: ClothState, x: FloatArray) -> ClothState:
    """Returns `state` with its nodes at `x` (n,3), m."""
    return replace(state, x=np.array(x, dtype=np.float64))
