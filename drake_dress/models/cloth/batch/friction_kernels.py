"""What touching nodes do, and the forces on them, one thread per garment and node.

The rules are those of `contact.friction`: by the force that sticking would take a node takes off,
slips or sticks, and the forces of the motion that follows correct this.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.contact_kernels import Proximity
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.batch.system import System, row_product
from drake_dress.models.cloth.contact.friction import LYING, TOLERATED_EXCESS
from drake_dress.models.cloth.filtered_cg import FREE, SLIP, STICK

wp.set_module_options({"enable_backward": False})

_FREE = wp.constant(FREE)
_STICK = wp.constant(STICK)
_SLIP = wp.constant(SLIP)
_ZERO = wp.constant(wp.float64(0.0))
_TWO = wp.constant(wp.float64(2.0))
_LYING = wp.constant(wp.float64(LYING))
_TOLERATED_EXCESS = wp.constant(wp.float64(TOLERATED_EXCESS))


@wp.struct
class Friction:
    """Contact types, (B,n).

    Attributes:
        mode: FREE, STICK, SLIP or HELD, of the motion; velocity_mode: of the velocity at the end.
        reaction: the force of sticking, N; zero for nodes that touch nothing.
        direction: unit along its tangential part.
        push: friction of slipping nodes per normal force, μ d.
    """

    mode: wp.array2d[wp.int32]
    velocity_mode: wp.array2d[wp.int32]
    reaction: wp.array2d[wp.vec3d]
    direction: wp.array2d[wp.vec3d]
    push: wp.array2d[wp.vec3d]


def make_friction(mode: wp.array, velocity_mode: wp.array) -> Friction:
    """Returns contact types (B,n), the rest zero."""
    friction = Friction()
    friction.mode, friction.velocity_mode = mode, velocity_mode
    for name in ("reaction", "direction", "push"):
        setattr(friction, name, wp.zeros(mode.shape, dtype=wp.vec3d, device=mode.device))
    return friction


@wp.kernel
def find_modes(
    system: System,
    parameters: Parameters,
    near: Proximity,
    g: wp.array2d[wp.vec3d],
    h: wp.float64,
    stick_motion: wp.array2d[wp.vec3d],
    stick_mode: wp.array2d[wp.int32],
    target_change: wp.array2d[wp.vec3d],
    judge: wp.int32,
    friction: Friction,
    slips: wp.array[wp.int32],
    changes: wp.array[wp.int32],
):
    """Writes the contact types by the force of sticking.

    Friction that exceeds the force which would end the motion, less the momentum of sliding over h,
    has stopped the node before the step is over: it sticks in velocity.

    Args:
        system: with `parameters`, P.
        parameters: the fabrics.
        near: of the nodes.
        g: right-hand side of Δx.
        h: s.
        stick_motion: Δx with all touching nodes sticking.
        stick_mode: their modes then.
        target_change: Δv of sticking nodes.
        judge: 0 to keep the modes of touching nodes that `friction` has.
        friction: out.
        slips: (B,) out, 1 for garments with nodes that slip.
        changes: (B,) out, 1 for garments where not all touching nodes stick.
    """
    b, i = wp.tid()
    if stick_mode[b, i] != _STICK:
        friction.mode[b, i] = stick_mode[b, i]
        friction.velocity_mode[b, i] = stick_mode[b, i]
        return
    mu = parameters.friction[b]
    left = row_product(system, parameters, stick_motion, b, i) - g[b, i]
    r = (_TWO / system.square) * left
    n = near.normal[b, i]
    p = wp.dot(r, n)
    t = r - p * n
    size = wp.length(t)
    d = wp.vec3d()
    if size > _ZERO:
        d = t / size
    if judge != 0:
        mode = wp.int32(_STICK)
        if p <= _ZERO:
            mode = _FREE
        elif size > mu * p:
            mode = _SLIP
        velocity_mode = mode
        if mode == _SLIP:
            mass = parameters.density[b] * system.node_area[i]
            sliding = mass * wp.dot(target_change[b, i], d)
            if mu * p > size - sliding / h:
                velocity_mode = _STICK
        friction.mode[b, i] = mode
        friction.velocity_mode[b, i] = velocity_mode
    friction.reaction[b, i] = r
    friction.direction[b, i] = d
    if friction.mode[b, i] != _STICK:
        changes[b] = 1
    if friction.mode[b, i] == _SLIP:
        friction.push[b, i] = mu * d
        slips[b] = 1


@wp.kernel
def let_go(
    system: System,
    parameters: Parameters,
    near: Proximity,
    g: wp.array2d[wp.vec3d],
    motion: wp.array2d[wp.vec3d],
    active: wp.array[wp.int32],
    friction: Friction,
    bound: wp.array2d[wp.float64],
    excess: wp.array2d[wp.float64],
    changes: wp.array[wp.int32],
):
    """Frees nodes that a force would have to draw to a surface over a gap.

    Writes what the cone allows the others, and by how much it is exceeded where they stick; flags
    (B,) garments where nodes were freed.
    """
    b, i = wp.tid()
    bound[b, i] = _ZERO
    excess[b, i] = _ZERO
    mode = friction.mode[b, i]
    if active[b] == 0 or near.owner[b, i] < 0 or mode == _FREE:
        return
    binding = row_product(system, parameters, motion, b, i) - g[b, i]
    p = wp.dot(binding, near.normal[b, i])
    if p < _ZERO and near.gap[b, i] > _LYING:
        friction.mode[b, i] = _FREE
        friction.velocity_mode[b, i] = _FREE
        changes[b] = 1
        return
    allowed = parameters.friction[b] * wp.max(p, _ZERO)
    bound[b, i] = allowed
    if mode == _STICK:
        excess[b, i] = wp.max(wp.dot(binding, friction.direction[b, i]) - allowed, _ZERO)


@wp.kernel
def let_slip(
    parameters: Parameters,
    active: wp.array[wp.int32],
    excess: wp.array2d[wp.float64],
    bound_sum: wp.array[wp.float64],
    excess_sum: wp.array[wp.float64],
    friction: Friction,
    slips: wp.array[wp.int32],
    changes: wp.array[wp.int32],
):
    """Lets sticking nodes that friction cannot hold slip, in garments where it matters in sum."""
    b, i = wp.tid()
    if active[b] == 0 or excess_sum[b] <= _TOLERATED_EXCESS * bound_sum[b]:
        return
    if excess[b, i] > _ZERO:
        friction.mode[b, i] = _SLIP
        friction.velocity_mode[b, i] = _SLIP
        friction.push[b, i] = parameters.friction[b] * friction.direction[b, i]
        slips[b] = 1
        changes[b] = 1


@wp.kernel
def bound_reaction(
    system: System,
    parameters: Parameters,
    near: Proximity,
    friction: Friction,
    g: wp.array2d[wp.vec3d],
    motion: wp.array2d[wp.vec3d],
    reaction: wp.array2d[wp.vec3d],
    multiplier: wp.array2d[wp.float64],
):
    """Writes the force on touching nodes, N, and ν of those that slip, kg·m."""
    b, i = wp.tid()
    multiplier[b, i] = _ZERO
    mode = friction.mode[b, i]
    if mode != _STICK and mode != _SLIP:
        return
    binding = row_product(system, parameters, motion, b, i) - g[b, i]
    if mode == _SLIP:
        n = near.normal[b, i]
        nu = wp.dot(binding, n)
        multiplier[b, i] = nu
        binding = nu * (n + friction.push[b, i])
    reaction[b, i] = (_TWO / system.square) * binding


@wp.kernel
def start_change(
    near: Proximity,
    friction: Friction,
    target_change: wp.array2d[wp.vec3d],
    change: wp.array2d[wp.vec3d],
):
    """Writes what is prescribed of Δv of touching nodes."""
    b, i = wp.tid()
    mode = friction.velocity_mode[b, i]
    if mode == _STICK:
        change[b, i] = target_change[b, i]
    elif mode == _SLIP:
        n = near.normal[b, i]
        change[b, i] = wp.dot(target_change[b, i], n) * n


@wp.kernel
def slip_multiplier(
    system: System,
    parameters: Parameters,
    near: Proximity,
    mode: wp.array2d[wp.int32],
    rhs: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    multiplier: wp.array2d[wp.float64],
):
    """Writes ν of the slipping nodes, in the unit of `rhs`."""
    b, i = wp.tid()
    multiplier[b, i] = _ZERO
    if mode[b, i] == _SLIP:
        left = row_product(system, parameters, z, b, i) - rhs[b, i]
        multiplier[b, i] = wp.dot(left, near.normal[b, i])


@wp.kernel
def finish_motion(
    system: System,
    parameters: Parameters,
    held_index: wp.array[wp.int32],
    x: wp.array2d[wp.vec3d],
    v: wp.array2d[wp.vec3d],
    g: wp.array2d[wp.vec3d],
    motion: wp.array2d[wp.vec3d],
    h: wp.float64,
    reaction: wp.array2d[wp.vec3d],
    change: wp.array2d[wp.vec3d],
    x_next: wp.array2d[wp.vec3d],
):
    """Writes the new positions, the reaction at held nodes and what is prescribed of their Δv."""
    b, i = wp.tid()
    x_next[b, i] = x[b, i] + motion[b, i]
    if held_index[i] >= 0:
        left = row_product(system, parameters, motion, b, i) - g[b, i]
        reaction[b, i] = (_TWO / system.square) * left
        change[b, i] = motion[b, i] / h - v[b, i]
    else:
        reaction[b, i] = wp.vec3d()
        change[b, i] = wp.vec3d()


@wp.kernel
def add(a: wp.array2d[wp.vec3d], c: wp.array2d[wp.vec3d], out: wp.array2d[wp.vec3d]):
    """Writes a + c."""
    b, i = wp.tid()
    out[b, i] = a[b, i] + c[b, i]
