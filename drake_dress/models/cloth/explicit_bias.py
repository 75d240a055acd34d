"""The controller's garment: the paper's explicit iteration with bias, one iteration a step.

Without contact (Eqs. delta-definiation and iterative-solver, one iteration):

    P Δx = h M v + ½h² f,    P Δv = h f + ½h² df/dt,    P = M + h² Σ w AᵀA.

Contact and grasp prescribe motions instead of adding forces (paper-notes: the printed contact
force is an elastic bounce, springs at the grippers report forces that are not there):

1. all nodes in reach stick: P_ff y_f = (g − P y_c)_f, reaction r = (2/h²)(P y − g);
2. nodes with r·n < 0 take off; those with ‖r_T‖ > μ r_N slip: they keep their normal motion and
   feel the friction μ r_N along r_T; the rest sticks. The reduced system (three rows for stick,
   one for slip) is solved for Δx: it stays bounded for tight sleeves and large steps;
3. contact nodes take the velocity Δx/h, the others follow P Δv = h f + ½h² df/dt.

With `iterations` > 1 the inner iteration of Eq. iterative-solver is run as conjugate gradients on
M + h² K₊ with the factor of P as preconditioner (K₊ the positive semi-definite part of the exact
stiffness): one iteration resists rotation as if it were stretch, so that at h = 0.1 s a coat that
is turned by its grippers hardly turns in the prediction.

`step` returns a tape with which `vector_jacobian_product` runs the exact adjoint of the step with
contact types held: friction follows the sticking force, normals follow the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from drake_dress.models.cloth.contact.detection import Proximity, find_proximity
from drake_dress.models.cloth.contact.distance import normal_derivative, pack
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import BoolArray, Elements, FloatArray, IntArray
from drake_dress.models.cloth.factor import Factor, SymbolicFactor
from drake_dress.models.cloth.filtered_cg import (
    FREE,
    HELD,
    SLIP,
    STICK,
    SystemMatrix,
)
from drake_dress.models.cloth.forces import (
    internal_force,
    prepare_filtered,
    stiffness_product,
)
from drake_dress.models.cloth.implicit import GRAVITY
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import (
    Csr,
    bending_bound,
    bending_matrix,
    lumped_mass,
    stretch_matrix,
)

_MAX_ITERATIONS = 200
_NO_BLOCK = np.zeros((0, 14))


@dataclass(frozen=True)
class Tape:
    """What a step leaves for its adjoint; all arrays (n,…) unless said otherwise."""

    x: FloatArray
    v: FloatArray
    near: Proximity
    obstacles: Obstacles
    stick_all: Factor
    bound: Factor
    mode: IntArray
    prescribed: FloatArray
    gap_prescribed: BoolArray
    stick_reaction: FloatArray
    stick_motion: FloatArray
    motion: FloatArray
    residual: FloatArray
    friction_direction: FloatArray
    change: FloatArray
    block: FloatArray


@dataclass(frozen=True)
class Gradient:
    """Derivative of a scalar with respect to the inputs of a step.

    Attributes:
        x, v: (n,3). held_motion: (k,3).
        origin: (m,3) by the position of each obstacle, per m.
        rotation: (m,3) by its rotation about its origin, per rad, world axes.
        velocity, angular_velocity: (m,3) by its velocities.
    """

    x: FloatArray
    v: FloatArray
    held_motion: FloatArray
    origin: FloatArray
    rotation: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray


class ExplicitBiasCloth:
    """Steps a garment as the paper does, with derivatives.

    Args:
        elements: the rest shape.
        material: SI values; `damping` is not used, the scheme damps by itself.
        time_step: h, s; large steps stay bounded.
        held: (k,) nodes that move with the grippers.
        gravity: (3,) m/s².
        tolerance: relative residual at which conjugate gradients stop.
        iterations: 1 for the paper's one-step scheme, else the largest number of conjugate
            gradient iterations on the linear system.
    """

    def __init__(
        self,
        elements: Elements,
        material: Material,
        time_step: float,
        held: IntArray,
        gravity: FloatArray = GRAVITY,
        tolerance: float = 1e-4,
        iterations: int = 1,
    ) -> None:
        self.elements = elements
        self.material = material
        self.time_step = time_step
        self.held = np.asarray(held, dtype=np.int32)
        self.gravity = np.asarray(gravity, dtype=np.float64)
        self.mass = lumped_mass(elements, material)
        stiffness = stretch_matrix(elements, material) + bending_bound(elements, material)
        p = sp.csc_matrix(sp.diags(self.mass) + time_step**2 * stiffness)
        self._symbolic = SymbolicFactor(p)
        self._tolerance = tolerance
        self._accelerated = iterations > 1
        self._max_iterations = iterations if iterations > 1 else _MAX_ITERATIONS
        inverse_diagonal = 1.0 / p.diagonal()
        if self._accelerated:
            bending = bending_matrix(elements, material)
            linear = Csr.of(sp.diags(self.mass) + time_step**2 * bending)
            self._system = SystemMatrix(linear, inverse_diagonal, elements, time_step**2)
        else:
            self._system = SystemMatrix(Csr.of(p), inverse_diagonal)
        masked = np.zeros(elements.node_count, dtype=np.bool_)
        masked[self.held] = True
        self._held_mask = masked
        self._held_factor = self._symbolic.factorize(masked)

    def step(
        self,
        x: FloatArray,
        v: FloatArray,
        held_motion: FloatArray,
        obstacles: Obstacles,
        modes: IntArray | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray, Tape]:
        """Returns position, velocity, reaction (n,3) after one step, and the tape.

        The reaction is the mean force of person and grippers on each node over the step, N.

        Args:
            x: (n,3) positions, m.
            v: (n,3) velocities, m/s.
            held_motion: (k,3) displacement of the held nodes over this step, m.
            obstacles: the person at the start of the step, with velocities.
            modes: (n,) contact types to hold instead of finding them (for derivative checks).
        """
        h = self.time_step
        force = self._force(x)
        block = self._prepare(x)
        g = self.mass[:, None] * (h * v) + 0.5 * h * h * force
        near = find_proximity(x, obstacles, self.material.margin)
        prescribed = np.zeros_like(x)
        prescribed[self.held] = held_motion
        touching = (
            self._touching(near, g, prescribed, block) if modes is None else _in_contact(modes)
        )
        # New contacts close their gap, deep ones leave by it: both in one step.
        prescribed[touching] = (
            h * near.surface_velocity[touching] - near.gap[touching, None] * near.normal[touching]
        )

        masked = self._held_mask | touching
        stick_all = self._symbolic.factorize(masked) if touching.any() else self._held_factor
        stick_motion, residual = self._dirichlet(stick_all, g, prescribed, masked, block)
        stick_reaction = np.where(masked[:, None], (2.0 / h**2) * residual, 0.0)
        if modes is None:
            mode = self._classify(stick_reaction, near, touching)
        else:
            mode = np.array(modes, dtype=np.int32)
            mode[self.held] = HELD
        friction, direction = self._friction(stick_reaction, near, mode)

        bound_mask = (mode == STICK) | (mode == HELD) | (mode == SLIP)
        if np.array_equal(bound_mask, masked):
            bound = stick_all
        else:
            bound = self._symbolic.factorize(bound_mask)
        motion = stick_motion
        if np.any(mode == SLIP) or bound is not stick_all:
            motion = self._reduced(
                bound, g + 0.5 * h * h * friction, prescribed, stick_motion, mode, near, block
            )
        residual = self._system.product(motion, block) - g
        reaction = np.where(bound_mask[:, None], (2.0 / h**2) * residual, 0.0)

        rate = h * force - 0.5 * h * h * self._stiffness(x, v)
        change = np.zeros_like(x)
        change[bound_mask] = motion[bound_mask] / h - v[bound_mask]
        change, _ = self._dirichlet(bound, rate, change, bound_mask, block)
        tape = Tape(
            x,
            v,
            near,
            obstacles,
            stick_all,
            bound,
            mode,
            prescribed,
            touching,
            stick_reaction,
            stick_motion,
            motion,
            residual,
            direction,
            change,
            block,
        )
        return x + motion, v + change, reaction, tape

    def vector_jacobian_product(
        self, tape: Tape, x_bar: FloatArray, v_bar: FloatArray, held_reaction_bar: FloatArray
    ) -> Gradient:
        """Returns the derivative of L with respect to the inputs of the taped step.

        Args:
            tape: of the step.
            x_bar: (n,3) ∂L/∂ of the step's positions.
            v_bar: (n,3) ∂L/∂ of the step's velocities.
            held_reaction_bar: (k,3) ∂L/∂ of the reaction at the held nodes.
        """
        h, n = self.time_step, len(tape.x)
        t, near = tape, tape.near
        mode, normal = t.mode, near.normal
        bound_mask = mode != FREE
        slip = mode == SLIP
        x_in, v_in = x_bar.copy(), v_bar.copy()
        force_in = np.zeros((n, 3))
        normal_in = np.zeros((n, 3))
        prescribed_in = np.zeros((n, 3))
        motion_in = x_bar.copy()
        g_in = np.zeros((n, 3))

        # velocities
        rate_in = self._free_solve(t.bound, v_bar, bound_mask, t.block)
        change_in = np.where(
            bound_mask[:, None], v_bar - self._system.product(rate_in, t.block), 0.0
        )
        motion_in += change_in / h
        v_in -= change_in
        force_in += h * rate_in
        stiff = self._stiffness(t.x, rate_in)
        v_in -= 0.5 * h * h * stiff
        x_in -= 0.5 * h * h * self._stiffness_derivative(t.x, t.v, rate_in)
        x_in -= self._operator_derivative(t.x, t.change, rate_in)

        # reaction of the held nodes: (2/h²) (P Δx − g)
        seed = np.zeros((n, 3))
        seed[self.held] = (2.0 / h**2) * held_reaction_bar
        motion_in += self._system.product(seed, t.block)
        g_in -= seed

        # the reduced system
        solved = np.zeros((n, 3))
        reduced = bool(slip.any()) or t.bound is not t.stick_all
        if reduced:
            self._cg(t.bound, mode, normal, motion_in, solved, t.block)
        else:
            solved = self._free_solve(t.bound, motion_in, bound_mask, t.block)
        x_in += self._operator_derivative(t.x, t.motion, seed - solved)
        left = motion_in - self._system.product(solved, t.block)
        g_in += solved
        full = (mode == STICK) | (mode == HELD)
        prescribed_in[full] += left[full]
        friction_in = np.zeros((n, 3))
        if slip.any():
            s, ns = slip, normal[slip]
            along = np.einsum("ij,ij->i", left[s], ns)
            prescribed_in[s] += along[:, None] * ns
            pressing = np.einsum("ij,ij->i", t.residual[s], ns)
            normal_in[s] += pressing[:, None] * solved[s] - along[:, None] * (
                t.motion[s] - t.prescribed[s]
            )
            friction_in[s] = 0.5 * h * h * solved[s]

            # friction follows the force of sticking
            reaction_in = np.zeros((n, 3))
            r, d = t.stick_reaction[s], t.friction_direction[s]
            mu = self.material.friction
            pressure = np.einsum("ij,ij->i", r, ns)
            tangential = r - pressure[:, None] * ns
            size = np.linalg.norm(tangential, axis=1)
            f_in = friction_in[s]
            pressure_in = mu * np.einsum("ij,ij->i", d, f_in)
            d_in = mu * pressure[:, None] * f_in
            t_in = (d_in - d * np.einsum("ij,ij->i", d, d_in)[:, None]) / size[:, None]
            t_normal = np.einsum("ij,ij->i", t_in, ns)
            reaction_in[s] = t_in + (pressure_in - t_normal)[:, None] * ns
            normal_in[s] += (
                pressure_in[:, None] * r - pressure[:, None] * t_in - t_normal[:, None] * r
            )
            reaction_in *= 2.0 / h**2
            stick_in = self._system.product(reaction_in, t.block)
            g_in -= reaction_in
            masked = self._held_mask | t.gap_prescribed
            solved = self._free_solve(t.stick_all, stick_in, masked, t.block)
            g_in += solved
            x_in += self._operator_derivative(t.x, t.stick_motion, reaction_in - solved)
            back = stick_in - self._system.product(solved, t.block)
            prescribed_in[masked] += back[masked]

        # prescribed motions: grippers, and surfaces that move and whose gap is closed
        held_in = prescribed_in[self.held].copy()
        bodies = np.zeros((4, t.obstacles.count, 3))
        c = t.gap_prescribed
        if c.any():
            x_in[c] += self._prescribed_derivative(t, prescribed_in[c], normal_in[c], bodies)

        v_in += h * self.mass[:, None] * g_in
        force_in += 0.5 * h * h * g_in
        x_in -= self._stiffness(t.x, force_in)
        return Gradient(x_in, v_in, held_in, *bodies)

    def _prescribed_derivative(
        self, tape: Tape, prescribed_in: FloatArray, normal_in: FloatArray, bodies: FloatArray
    ) -> FloatArray:
        """Returns the derivative (c,3) of prescribed motions and normals by the nodes in contact.

        The motion is h u − gap n, with u = v + ω × (x − origin) the surface's velocity. Adds to
        `bodies` (4,m,3) the derivative by origins, rotations and velocities of the obstacles: a gap
        only knows where a node is in its body's frame.
        """
        h, c, near = self.time_step, tape.gap_prescribed, tape.near
        x, owner, normal = tape.x[c], near.owner[c], near.normal[c]
        omega = tape.obstacles.twists()[1][owner]
        arm = x - tape.obstacles.origins()[owner]
        normal_in = normal_in - near.gap[c, None] * prescribed_in
        along = near.slope[c] * np.einsum("ij,ij->i", prescribed_in, normal)
        geometric = np.empty_like(x)
        normal_derivative(x, pack(tape.obstacles), owner, normal, normal_in, geometric)
        geometric -= along[:, None] * normal
        carried = h * np.cross(prescribed_in, omega)
        np.add.at(bodies[0], owner, -geometric - carried)
        np.add.at(bodies[1], owner, np.cross(normal, normal_in) - np.cross(arm, geometric))
        np.add.at(bodies[2], owner, h * prescribed_in)
        np.add.at(bodies[3], owner, h * np.cross(arm, prescribed_in))
        return geometric + carried

    def _force(self, x: FloatArray) -> FloatArray:
        m = self.material
        force = internal_force(self.elements, m.stretch_stiffness, m.bending_stiffness, x)
        force += self.mass[:, None] * self.gravity
        return force

    def _stiffness(self, x: FloatArray, z: FloatArray) -> FloatArray:
        m = self.material
        return stiffness_product(self.elements, m.stretch_stiffness, m.bending_stiffness, x, z)

    def _stiffness_derivative(self, x: FloatArray, v: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(zᵀ K(x) v)/∂x by a central difference of K along v (K is a gradient)."""
        largest = float(np.abs(v).max())
        if largest == 0.0:
            return np.zeros_like(x)
        step = 1e-6 / largest
        return (self._stiffness(x + step * v, z) - self._stiffness(x - step * v, z)) / (2.0 * step)

    def _operator_derivative(self, x: FloatArray, z: FloatArray, w: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x of the system matrix; P does not depend on x."""
        if not self._accelerated:
            return np.zeros_like(x)
        return self.time_step**2 * self._stiffness_derivative(x, z, w)

    def _prepare(self, x: FloatArray) -> FloatArray:
        """Returns the element data of the system matrix at `x`; none for the one-step scheme."""
        if not self._accelerated:
            return _NO_BLOCK
        e = self.elements
        block = np.empty((len(e.triangle), 14))
        prepare_filtered(
            x,
            e.triangle,
            e.triangle_gradient,
            e.triangle_area,
            self.material.stretch_stiffness,
            block,
        )
        return block

    def _free_solve(
        self, factor: Factor, rhs: FloatArray, masked: BoolArray, block: FloatArray
    ) -> FloatArray:
        """Returns A_ff⁻¹ rhs_f, zero in masked rows."""
        if not self._accelerated:
            return factor.solve(rhs)
        z = np.zeros_like(rhs)
        mode = np.where(masked, HELD, FREE).astype(np.int32)
        self._cg(factor, mode, z, rhs, z, block)
        return z

    def _dirichlet(
        self,
        factor: Factor,
        rhs: FloatArray,
        prescribed: FloatArray,
        masked: BoolArray,
        block: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Returns the solution with `prescribed` motions in masked rows, and A z − rhs."""
        fixed = np.where(masked[:, None], prescribed, 0.0)
        solution = self._free_solve(factor, rhs - self._system.product(fixed, block), masked, block)
        solution = solution + fixed
        return solution, self._system.product(solution, block) - rhs

    def _cg(
        self,
        factor: Factor,
        mode: IntArray,
        normal: FloatArray,
        rhs: FloatArray,
        z: FloatArray,
        block: FloatArray,
    ) -> None:
        self._system.solve(
            factor, block, mode, normal, rhs, z, self._tolerance, self._max_iterations
        )

    def _reduced(
        self,
        factor: Factor,
        rhs: FloatArray,
        prescribed: FloatArray,
        start: FloatArray,
        mode: IntArray,
        near: Proximity,
        block: FloatArray,
    ) -> FloatArray:
        """Returns Δx with sticking and held rows prescribed and slipping rows along the surface."""
        z = start.copy()
        full = (mode == STICK) | (mode == HELD)
        z[full] = prescribed[full]
        slip = mode == SLIP
        n = near.normal[slip]
        z[slip] += np.einsum("ij,ij->i", prescribed[slip] - z[slip], n)[:, None] * n
        self._cg(factor, mode, near.normal, rhs, z, block)
        return z

    def _touching(
        self, near: Proximity, g: FloatArray, prescribed: FloatArray, block: FloatArray
    ) -> BoolArray:
        """Returns (n,) which nodes would enter the surface without contact, or lie on it."""
        if not len(near.gap) or near.owner[0] < 0:
            return np.zeros(len(g), dtype=np.bool_)
        free, _ = self._dirichlet(self._held_factor, g, prescribed, self._held_mask, block)
        relative = free - self.time_step * near.surface_velocity
        ahead = near.gap + np.einsum("ij,ij->i", near.normal, relative)
        reach = near.gap < 0.08
        touching: BoolArray = ((ahead < 0.0) | (near.gap < 0.0)) & reach & ~self._held_mask
        return touching

    def _classify(self, reaction: FloatArray, near: Proximity, touching: BoolArray) -> IntArray:
        """Returns (n,) contact types by the force that sticking would need (Eq. contact-type)."""
        mode = np.zeros(len(reaction), dtype=np.int32)
        mode[self.held] = HELD
        pressure = np.einsum("ij,ij->i", reaction, near.normal)
        tangential = np.linalg.norm(reaction - pressure[:, None] * near.normal, axis=1)
        pressed = touching & (pressure > 0.0)
        slips = tangential > self.material.friction * pressure
        mode[pressed & ~slips] = STICK
        mode[pressed & slips] = SLIP
        return mode

    def _friction(
        self, reaction: FloatArray, near: Proximity, mode: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Returns friction (n,3), N, of slipping nodes and its unit direction (n,3)."""
        friction = np.zeros_like(reaction)
        direction = np.zeros_like(reaction)
        slip = mode == SLIP
        n, r = near.normal[slip], reaction[slip]
        pressure = np.einsum("ij,ij->i", r, n)
        tangential = r - pressure[:, None] * n
        size = np.maximum(np.linalg.norm(tangential, axis=1), 1e-300)
        direction[slip] = tangential / size[:, None]
        friction[slip] = (self.material.friction * pressure)[:, None] * direction[slip]
        return friction, direction


def _in_contact(mode: IntArray) -> BoolArray:
    touching: BoolArray = (mode == STICK) | (mode == SLIP)
    return touching
