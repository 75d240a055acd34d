"""Projective Dynamics (Bouaziz et al. 2014), the reference for the other schemes.

A step of implicit Euler minimises

    E(x) = 1/(2h²) ‖x − y‖²_M + ψ(x),    y = x_n + h v_n + h² g,

with ψ the energy of `forces.internal_force`. With p the projections of the elements (the isometry
nearest to F, the curvature vector at its rest length) ψ is ½ Σ w ‖A x − p‖². Together, the local
step "find p" and the global step "solve P x = M y + h² Σ w Aᵀp" are

    x ← x − P⁻¹ h² ∇E(x),    P = M + h² Σ w AᵀA,

because h² ∇E(x) = P x − M y − h² Σ w Aᵀp. P is constant: one factor serves all iterations. E never
rises, as the quadratic with fixed p lies above it. `quasi_newton` uses P⁻¹ as the first guess of
L-BFGS, with a line search on E (Liu, Bouaziz and Kavan 2017).

Damping adds β/(2h) (x − x_n)ᵀ K₊(x_n) (x − x_n) to E, with the filtered stiffness that
`ImplicitCloth` uses for damping, and hβ Σ w AᵀA to P.

Contact is detected at every iterate (`iterated_contact.py`) and removes some of the nodes' degrees
of freedom (`projected_system.py`). The iteration stops by an estimate of the distance to the fixed
point (`stopping_rule.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import cannot_land, depth_of_elements
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elastic_energy import elastic_energy
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.fibres import filtered_product as fibre_product
from drake_dress.models.cloth.filtered_cg import matrix_product, project
from drake_dress.models.cloth.filtered_stiffness import filtered_product, prepare_filtered
from drake_dress.models.cloth.finite import explain_not_finite
from drake_dress.models.cloth.forces import internal_force
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import Csr, bending_matrix, stretch_matrix
from drake_dress.models.cloth.projective.iterated_contact import IteratedContact
from drake_dress.models.cloth.projective.projected_system import ProjectedSystem
from drake_dress.models.cloth.projective.quasi_newton import CurvatureHistory
from drake_dress.models.cloth.projective.stopping_rule import StoppingRule
from drake_dress.models.cloth.state import (
    GRAVITY,
    NO_ADDITIONS,
    Additions,
    ClothState,
    SteppedCloth,
)
from drake_dress.models.cloth.vectors import dot, largest_length

_WINDOW = 5
# Decrease that a line search requires, as a share of what the slope predicts.
_ARMIJO = 1e-4
_MOST_HALVINGS = 12
# Relative rounding error of E: a rise within it is tolerated.
_ROUNDING = 1e-14


@dataclass(frozen=True)
class ProjectiveInfo:
    """Information on the solve of a step.

    Attributes:
        iterations: number of global steps.
        remaining: estimated distance to the fixed point, m, the largest over the nodes.
        converged: whether that satisfied the stopping rule.
        contraction: ρ of that estimate.
        refactored: number of factors made.
        solves: number of triangular solves, with those of conjugate gradients.
        changes: number of nodes whose contact changed in the last iteration.
    """

    iterations: int
    remaining: float
    converged: bool
    contraction: float
    refactored: int
    solves: int
    changes: int


@dataclass(frozen=True)
class ProjectiveSettings:
    """Settings of Projective Dynamics.

    Attributes:
        tolerance: estimated distance to the fixed point at which a step is finished, m.
        max_iterations: maximum number of global steps. The info says if they were not enough.
        quasi_newton: L-BFGS instead of the plain iteration.
        predicted: whether each step starts from the linearly implicit step. If that is close, few
            iterations are left.
        sample_elements: whether edge midpoints and face centroids have contact, too, with their
            depths at the start of a step.
    """

    tolerance: float = 1e-5
    max_iterations: int = 5000
    quasi_newton: bool = False
    predicted: bool = False
    sample_elements: bool = False


class ProjectiveDynamicsCloth(SteppedCloth):
    """Steps a garment by Projective Dynamics, to convergence.

    By default only nodes have contact, unlike in `ImplicitCloth`, so thin objects can slip between
    them. With friction, a step of 0.1 s in which cloth lands has more than one fixed point; which
    one is found depends on the path of the iteration.

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
        settings: ProjectiveSettings = ProjectiveSettings(),
    ) -> None:
        super().__init__(elements, material, time_step, held, gravity, additions)
        self._settings = settings
        self._history = None
        if settings.quasi_newton:
            self._history = CurvatureHistory(_WINDOW, elements.node_count)

        bending = bending_matrix(elements, material)
        stiffness = stretch_matrix(elements, material) + bending
        if additions.fibres is not None:
            stiffness = stiffness + additions.fibres.matrix(elements.node_count)
        scale = time_step * (time_step + material.damping)
        self._system = ProjectedSystem(sp.csc_matrix(sp.diags(self.mass) + scale * stiffness))
        self._bending = Csr.of(bending)
        self._predictor = None
        if settings.predicted:
            sampled = ImplicitSettings(tolerance=1e-3, sample_elements=settings.sample_elements)
            self._predictor = ImplicitCloth(
                elements, material, time_step, held, gravity, additions, sampled
            )

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, ProjectiveInfo]:
        """Returns the state one time step later, and information on the solve.

        Args:
            state: present state.
            obstacles: the person at the start of the step, with velocities.
            held_velocity: (k,3) velocity of the held nodes over this step, m/s.
            influences: other effects on the garment.
            guess: (n,3) estimate of the velocity after the step, m/s; for the predictor.

        Raises:
            ValueError: an input is not finite.
        """
        h = self.time_step
        if not all(np.isfinite(a).all() for a in (state.x, state.v, held_velocity)):
            explain_not_finite(state.x, state.v, held_velocity, self.held)
        if cannot_land(state.x, state.v, held_velocity, obstacles, h):
            obstacles = Obstacles.none()
        contact = IteratedContact(
            state,
            self.held,
            obstacles,
            self.mass,
            h,
            influences.contact_law(self.material.friction, len(state.x)),
            self._margins(state.x, obstacles),
            self._settings.tolerance,
        )
        self._system.start_counting()
        self._system.go_on(state.solver[1])
        inertial = state.x + h * state.v + h * h * self.gravity
        if influences.force is not None:
            inertial += h * h * influences.force / self.mass[:, None]
        equations = _Equations(self, inertial, state.x, influences)
        of_predictor = state.solver[0]
        if self._predictor is not None:
            ahead, _ = self._predictor.step(state, obstacles, held_velocity, influences, guess)
            start = steady = ahead.x
            of_predictor = ahead.solver[0]
        else:
            start, steady = self._start(state, inertial, held_velocity, equations)
        x, gradient, info = self._iterate(contact.place(start, steady), contact, equations)
        touching = (contact.mode == STICK) | (contact.mode == SLIP)
        after = ClothState(
            x,
            (x - state.x) / h,
            contact.mode,
            contact.reaction(gradient) / h**2,
            np.where(touching, contact.owner, -1).astype(np.int32),
            np.stack([of_predictor, self._system.memory()]),
        )
        return after, info

    def _start(
        self,
        state: ClothState,
        inertial: FloatArray,
        held_velocity: FloatArray,
        equations: _Equations,
    ) -> tuple[FloatArray, FloatArray]:
        """Returns the initial iterate, and the result of steady motion, (n,3) m.

        A falling garment continues to fall, a hanging one keeps its velocity.
        """
        h = self.time_step
        fall, steady = inertial.copy(), state.x + h * state.v
        fall[self.held] = steady[self.held] = state.x[self.held] + h * held_velocity
        falls = equations.energy(fall) < equations.energy(steady)
        return (fall if falls else steady), steady

    def _iterate(
        self, x: FloatArray, contact: IteratedContact, equations: _Equations
    ) -> tuple[FloatArray, FloatArray, ProjectiveInfo]:
        """Returns the positions (n,3) of least energy, m, the gradient there, and the info.

        Args:
            x: (n,3) initial iterate, m; changed in place.
            contact: contact of the step.
            equations: equations of the step.
        """
        history = self._history
        if history is not None:
            history.clear()
        stop = StoppingRule(self._settings.tolerance)
        before, old_gradient = x.copy(), np.zeros((0, 3))
        iterations = 0
        while True:
            changes = contact.bind(x)
            gradient = equations.gradient(x)
            changes += contact.classify(gradient)
            if iterations > 0:
                if changes:
                    stop.restart()
                else:
                    stop.add(largest_length(x - before))
                if stop.reached() or iterations >= self._settings.max_iterations:
                    break
            if history is not None:
                if changes:
                    history.clear()
                elif iterations > 0:
                    _remember(history, x - before, gradient - old_gradient, contact)
            before[:] = x
            old_gradient = gradient
            motion = self._motion(gradient - contact.friction, contact, history)
            if history is not None:
                self._shorten(x, motion, equations, gradient, contact, history)
            contact.shorten(x, motion)
            x += motion
            iterations += 1
        info = ProjectiveInfo(
            iterations,
            stop.remaining,
            stop.reached(),
            stop.contraction,
            self._system.factors,
            self._system.solves,
            changes,
        )
        return x, gradient, info

    def _margins(self, x: FloatArray, obstacles: Obstacles) -> FloatArray:
        """Returns (n,) the margins of the nodes, m, so that elements between them keep theirs."""
        margin = np.full(len(x), self.material.margin)
        if self._settings.sample_elements:
            e = self.elements
            margin += depth_of_elements(x, obstacles, e.edge, e.triangle)
        return margin

    def _motion(
        self, gradient: FloatArray, contact: IteratedContact, history: CurvatureHistory | None
    ) -> FloatArray:
        if history is None:
            return self._system.solve(-gradient, contact)
        project(gradient, contact.mode, contact.normal)
        motion = history.direction(gradient, lambda q: self._system.solve(q, contact))
        project(motion, contact.mode, contact.normal)
        if dot(motion, gradient) >= 0.0:
            history.clear()
            motion = self._system.solve(-gradient, contact)
        return motion

    def _shorten(
        self,
        x: FloatArray,
        motion: FloatArray,
        equations: _Equations,
        gradient: FloatArray,
        contact: IteratedContact,
        history: CurvatureHistory,
    ) -> None:
        """Halves `motion` in place until E with the work of friction falls as its slope predicts.

        If it never does, the history is cleared and replaced by the plain motion.
        """
        force = gradient - contact.friction
        slope = dot(force, motion)
        start = equations.energy(x)
        noise = _ROUNDING * abs(start)
        for _ in range(_MOST_HALVINGS):
            resisted = dot(contact.friction, motion)
            resisted -= 0.5 * float(np.einsum("i,ij,ij->", contact.resistance, motion, motion))
            if equations.energy(x + motion) - resisted <= start + _ARMIJO * slope + noise:
                return
            motion *= 0.5
            slope *= 0.5
        history.clear()
        motion[:] = self._system.solve(-force, contact)


def _remember(
    history: CurvatureHistory, s: FloatArray, y: FloatArray, contact: IteratedContact
) -> None:
    """Adds the free parts of a motion and of the gradient's change over it, (n,3) each."""
    y += contact.resistance[:, None] * s
    project(s, contact.mode, contact.normal)
    project(y, contact.mode, contact.normal)
    history.add(s, y)


class _Equations:
    """The function that a step minimises, and its gradient."""

    def __init__(
        self,
        cloth: ProjectiveDynamicsCloth,
        inertial: FloatArray,
        x: FloatArray,
        influences: Influences,
    ) -> None:
        m = cloth.material
        self._elements = influences.stiffened(cloth.elements)
        self._stiffness = (m.stretch_stiffness, m.bending_stiffness)
        self._mass, self._inertial, self._before = cloth.mass, inertial, x
        self._h2 = cloth.time_step**2
        self._fibres = cloth.additions.fibres
        self._damping = cloth.time_step * m.damping
        self._bending = cloth._bending
        # cached, because the next iteration starts where a line search ends
        self._at = np.full_like(x, np.nan)
        self._energy_there, self._damped_there = np.nan, np.empty(0)
        if self._damping > 0.0:
            self._block = prepare_filtered(self._elements, m.stretch_stiffness, x)
            if self._fibres is not None:
                self._fibre_block = self._fibres.prepare(x)

    def energy(self, x: FloatArray) -> float:
        """Returns h² E(x), kg m²."""
        if np.array_equal(x, self._at):
            return self._energy_there
        elastic = elastic_energy(self._elements, *self._stiffness, x)
        if self._fibres is not None:
            elastic += self._fibres.energy(x)
        total = float(_inertia_energy(x, self._inertial, self._mass)) + self._h2 * elastic
        if self._damping > 0.0:
            motion = x - self._before
            self._damped_there = self._damped(motion)
            total += 0.5 * dot(motion, self._damped_there)
        self._at, self._energy_there = x.copy(), total
        return total

    def gradient(self, x: FloatArray) -> FloatArray:
        """Returns h² ∇E(x) (n,3), kg m."""
        out = internal_force(self._elements, *self._stiffness, x)
        if self._fibres is not None:
            self._fibres.add_force(x, out)
        _add_inertia(x, self._inertial, self._mass, self._h2, out)
        if self._damping > 0.0:
            there = np.array_equal(x, self._at)
            out += self._damped_there if there else self._damped(x - self._before)
        return out

    def _damped(self, motion: FloatArray) -> FloatArray:
        out = np.empty_like(motion)
        b, e, f = self._bending, self._elements, self._fibres
        matrix_product(b.indptr, b.indices, b.data, motion, out)
        out *= self._damping
        filtered_product(
            motion, e.triangle_lanes, e.gradient_lanes, self._block, self._damping, out
        )
        if f is not None:
            fibre_product(
                motion, f.triangle, f.coefficient, f.weight, self._fibre_block, self._damping, out
            )
        return out


@nb.njit(cache=True, nogil=True, fastmath=True)
def _inertia_energy(x, inertial, mass):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(x.shape[0]):
        for c in range(3):
            total += 0.5 * mass[i] * (x[i, c] - inertial[i, c]) ** 2
    return total


@nb.njit(cache=True, nogil=True)
def _add_inertia(x, inertial, mass, h2, force):  # type: ignore[no-untyped-def]
    """Turns forces (n,3) into h² ∇E, in place."""
    for i in range(x.shape[0]):
        for c in range(3):
            force[i, c] = mass[i] * (x[i, c] - inertial[i, c]) - h2 * force[i, c]
