"""The adjoint of a step of `ExplicitBiasCloth`, for fixed contact types.

The step computes sticking → modes and friction → motion → velocity. The adjoint runs back through
the same solves; every inner iteration is symmetric, so they are solves of the same system. Beyond
the paper it includes how friction follows the sticking force, the projection on the surface, how
normals and gaps follow nodes and bodies, and how the system follows positions if it does.

With `frozen_contact`, surfaces stay where each node met them, and slipping nodes keep the direction
of their friction. That is not the derivative of the step, but it is the one to use for descent.
Through several steps in contact the exact derivative grows tenfold with each: a node that is a
millimetre nearer to a limb moves its stiff neighbours by a millimetre, and lever arms amplify this
for the cloth that they carry. Motions of a centimetre show no such growth (docs/control.md has the
figures).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.cloth.contact.distance import normal_derivative
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.explicit.inner.interface import StepSystem, Unknown
from drake_dress.models.cloth.forces import (
    force_and_product,
    stiffness_product,
    stiffness_products,
)
from drake_dress.models.cloth.layered import pushed_nodes

if TYPE_CHECKING:
    from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, Tape

# Largest displacement of a node in the finite difference of K along v, m.
_STEP = 1e-8


@dataclass(frozen=True)
class Gradient:
    """Derivative of a scalar with respect to the inputs of a step.

    Attributes:
        x: (n,3) by the positions.
        v: (n,3) by the velocities.
        held_motion: (k,3) by the displacements of the held nodes.
        origin: (m,3) by the position of each obstacle, per m.
        rotation: (m,3) by its rotation about its origin, per rad, world axes.
        velocity: (m,3) by its velocity.
        angular_velocity: (m,3) by its angular velocity.
        material: by the fields of `Material` of the same names, if requested.
    """

    x: FloatArray
    v: FloatArray
    held_motion: FloatArray
    origin: FloatArray
    rotation: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    material: dict[str, float] = field(default_factory=dict)


def run_adjoint(
    cloth: ExplicitBiasCloth,
    tape: Tape,
    x_bar: FloatArray,
    v_bar: FloatArray,
    held_reaction_bar: FloatArray,
    by_material: bool,
    frozen_contact: bool = False,
) -> Gradient:
    """Returns the derivative by all inputs; see `ExplicitBiasCloth.vector_jacobian_product`."""
    h, held = cloth.time_step, cloth.held
    t, nodes, system = tape, tape.contacts.nodes, tape.system
    follows = len(nodes) > 0 and not frozen_contact
    motion_in, v_bar = _through_layers(cloth, t, x_bar, v_bar)

    # The reaction of held nodes is (2/h²) (A Δx − g), which seeds their prescribed values, or
    # k (Δp − 2 Δx) with springs.
    nothing = seed = np.zeros((0, 3))
    if cloth.spring is None:
        nothing, seed = np.zeros((len(held), 3)), (-2.0 / h**2) * held_reaction_bar
    else:
        motion_in = motion_in.copy()
        motion_in[held] -= 2.0 * cloth.spring * held_reaction_bar
    back = _Backward(*system.start((motion_in, seed), (v_bar, nothing)), system.blank())
    bound = _through_binding(cloth, t, back, follows) if len(nodes) else _NOTHING_BOUND

    g_in, rate_in = system.finish(back.motion, back.change, less=back.stick)
    v_in, held_in = _through_grippers(
        cloth, system, v_bar, motion_in, held_reaction_bar, g_in, rate_in
    )
    force_in = (0.5 * h * h) * g_in + h * rate_in
    v_in[nodes] -= bound.target

    by_force, by_rate, along_v = _stiffness_terms(cloth, t.x, t.v, force_in, rate_in)
    x_in = x_bar - by_force - (0.5 * h * h) * along_v
    v_in -= (0.5 * h * h) * by_rate

    bodies = np.zeros((4, t.obstacles.count, 3))
    if follows:
        x_in[nodes] += _contact_derivative(
            cloth, t, bound.prescribed, bound.target, bound.normal, bodies
        )
    solves = [(1.0, t.motion_unknown, back.motion), (1.0, t.change_unknown, back.change)]
    if t.stick_unknown is not None and np.any(t.friction.mode == SLIP) and follows:
        solves.append((-1.0, t.stick_unknown, back.stick))
    if cloth.inner.depends_on_position:
        for sign, forward, backward in solves:
            for w, z in system.pairs(forward, backward):
                x_in -= sign * cloth.inner.derivative(t.x, w, z)
    material: dict[str, float] = {}
    if by_material:
        material = _material_derivative(cloth, t, g_in, rate_in, force_in)
        for name in material:
            for sign, forward, backward in solves:
                material[name] += sign * system.by_parameter(name, forward, backward)
        material["friction"] = bound.friction
        material["margin"] = float(np.sum(bound.prescribed * t.contacts.normal))
    origin, rotation, velocity, angular_velocity = bodies
    return Gradient(x_in, v_in, held_in, origin, rotation, velocity, angular_velocity, material)


@dataclass(frozen=True)
class _Backward:
    """The unknowns of the adjoint solves: for Δx, for Δv, and for Δx with all nodes sticking."""

    motion: Unknown
    change: Unknown
    stick: Unknown


@dataclass(frozen=True)
class _Bound:
    """Derivatives (c,3) by the prescribed Δx of nodes in contact, by their Δv, and by normals.

    `friction` is the derivative by the coefficient.
    """

    prescribed: FloatArray
    target: FloatArray
    normal: FloatArray
    friction: float = 0.0


_NOTHING_BOUND = _Bound(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)))


def _through_layers(
    cloth: ExplicitBiasCloth, tape: Tape, x_bar: FloatArray, v_bar: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the derivatives (n,3) by Δx and v before layer separation."""
    if tape.separation is None or cloth.layers is None:
        return x_bar, v_bar
    pushed = pushed_nodes(tape.separation.rate_change)[:, None]
    motion_in = cloth.layers.correct_vjp(tape.separation, x_bar)
    rate_bar = np.where(pushed, v_bar / cloth.time_step, 0.0)
    motion_in += cloth.layers.rate_vjp(tape.separation, rate_bar)
    return motion_in, np.where(pushed, 0.0, v_bar)


def _through_binding(
    cloth: ExplicitBiasCloth, tape: Tape, back: _Backward, follows: bool
) -> _Bound:
    """Binds the adjoint's unknowns in place; returns the derivatives by their constraints.

    Args:
        cloth: the garment.
        tape: tape of a step with nodes in contact.
        back: the unknowns, not bound yet.
        follows: whether surfaces and the direction of friction follow nodes.
    """
    t, contacts, friction, system = tape, tape.contacts, tape.friction, tape.system
    normal, mode = contacts.normal, friction.mode
    slip, late = mode == SLIP, friction.velocity_mode == SLIP
    zero = np.zeros((len(mode), 3))
    pull, _ = system.hold(
        back.change, friction.velocity_mode, normal, zero, friction.push, backward=True
    )
    target_in = -pull
    pull, _ = system.hold(back.motion, mode, normal, zero, friction.push, backward=True)
    prescribed_in = -pull
    if not (slip.any() and follows):
        return _Bound(prescribed_in, target_in, np.zeros_like(prescribed_in))
    by_row, by_binding = system.by_directions(t.motion_unknown, back.motion, t.prescribed, slip)
    if late.any():
        more = system.by_directions(t.change_unknown, back.change, t.target_change, late)
        by_row, by_binding = by_row + more[0], by_binding + more[1]
    # friction follows the direction of the sticking force
    stick_in, by_friction, friction_in = _through_friction(cloth, t, by_binding, slip)
    everything = np.full(len(mode), STICK, dtype=np.int32)
    push, _ = system.hold(back.stick, everything, normal, (2.0 / cloth.time_step**2) * stick_in)
    normal_in = by_row + by_binding + by_friction
    return _Bound(prescribed_in + push, target_in, normal_in, friction_in)


def _through_grippers(
    cloth: ExplicitBiasCloth,
    system: StepSystem,
    v_bar: FloatArray,
    motion_in: FloatArray,
    held_reaction_bar: FloatArray,
    g_in: FloatArray,
    rate_in: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Returns the derivatives by v (n,3), except through forces, and by held motion (k,3).

    Args:
        cloth: the garment.
        system: system of the step.
        v_bar: (n,3) derivative by the velocity after the solves.
        motion_in: (n,3) by Δx after them.
        held_reaction_bar: (k,3) by the grippers' forces.
        g_in: (n,3) by the right-hand side of Δx.
        rate_in: (n,3) by that of Δv.
    """
    h, held, mass = cloth.time_step, cloth.held, cloth.mass[:, None]
    v_in = v_bar + (h * mass) * g_in
    if cloth.spring is None:
        held_change = v_bar[held] - system.held_rows(rate_in)
        held_in = motion_in[held] - system.held_rows(g_in) + held_change / h
        v_in[held] -= held_change
    else:
        k = cloth.spring
        held_in = k * (held_reaction_bar + 0.5 * h * h * g_in[held] + h * rate_in[held])
        v_in[held] -= (0.5 * h * h * k) * rate_in[held]
    return v_in, held_in


def _through_friction(
    cloth: ExplicitBiasCloth, tape: Tape, binding_in: FloatArray, slip: BoolArray
) -> tuple[FloatArray, FloatArray, float]:
    """Returns the derivative by sticking forces (c,3), normals (c,3) and the coefficient.

    Slipping nodes are bound along n + μ d, d the direction of the sticking force's tangential part.

    Args:
        cloth: the garment.
        tape: tape of the step.
        binding_in: (c,3) derivative by n + μ d of the nodes in contact.
        slip: (c,) which of them slip.
    """
    friction, n = tape.friction, tape.contacts.normal[slip]
    r, d, p = tape.stick_reaction[slip], friction.direction[slip], friction.pressure[slip]
    b_in = binding_in[slip]
    d_in = cloth.material.friction * b_in
    t_in = d_in - d * np.einsum("ij,ij->i", d, d_in)[:, None]
    t_in /= np.maximum(friction.tangential[slip], 1e-300)[:, None]
    t_normal = np.einsum("ij,ij->i", t_in, n)[:, None]
    reaction_in, normal_in = np.zeros_like(binding_in), np.zeros_like(binding_in)
    reaction_in[slip] = t_in - t_normal * n
    normal_in[slip] = -p[:, None] * t_in - t_normal * r
    return reaction_in, normal_in, float(np.sum(b_in * d))


def _stiffness_terms(
    cloth: ExplicitBiasCloth,
    x: FloatArray,
    v: FloatArray,
    force_in: FloatArray,
    rate_in: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns K force_in, K rate_in and ∂(rate_inᵀ K(x) v)/∂x, all (n,3).

    K is a Hessian, so the last is the derivative of K rate_in along v.
    """
    m = cloth.material
    stiffness = (cloth.elements, m.stretch_stiffness, m.bending_stiffness)
    by_force, by_rate = stiffness_products(*stiffness, x, force_in, rate_in)
    largest = float(np.abs(v).max())
    if largest == 0.0:
        return by_force, by_rate, np.zeros_like(x)
    step = _STEP / largest
    ahead = stiffness_product(*stiffness, x + step * v, rate_in)
    return by_force, by_rate, (ahead - by_rate) / step


def _material_derivative(
    cloth: ExplicitBiasCloth,
    tape: Tape,
    g_in: FloatArray,
    rate_in: FloatArray,
    force_in: FloatArray,
) -> dict[str, float]:
    """Returns the derivatives by stiffnesses and density through forces and right-hand sides.

    Forces are linear in each parameter.

    Args:
        cloth: the garment.
        tape: tape of the step.
        g_in: (n,3) derivative by the right-hand side of Δx.
        rate_in: (n,3) by that of Δv.
        force_in: (n,3) derivative by the force f.
    """
    h, found = cloth.time_step, {}
    for name, k, b in (("stretch_stiffness", 1.0, 0.0), ("bending_stiffness", 0.0, 1.0)):
        force, rate = force_and_product(cloth.elements, k, b, tape.x, tape.v)
        found[name] = float(np.sum(force_in * force) - 0.5 * h * h * np.sum(rate_in * rate))
    area = cloth.elements.node_area[:, None]
    fall = area * cloth.gravity
    found["surface_density"] = float(
        np.sum(g_in * (h * area * tape.v + 0.5 * h * h * fall)) + h * np.sum(rate_in * fall)
    )
    return found


def _contact_derivative(
    cloth: ExplicitBiasCloth,
    tape: Tape,
    prescribed_in: FloatArray,
    target_in: FloatArray,
    normal_in: FloatArray,
    bodies: FloatArray,
) -> FloatArray:
    """Returns the derivative (c,3) by contact nodes through prescribed values and normals.

    The prescribed motion is h u − gap n, u = v + ω × (x − origin) the velocity of the surface. Adds
    the derivatives by origins, rotations and velocities of the obstacles to `bodies` (4,m,3); a gap
    depends only on the node's position in its body's frame.
    """
    h, near = cloth.time_step, tape.contacts
    x, owner, normal = tape.x[near.nodes], near.owner, near.normal
    normal_in = normal_in - near.gap[:, None] * prescribed_in
    geometric = np.empty_like(x)
    normal_derivative(x, tape.obstacles.packed, owner, normal, normal_in, geometric)
    _carry(
        x,
        owner,
        normal,
        near.slope,
        tape.obstacles.origins(),
        tape.obstacles.twists()[1],
        prescribed_in,
        h * prescribed_in + target_in,
        normal_in,
        geometric,
        bodies,
    )
    return geometric


@nb.njit(cache=True, nogil=True)
def _carry(  # type: ignore[no-untyped-def]
    x, owner, normal, slope, origin, omega, prescribed_in, surface_in, normal_in, geometric, bodies
):
    """Adds the remaining terms to `geometric` (c,3), and all terms to `bodies` (4,m,3).

    `geometric` already holds the terms of the normals.
    """
    for i in range(x.shape[0]):
        m = owner[i]
        n0, n1, n2 = normal[i, 0], normal[i, 1], normal[i, 2]
        p0, p1, p2 = prescribed_in[i, 0], prescribed_in[i, 1], prescribed_in[i, 2]
        s0, s1, s2 = surface_in[i, 0], surface_in[i, 1], surface_in[i, 2]
        q0, q1, q2 = normal_in[i, 0], normal_in[i, 1], normal_in[i, 2]
        a0, a1, a2 = x[i, 0] - origin[m, 0], x[i, 1] - origin[m, 1], x[i, 2] - origin[m, 2]
        w0, w1, w2 = omega[m, 0], omega[m, 1], omega[m, 2]
        along = slope[i] * (p0 * n0 + p1 * n1 + p2 * n2)
        g0 = geometric[i, 0] - along * n0
        g1 = geometric[i, 1] - along * n1
        g2 = geometric[i, 2] - along * n2
        c0, c1, c2 = s1 * w2 - s2 * w1, s2 * w0 - s0 * w2, s0 * w1 - s1 * w0
        geometric[i, 0] = g0 + c0
        geometric[i, 1] = g1 + c1
        geometric[i, 2] = g2 + c2
        bodies[0, m, 0] -= g0 + c0
        bodies[0, m, 1] -= g1 + c1
        bodies[0, m, 2] -= g2 + c2
        bodies[1, m, 0] += (n1 * q2 - n2 * q1) - (a1 * g2 - a2 * g1)
        bodies[1, m, 1] += (n2 * q0 - n0 * q2) - (a2 * g0 - a0 * g2)
        bodies[1, m, 2] += (n0 * q1 - n1 * q0) - (a0 * g1 - a1 * g0)
        bodies[2, m, 0] += s0
        bodies[2, m, 1] += s1
        bodies[2, m, 2] += s2
        bodies[3, m, 0] += a1 * s2 - a2 * s1
        bodies[3, m, 1] += a2 * s0 - a0 * s2
        bodies[3, m, 2] += a0 * s1 - a1 * s0
