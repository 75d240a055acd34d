"""The steps of `BatchCloth.step` pulled back, one thread per garment and node.

Names: `y_in` is the derivative of the scalar L with respect to y; `back_motion`, `back_change` and
`back_stick` are the adjoint's solutions that go with Δx, Δv and Δx of sticking. Contact types are
held; friction follows the force of sticking, normals follow the nodes.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.arrays import DeviceArray
from drake_dress.models.cloth.batch.bodies import Bodies, axis_parameter, set_of
from drake_dress.models.cloth.batch.contact_kernels import Proximity
from drake_dress.models.cloth.batch.friction_kernels import Friction
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.batch.system import System, row_product
from drake_dress.models.cloth.filtered_cg import FREE, SLIP, STICK

wp.set_module_options({"enable_backward": False})

_FREE = wp.constant(FREE)
_STICK = wp.constant(STICK)
_SLIP = wp.constant(SLIP)
_ZERO = wp.constant(wp.float64(0.0))
_ONE = wp.constant(wp.float64(1.0))
_TWO = wp.constant(wp.float64(2.0))
_TINY = wp.constant(wp.float64(1e-300))
_SMALLEST_RADIUS = wp.constant(wp.float64(1e-9))


@wp.kernel
def seed_reaction(
    held_index: wp.array[wp.int32],
    reaction_in: wp.array2d[wp.vec3d],
    square: wp.float64,
    seed: wp.array2d[wp.vec3d],
):
    """Writes (B,n) what the reaction at held nodes, (2/h²)(P Δx − g), gives to P Δx − g."""
    b, i = wp.tid()
    k = held_index[i]
    if k >= 0:
        seed[b, i] = (_TWO / square) * reaction_in[b, k]
    else:
        seed[b, i] = wp.vec3d()


@wp.kernel
def seed_motion(
    system: System,
    parameters: Parameters,
    x_bar: wp.array2d[wp.vec3d],
    seed: wp.array2d[wp.vec3d],
    motion_in: wp.array2d[wp.vec3d],
):
    """Writes the derivative by Δx of positions and reactions."""
    b, i = wp.tid()
    motion_in[b, i] = x_bar[b, i] + row_product(system, parameters, seed, b, i)


@wp.kernel
def pull_held(
    system: System,
    parameters: Parameters,
    held_index: wp.array[wp.int32],
    h: wp.float64,
    motion_in: wp.array2d[wp.vec3d],
    v_bar: wp.array2d[wp.vec3d],
    back_motion: wp.array2d[wp.vec3d],
    back_change: wp.array2d[wp.vec3d],
    prescribed_in: wp.array2d[wp.vec3d],
    target_in: wp.array2d[wp.vec3d],
):
    """Writes the derivative by prescribed Δx and Δv of held nodes, zero for others."""
    b, i = wp.tid()
    prescribed_in[b, i] = wp.vec3d()
    target_in[b, i] = wp.vec3d()
    if held_index[i] >= 0:
        change_in = v_bar[b, i] - row_product(system, parameters, back_change, b, i)
        left = motion_in[b, i] - row_product(system, parameters, back_motion, b, i)
        target_in[b, i] = change_in
        prescribed_in[b, i] = left + change_in / h


@wp.struct
class Backward:
    """The adjoint's solutions and their right-hand sides, (B,n): motion_in, v_bar."""

    motion_in: wp.array2d[wp.vec3d]
    v_bar: wp.array2d[wp.vec3d]
    motion: wp.array2d[wp.vec3d]
    change: wp.array2d[wp.vec3d]


@wp.struct
class Forward:
    """What the adjoint reads of a step in contact, (B,n): see `tape.Contact` and `tape.Tape`."""

    prescribed: wp.array2d[wp.vec3d]
    target_change: wp.array2d[wp.vec3d]
    motion: wp.array2d[wp.vec3d]
    change: wp.array2d[wp.vec3d]
    multiplier: wp.array2d[wp.float64]
    change_multiplier: wp.array2d[wp.float64]


def make_backward(motion_in: wp.array, v_bar: wp.array) -> Backward:
    """Returns right-hand sides (B,n) with memory for the solutions, zero."""
    backward = Backward()
    backward.motion_in, backward.v_bar = motion_in, v_bar
    backward.motion, backward.change = wp.zeros_like(motion_in), wp.zeros_like(motion_in)
    return backward


def make_forward(**arrays: DeviceArray) -> Forward:
    """Returns the arrays that are named."""
    forward = Forward()
    for name, array in arrays.items():
        setattr(forward, name, array)
    return forward


@wp.func
def _bound_part(mode: wp.int32, n: wp.vec3d, left: wp.vec3d) -> wp.vec3d:
    """Returns what of a residual the bonds take backward."""
    if mode == _STICK:
        return left
    if mode == _SLIP:
        return wp.dot(left, n) * n
    return wp.vec3d()


@wp.kernel
def pull_bonds(
    system: System,
    parameters: Parameters,
    near: Proximity,
    friction: Friction,
    forward: Forward,
    backward: Backward,
    prescribed_in: wp.array2d[wp.vec3d],
    target_in: wp.array2d[wp.vec3d],
    normal_in: wp.array2d[wp.vec3d],
    back_stick: wp.array2d[wp.vec3d],
    friction_in: wp.array2d[wp.float64],
):
    """Pulls back the bonds of touching nodes to what is prescribed, normals and sticking forces.

    `back_stick` becomes the derivative by P Δx − g of the sticking solution, `friction_in` (B,n)
    each node's share of that by the coefficient of friction.
    """
    b, i = wp.tid()
    normal_in[b, i] = wp.vec3d()
    back_stick[b, i] = wp.vec3d()
    friction_in[b, i] = _ZERO
    if near.owner[b, i] < 0:
        return
    n = near.normal[b, i]
    mode = friction.mode[b, i]
    velocity_mode = friction.velocity_mode[b, i]
    z = backward.motion[b, i]
    y = backward.change[b, i]
    left = backward.motion_in[b, i] - row_product(system, parameters, backward.motion, b, i)
    change_left = backward.v_bar[b, i] - row_product(system, parameters, backward.change, b, i)
    prescribed_in[b, i] = _bound_part(mode, n, left)
    target_in[b, i] = _bound_part(velocity_mode, n, change_left)
    if mode != _SLIP:
        return
    # n·(z − target) = 0 with the force ν (n + μ d): by the row n and by the force's direction.
    by_row = -wp.dot(left, n) * (forward.motion[b, i] - forward.prescribed[b, i])
    by_binding = forward.multiplier[b, i] * z
    if velocity_mode == _SLIP:
        away = forward.change[b, i] - forward.target_change[b, i]
        by_row -= wp.dot(change_left, n) * away
        by_binding += forward.change_multiplier[b, i] * y
    # d is the direction of the tangential part of the sticking force r.
    r = friction.reaction[b, i]
    d = friction.direction[b, i]
    p = wp.dot(r, n)
    d_in = parameters.friction[b] * by_binding
    t_in = (d_in - wp.dot(d, d_in) * d) / wp.max(wp.length(r - p * n), _TINY)
    t_normal = wp.dot(t_in, n)
    back_stick[b, i] = (_TWO / system.square) * (t_in - t_normal * n)
    normal_in[b, i] = by_row + by_binding - p * t_in - t_normal * r
    friction_in[b, i] = wp.dot(by_binding, d)


@wp.kernel
def pull_sticking(
    system: System,
    parameters: Parameters,
    slips: wp.array[wp.int32],
    stick_mode: wp.array2d[wp.int32],
    back_stick: wp.array2d[wp.vec3d],
    prescribed_in: wp.array2d[wp.vec3d],
):
    """Adds what sticking, which friction follows, gives to prescribed motions."""
    b, i = wp.tid()
    if slips[b] != 0 and stick_mode[b, i] != _FREE:
        pulled = row_product(system, parameters, back_stick, b, i)
        prescribed_in[b, i] = prescribed_in[b, i] + pulled


@wp.func
def _normal_derivative(
    bodies: Bodies, s: wp.int32, k: wp.int32, p: wp.vec3d, n: wp.vec3d, n_in: wp.vec3d
) -> wp.vec3d:
    """Returns the derivative of n_in · normal with respect to p."""
    if k >= bodies.capsules:
        return wp.vec3d()
    t = axis_parameter(bodies, s, k, p)
    axis = bodies.end[s, k] - bodies.origin[s, k]
    radial = wp.length(p - bodies.origin[s, k] - t * axis)
    out = (n_in - wp.dot(n_in, n) * n) / wp.max(radial, _SMALLEST_RADIUS)
    if t > _ZERO and t < _ONE:
        out -= (wp.dot(out, axis) / wp.dot(axis, axis)) * axis
    return out


@wp.kernel
def pull_contact(
    bodies: Bodies,
    near: Proximity,
    h: wp.float64,
    x: wp.array2d[wp.vec3d],
    prescribed_in: wp.array2d[wp.vec3d],
    target_in: wp.array2d[wp.vec3d],
    normal_in: wp.array2d[wp.vec3d],
    x_in: wp.array2d[wp.vec3d],
):
    """Adds to `x_in` what touching nodes give to motions h u − gap n, velocities u and normals."""
    b, i = wp.tid()
    k = near.owner[b, i]
    if k < 0:
        return
    s = set_of(bodies, b)
    n = near.normal[b, i]
    u_in = prescribed_in[b, i]
    to_normal = normal_in[b, i] - near.gap[b, i] * u_in
    geometric = _normal_derivative(bodies, s, k, x[b, i], n, to_normal) - wp.dot(u_in, n) * n
    surface_in = h * u_in + target_in[b, i]
    x_in[b, i] = x_in[b, i] + geometric + wp.cross(surface_in, bodies.angular_velocity[s, k])


@wp.kernel
def pull_right_hand_side(
    parameters: Parameters,
    node_area: wp.array[wp.float64],
    h: wp.float64,
    v_bar: wp.array2d[wp.vec3d],
    seed: wp.array2d[wp.vec3d],
    back_motion: wp.array2d[wp.vec3d],
    back_change: wp.array2d[wp.vec3d],
    back_stick: wp.array2d[wp.vec3d],
    target_in: wp.array2d[wp.vec3d],
    motion_weight: wp.array2d[wp.vec3d],
    g_in: wp.array2d[wp.vec3d],
    force_in: wp.array2d[wp.vec3d],
    v_in: wp.array2d[wp.vec3d],
):
    """Pulls back g = h M v + ½h² f, the velocity's h f, and v + Δv with Δv = u − v where bound.

    Writes also the weight w for which P enters L as wᵀ P Δx.
    """
    b, i = wp.tid()
    weight = seed[b, i] - back_motion[b, i]
    motion_weight[b, i] = weight
    to_g = -(weight + back_stick[b, i])
    g_in[b, i] = to_g
    force_in[b, i] = h * back_change[b, i] + (h * h / _TWO) * to_g
    mass = parameters.density[b] * node_area[i]
    v_in[b, i] = v_bar[b, i] - target_in[b, i] + (h * mass) * to_g


@wp.kernel
def take_held(
    held: wp.array[wp.int32],
    prescribed_in: wp.array2d[wp.vec3d],
    held_in: wp.array2d[wp.vec3d],
):
    """Writes the derivative (B,k) by the motions of held nodes."""
    b, k = wp.tid()
    held_in[b, k] = prescribed_in[b, held[k]]
