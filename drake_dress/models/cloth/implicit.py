"""The plant's garment: linearly implicit Euler with contact and dry friction by nodes.

(M + (h² + hβ) K₊) v' = M v + h f(x), x' = x + h v', with K₊ the positive semi-definite part of
the exact stiffness (Baraff and Witkin 1998). It is not the controller's scheme: position and
velocity are consistent, stretched cloth stiffens against sideways motion, and rotation is not
resisted. Contact sets velocities, so a landing does not bounce: sticking nodes move with the
surface, slipping nodes keep their normal velocity and feel μ times their normal force. The modes
are found by an active-set iteration that starts from those of the step before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba as nb
import numpy as np
import scipy.sparse as sp

from drake_dress.models.cloth.contact.detection import cannot_land, find_proximity, nothing_near
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, FloatArray, IntArray
from drake_dress.models.cloth.factor.masked import Factor, SymbolicFactor
from drake_dress.models.cloth.fibres import Fibres
from drake_dress.models.cloth.filtered_cg import (
    FREE,
    HELD,
    SLIP,
    STICK,
    SystemMatrix,
    project,
)
from drake_dress.models.cloth.filtered_stiffness import no_stretch, prepare_filtered
from drake_dress.models.cloth.finite import explain_not_finite
from drake_dress.models.cloth.forces import internal_force
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import (
    Csr,
    bending_bound,
    bending_matrix,
    lumped_mass,
    stretch_matrix,
)

GRAVITY = np.array([0.0, 0.0, -9.81])
# A node deeper than its margin leaves at most this fast, m/s: faster, it would be thrown.
_LARGEST_PUSH = 0.2
# Tangential speed above which a node lands sliding, m/s.
_LANDING_SLIP_SPEED = 5e-3
_REFACTOR_AFTER = 40
# Gap within which a node may land during a step, m.
_NEAR = 0.05
# The passes before the last only find the modes: their tolerance is this much coarser.
_COARSER = 6.0
# Friction beyond the cone, in sum and relative to what the cone allows, that is let be.
_TOLERATED_EXCESS = 0.02
# Share of the nodes in contact whose mode may still change without another pass.
_TOLERATED_CHANGES = 0.02


@dataclass(frozen=True)
class ClothState:
    """State of a garment.

    Attributes:
        x, v: (n,3) m, m/s.
        mode: (n,) 0 free, 1 stick, 2 slip, 3 held.
        reaction: (n,3) force of person or gripper on the node in the last step, N.
        owner: (n,) obstacle that the node touches, -1 without.
    """

    x: FloatArray
    v: FloatArray
    mode: IntArray
    reaction: FloatArray
    owner: IntArray

    @staticmethod
    def at_rest(x: FloatArray) -> ClothState:
        """Returns a garment that rests at `x` (n,3), m, free of contact."""
        n = len(x)
        return ClothState(
            np.array(x, dtype=np.float64),
            np.zeros((n, 3)),
            np.zeros(n, dtype=np.int32),
            np.zeros((n, 3)),
            np.full(n, -1, dtype=np.int32),
        )


@dataclass(frozen=True)
class StepInfo:
    """How a step was solved."""

    passes: int
    cg_iterations: int
    relative_residual: float
    refactored: bool


class ImplicitCloth:
    """Steps a garment with the linearly implicit scheme.

    Args:
        elements: the rest shape.
        material: SI values.
        time_step: h, s.
        held: (k,) nodes whose motion is prescribed.
        gravity: (3,) m/s².
        tolerance: relative residual at which conjugate gradients stop.
        max_iterations: of conjugate gradients, per pass.
        max_passes: of the active-set iteration, per step; what is left over is mended in the next.
        sample_elements: contact at edge midpoints and face centroids too.
        most_cone_passes: solves added, at most, while nodes stick beyond what friction can hold.
        fibres: further stiffness of the triangles along a direction of theirs.
        added_mass: (n,) further mass of the nodes, kg.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material,
        time_step: float,
        held: IntArray,
        gravity: FloatArray = GRAVITY,
        tolerance: float = 5e-3,
        max_iterations: int = 40,
        max_passes: int = 2,
        sample_elements: bool = True,
        most_cone_passes: int = 3,
        fibres: Fibres | None = None,
        added_mass: FloatArray | None = None,
    ) -> None:
        self.elements = elements
        self.material = material
        self.time_step = time_step
        self.held = np.asarray(held, dtype=np.int32)
        self.gravity = np.asarray(gravity, dtype=np.float64)
        self.mass = lumped_mass(elements, material)
        if added_mass is not None:
            self.mass = self.mass + added_mass
        self._fibres = fibres
        self._tolerance = tolerance
        self._max_iterations = max_iterations
        self._max_passes = max_passes
        self._most_cone_passes = most_cone_passes
        self._edge = elements.edge if sample_elements else None
        self._triangle = elements.triangle if sample_elements else None

        scale = time_step * (time_step + material.damping)
        bending = bending_matrix(elements, material)
        mass = sp.diags(self.mass)
        stiffness_bound = stretch_matrix(elements, material) + bending_bound(elements, material)
        if fibres is not None:
            stiffness_bound = stiffness_bound + fibres.matrix(elements.node_count)
        p = sp.csc_matrix(mass + scale * stiffness_bound)
        self._symbolic = SymbolicFactor(p)
        self._system = SystemMatrix(
            Csr.of(mass + scale * bending), 1.0 / p.diagonal(), elements, scale, fibres
        )
        self._block = no_stretch()
        self._factor: Factor | None = None
        self._steps_since_factor = 0

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, StepInfo]:
        """Returns the state one time step later.

        Args:
            state: now.
            obstacles: the person now, with velocities.
            held_velocity: (k,3) of the held nodes over this step, m/s.
            influences: what else acts on the garment.
            guess: (n,3) what the velocity after the step may be, m/s; free fall by default.

        Raises:
            ValueError: something is not finite; the message names it.
        """
        m, h = self.material, self.time_step
        e = influences.stiffened(self.elements)
        x, v = state.x, state.v
        mu, adhesion = influences.contact_law(m.friction, len(x))
        force = internal_force(e, m.stretch_stiffness, m.bending_stiffness, x)
        self._block = prepare_filtered(e, m.stretch_stiffness, x)
        force += self.mass[:, None] * self.gravity
        if self._fibres is not None:
            self._fibres.add_force(x, force)
            self._system.prepare_fibres(x)
        if influences.force is not None:
            force += influences.force
        rhs = self.mass[:, None] * v + h * force

        if cannot_land(x, v, held_velocity, obstacles, h):
            near = nothing_near(len(x))
        else:
            near = find_proximity(x, obstacles, m.margin, self._edge, self._triangle)
        mode = np.empty(len(x), dtype=np.int32)
        _initial_modes(
            near.gap,
            near.normal,
            near.surface_velocity,
            v,
            h * self.gravity,
            h,
            state.mode,
            state.owner,
            near.owner,
            mode,
        )
        mode[self.held] = HELD
        # Normal velocity, relative to the surface, that brings a node onto its margin.
        push = np.where(
            near.gap > 0.0, -near.gap / h, np.minimum(-0.5 * near.gap / h, _LARGEST_PUSH)
        )
        friction = np.zeros_like(x)
        _initial_friction(state.reaction, near.normal, h, mu, adhesion, mode, friction)

        velocity = self._start(v, held_velocity, mode, near.normal, rhs, guess)
        total, residual, passes, changed, left = 0, 0.0, 0, 1, self._most_cone_passes
        refactored = self._renew_factor(mode)
        max_passes = self._max_passes if np.any(near.gap < _NEAR) else 1
        while True:
            _prescribe(mode, near.normal, near.surface_velocity, push, velocity)
            last = passes + 1 >= max_passes
            tolerance = self._tolerance if last else _COARSER * self._tolerance
            assert self._factor is not None
            iterations, residual = self._system.solve(
                self._factor,
                self._block,
                mode,
                near.normal,
                rhs + friction,
                velocity,
                tolerance,
                self._max_iterations,
            )
            total += iterations
            impulse = self._system.product(velocity, self._block)
            impulse -= rhs
            passes += 1
            if last:
                # Sticking may not hold more than friction can: what does slides after all.
                if left > 0 and _slip_out_of_cone(
                    near.normal, impulse, mu, h * adhesion, mode, friction
                ):
                    left -= 1
                    continue
                break
            changed = _update_modes(
                near.gap,
                near.normal,
                near.surface_velocity,
                push,
                velocity,
                impulse,
                mu,
                h * adhesion,
                mode,
                friction,
            )
            if (
                changed <= _TOLERATED_CHANGES * np.count_nonzero(mode)
                and residual <= self._tolerance
            ):
                break
        end = x + h * velocity
        if not np.isfinite(end).all():
            self._factor = None
            explain_not_finite(x, v, held_velocity, self.held)
        if residual > 0.1:
            self._factor = None
        # What conjugate gradients left over along a slip is no force of the person.
        slip = mode == SLIP
        pressure = np.einsum("ij,ij->i", impulse[slip], near.normal[slip])
        impulse[slip] = pressure[:, None] * near.normal[slip] + friction[slip]
        reaction = np.where((mode != FREE)[:, None], impulse / h, 0.0)
        touching = (mode == STICK) | (mode == SLIP)
        after = ClothState(
            end,
            velocity,
            mode,
            reaction,
            np.where(touching, near.owner, -1).astype(np.int32),
        )
        return after, StepInfo(passes, total, residual, refactored)

    def _start(
        self,
        v: FloatArray,
        held_velocity: FloatArray,
        mode: IntArray,
        normal: FloatArray,
        rhs: FloatArray,
        guess: FloatArray | None,
    ) -> FloatArray:
        """Returns where conjugate gradients start: in steady motion, in free fall or as guessed.

        A hanging garment keeps its velocity, a falling one gains h g; whichever leaves the smaller
        residual. Starting a hanging coat from free fall doubled the iterations.
        """
        other = v + self.time_step * self.gravity if guess is None else guess.copy()
        best, least = v, np.inf
        for start in (v.copy(), other):
            start[self.held] = held_velocity
            residual = self._system.product(start, self._block) - rhs
            project(residual, mode, normal)
            size = float(np.sum(residual**2))
            if size < least:
                best, least = start, size
        return best

    def _renew_factor(self, mode: IntArray) -> bool:
        """Makes a factor of P without the sticking nodes when the last one has become stale."""
        masked = (mode == STICK) | (mode == HELD)
        stale = self._factor is None
        if self._factor is not None:
            different = int(np.count_nonzero(masked != self._factor.masked))
            allowed = max(15, int(0.15 * np.count_nonzero(masked)))
            stale = different > allowed or (
                different > 0 and self._steps_since_factor >= _REFACTOR_AFTER
            )
        self._steps_since_factor += 1
        if stale:
            self._factor = self._symbolic.factorize(masked)
            self._steps_since_factor = 0
        return stale


def with_position(state: ClothState, x: FloatArray) -> ClothState:
    """Returns `state` with its nodes at `x` (n,3), m."""
    return replace(state, x=np.array(x, dtype=np.float64))


@nb.njit(cache=True, nogil=True)
def _initial_modes(  # type: ignore[no-untyped-def]
    gap, normal, surface_velocity, v, gravity_step, h, old_mode, old_owner, owner, mode
):
    for i in range(gap.shape[0]):
        mode[i] = FREE
        if owner[i] < 0:
            continue
        approach = 0.0
        for c in range(3):
            approach += normal[i, c] * (v[i, c] + gravity_step[c] - surface_velocity[i, c])
        was_touching = old_mode[i] == STICK or old_mode[i] == SLIP
        if was_touching and gap[i] < 1e-3:
            mode[i] = old_mode[i]
        elif gap[i] + h * approach < 0.0:
            mode[i] = _landing_mode(v, surface_velocity, normal, i)


@nb.njit(cache=True, nogil=True)
def _landing_mode(v, surface_velocity, normal, i):  # type: ignore[no-untyped-def]
    """A node that lands while it slides keeps sliding: sticking would take its momentum."""
    along = 0.0
    for c in range(3):
        along += normal[i, c] * (v[i, c] - surface_velocity[i, c])
    speed2 = 0.0
    for c in range(3):
        t = v[i, c] - surface_velocity[i, c] - along * normal[i, c]
        speed2 += t * t
    return SLIP if speed2 > _LANDING_SLIP_SPEED**2 else STICK


@nb.njit(cache=True, nogil=True)
def _initial_friction(reaction, normal, h, mu, adhesion, mode, friction):  # type: ignore[no-untyped-def]
    """Starts slipping nodes from the friction impulse of the step before."""
    for i in range(mode.shape[0]):
        if mode[i] != SLIP:
            continue
        along = 0.0
        for c in range(3):
            along += reaction[i, c] * normal[i, c]
        size = 0.0
        for c in range(3):
            t = reaction[i, c] - along * normal[i, c]
            friction[i, c] = t
            size += t * t
        size = np.sqrt(size)
        scale = 0.0
        along += adhesion[i]
        if size > 0.0 and along > 0.0:
            scale = h * mu[i] * along / size
        for c in range(3):
            friction[i, c] *= scale


@nb.njit(cache=True, nogil=True)
def _prescribe(mode, normal, surface_velocity, push, velocity):  # type: ignore[no-untyped-def]
    for i in range(mode.shape[0]):
        if mode[i] == STICK:
            for c in range(3):
                velocity[i, c] = surface_velocity[i, c] + push[i] * normal[i, c]
        elif mode[i] == SLIP:
            along = push[i]
            for c in range(3):
                along += normal[i, c] * (surface_velocity[i, c] - velocity[i, c])
            for c in range(3):
                velocity[i, c] += along * normal[i, c]


@nb.njit(cache=True, nogil=True)
def _slip_out_of_cone(normal, impulse, mu, adhesion, mode, friction):  # type: ignore[no-untyped-def]
    """Lets sticking nodes slip whose friction exceeds the cone; returns if it matters in sum."""
    excess = 0.0
    bound = 0.0
    for i in range(mode.shape[0]):
        if mode[i] != STICK and mode[i] != SLIP:
            continue
        pressure = 0.0
        for c in range(3):
            pressure += impulse[i, c] * normal[i, c]
        most = mu[i] * max(pressure + adhesion[i], 0.0)
        pressure = max(pressure, 0.0)
        bound += most
        if mode[i] == SLIP:
            continue
        tangential = 0.0
        for c in range(3):
            tangential += (impulse[i, c] - pressure * normal[i, c]) ** 2
        tangential = np.sqrt(tangential)
        if tangential > most:
            excess += tangential - most
    if excess <= _TOLERATED_EXCESS * bound:
        return False
    for i in range(mode.shape[0]):
        if mode[i] != STICK and mode[i] != SLIP:
            continue
        pressure = 0.0
        for c in range(3):
            pressure += impulse[i, c] * normal[i, c]
        most = mu[i] * max(pressure + adhesion[i], 0.0)
        pressure = max(pressure, 0.0)
        if mode[i] == SLIP:
            size = 0.0
            for c in range(3):
                size += friction[i, c] ** 2
            size = np.sqrt(size)
            if size > 0.0:
                for c in range(3):
                    friction[i, c] *= most / size
            continue
        tangential = 0.0
        for c in range(3):
            tangential += (impulse[i, c] - pressure * normal[i, c]) ** 2
        tangential = np.sqrt(tangential)
        if tangential > most:
            mode[i] = SLIP
            for c in range(3):
                t = impulse[i, c] - pressure * normal[i, c]
                friction[i, c] = most * t / tangential
    return True


@nb.njit(cache=True, nogil=True)
def _update_modes(  # type: ignore[no-untyped-def]
    gap, normal, surface_velocity, push, velocity, impulse, mu, adhesion, mode, friction
):
    """One round of the active set; returns how many nodes changed what binds them."""
    changed = 0
    for i in range(mode.shape[0]):
        m = mode[i]
        if m == HELD:
            continue
        if m == FREE:
            along = 0.0
            for c in range(3):
                along += normal[i, c] * (velocity[i, c] - surface_velocity[i, c])
                friction[i, c] = 0.0
            if gap[i] < _NEAR and along < push[i] - 1e-6 and (gap[i] > 0.0 or along < -1e-6):
                mode[i] = _landing_mode(velocity, surface_velocity, normal, i)
                changed += 1
            continue
        pressure = 0.0
        for c in range(3):
            pressure += impulse[i, c] * normal[i, c]
        most = mu[i] * max(pressure + adhesion[i], 0.0)
        if pressure < -adhesion[i]:
            mode[i] = FREE
            for c in range(3):
                friction[i, c] = 0.0
            changed += 1
            continue
        if m == STICK:
            tangential = 0.0
            for c in range(3):
                t = impulse[i, c] - pressure * normal[i, c]
                tangential += t * t
            tangential = np.sqrt(tangential)
            if tangential > most:
                mode[i] = SLIP
                for c in range(3):
                    t = impulse[i, c] - pressure * normal[i, c]
                    friction[i, c] = most * t / tangential
                changed += 1
            continue
        speed = 0.0
        work = 0.0
        for c in range(3):
            w = velocity[i, c] - surface_velocity[i, c] - push[i] * normal[i, c]
            speed += w * w
            work += w * friction[i, c]
        speed = np.sqrt(speed)
        if work > 0.0:
            # friction pushes along the motion: the node would have stopped
            mode[i] = STICK
            for c in range(3):
                friction[i, c] = 0.0
            changed += 1
        else:
            old = 0.0
            difference = 0.0
            for c in range(3):
                old += friction[i, c] ** 2
            old = np.sqrt(old)
            new = most
            for c in range(3):
                w = velocity[i, c] - surface_velocity[i, c] - push[i] * normal[i, c]
                target = friction[i, c]
                if speed > 1e-9:
                    target = -new * w / speed
                elif old > 0.0:
                    target = new * friction[i, c] / old
                difference += (target - friction[i, c]) ** 2
                friction[i, c] = target
            if np.sqrt(difference) > 0.1 * new + 1e-12:
                changed += 1
    return changed
