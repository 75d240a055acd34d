"""Which nodes touch what during a step, and what that prescribes, a thread per garment and node.

The rules are those of `contact.detection`: the way of each node is followed to the first body that
it meets, of which it then knows the plane nearest to where it starts.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.bodies import (
    Bodies,
    distance,
    nearest,
    set_of,
    surface_normal,
    surface_velocity,
)
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.contact.detection import CLOSE, ENTERED, FEW, SHORT_WAY
from drake_dress.models.cloth.contact.distance import MOST_MARCHES, TOUCH
from drake_dress.models.cloth.filtered_cg import FREE, HELD, STICK

wp.set_module_options({"enable_backward": False})

_FREE = wp.constant(FREE)
_STICK = wp.constant(STICK)
_HELD = wp.constant(HELD)
_ZERO = wp.constant(wp.float64(0.0))
_TOUCH = wp.constant(wp.float64(TOUCH))
_MOST_MARCHES = wp.constant(MOST_MARCHES)
_SHORT_WAY = wp.constant(wp.float64(SHORT_WAY))
_CLOSE = wp.constant(wp.float64(CLOSE))
_FEW = wp.constant(FEW)
_ENTERED = wp.constant(wp.float64(ENTERED))


@wp.struct
class Proximity:
    """Nodes against the body that they touch, (B,n); meaningless for nodes that touch nothing.

    Attributes:
        gap: distance less the margin, m. owner: body, -1 where nothing is touched.
        normal: outward unit. velocity: of the surface, m/s.
    """

    gap: wp.array2d[wp.float64]
    owner: wp.array2d[wp.int32]
    normal: wp.array2d[wp.vec3d]
    velocity: wp.array2d[wp.vec3d]


def make_proximity(owner: wp.array) -> Proximity:
    """Returns memory for the nodes, with (B,n) owners."""
    near, device = Proximity(), owner.device
    near.owner = owner
    near.gap = wp.zeros(owner.shape, dtype=wp.float64, device=device)
    near.normal = wp.zeros(owner.shape, dtype=wp.vec3d, device=device)
    near.velocity = wp.zeros(owner.shape, dtype=wp.vec3d, device=device)
    return near


@wp.kernel
def prescribe_held(
    held_index: wp.array[wp.int32],
    held_motion: wp.array2d[wp.vec3d],
    mode: wp.array2d[wp.int32],
    prescribed: wp.array2d[wp.vec3d],
    motion: wp.array2d[wp.vec3d],
):
    """Writes modes, prescribed motions and the start of the first solve of nodes not in contact."""
    b, i = wp.tid()
    k = held_index[i]
    if k >= 0:
        mode[b, i] = _HELD
        prescribed[b, i] = held_motion[b, k]
        motion[b, i] = held_motion[b, k]
    else:
        mode[b, i] = _FREE
        prescribed[b, i] = wp.vec3d()
        motion[b, i] = wp.vec3d()


@wp.func
def _first_touch(
    bodies: Bodies, s: wp.int32, p: wp.vec3d, motion: wp.vec3d, margin: wp.float64
) -> wp.int32:
    """Returns the body into whose margin p comes first on its straight way, -1 if into none.

    A distance changes by no more than its point moves, so a point may go on by its distance at
    once.
    """
    way = wp.length(motion)
    gone = wp.float64(0.0)
    for _march in range(_MOST_MARCHES):
        share = wp.float64(0.0)
        if way > _ZERO:
            share = gone / way
        least, who = nearest(bodies, s, p + share * motion)
        gap = least - margin
        if gap <= _TOUCH:
            return who
        gone += gap
        if gone > way:
            return -1
    return -1


@wp.func
def _met_on_the_way(
    bodies: Bodies,
    s: wp.int32,
    p: wp.vec3d,
    motion: wp.vec3d,
    margin: wp.float64,
    least: wp.float64,
    owner: wp.int32,
) -> wp.int32:
    """Returns the body that p comes to, -1 if to none; `owner` is nearest, at the distance `least`.

    Who ends inside of the body that was nearest has met it. Who ends outside of everything and does
    not pass the plane of that body has met none, if it moved little. Only other ways are followed.
    """
    gap = least - margin
    if gap <= _ZERO:
        return owner
    end, who = nearest(bodies, s, p + motion)
    if end < margin:
        if who == owner:
            return owner
    else:
        ahead = gap + wp.dot(surface_normal(bodies, s, owner, p), motion)
        if ahead >= _ZERO and wp.dot(motion, motion) <= _SHORT_WAY * _SHORT_WAY:
            return -1
    return _first_touch(bodies, s, p, motion, margin)


@wp.kernel
def find_touching(
    bodies: Bodies,
    parameters: Parameters,
    x: wp.array2d[wp.vec3d],
    free_motion: wp.array2d[wp.vec3d],
    h: wp.float64,
    near: Proximity,
    mode: wp.array2d[wp.int32],
    touches: wp.array[wp.int32],
):
    """Sets the mode of nodes that lie in a margin, or would enter one without contact, to stick.

    Writes `near` of them. `touches` (B,) becomes 1 for garments with such nodes: all threads write
    the same.
    """
    b, i = wp.tid()
    near.owner[b, i] = -1
    if mode[b, i] == _HELD:
        return
    s = set_of(bodies, b)
    p = x[b, i]
    way = free_motion[b, i]
    margin = parameters.margin[b]
    least, owner = nearest(bodies, s, p)
    if least - margin >= wp.length(way) + h * bodies.fastest[s]:
        return
    relative = way - h * surface_velocity(bodies, s, owner, p)
    met = _met_on_the_way(bodies, s, p, relative, margin, least, owner)
    if met >= 0 and met != owner:
        owner = met
        least = distance(bodies, s, owner, p)
        relative = way - h * surface_velocity(bodies, s, owner, p)
    gap = least - margin
    n = surface_normal(bodies, s, owner, p)
    ahead = gap + wp.dot(n, relative)
    if gap < _ZERO or (met >= 0 and ahead < _ZERO):
        near.owner[b, i] = owner
        near.gap[b, i] = gap
        near.normal[b, i] = n
        near.velocity[b, i] = surface_velocity(bodies, s, owner, p)
        mode[b, i] = _STICK
        touches[b] = 1


@wp.kernel
def take_touching(
    bodies: Bodies,
    parameters: Parameters,
    x: wp.array2d[wp.vec3d],
    near: Proximity,
    mode: wp.array2d[wp.int32],
    touches: wp.array[wp.int32],
):
    """As `find_touching`, with the nodes that have an owner already."""
    b, i = wp.tid()
    owner = near.owner[b, i]
    if mode[b, i] == _HELD or owner < 0:
        near.owner[b, i] = -1
        return
    s = set_of(bodies, b)
    p = x[b, i]
    near.gap[b, i] = distance(bodies, s, owner, p) - parameters.margin[b]
    near.normal[b, i] = surface_normal(bodies, s, owner, p)
    near.velocity[b, i] = surface_velocity(bodies, s, owner, p)
    mode[b, i] = _STICK
    touches[b] = 1


@wp.kernel
def prescribe_touching(
    near: Proximity,
    h: wp.float64,
    v: wp.array2d[wp.vec3d],
    mode: wp.array2d[wp.int32],
    prescribed: wp.array2d[wp.vec3d],
    motion: wp.array2d[wp.vec3d],
    target_change: wp.array2d[wp.vec3d],
):
    """Lets touching nodes follow their surface; new ones close their gap, deep ones leave by it."""
    b, i = wp.tid()
    if mode[b, i] == _STICK:
        u = _closing(near, b, i, h)
        prescribed[b, i] = u
        motion[b, i] = u
        target_change[b, i] = near.velocity[b, i] - v[b, i]


@wp.kernel
def count_touching(near: Proximity, mode: wp.array2d[wp.int32], count: wp.array2d[wp.int32]):
    """Adds to `count` (B,2) how many touching nodes lie on a surface, and how many do not."""
    b, i = wp.tid()
    if mode[b, i] == _STICK:
        if near.gap[b, i] <= _CLOSE:
            wp.atomic_add(count, b, 0, 1)
        else:
            wp.atomic_add(count, b, 1, 1)


@wp.kernel
def doubt_contact(count: wp.array2d[wp.int32], doubtful: wp.array[wp.int32]):
    """Writes which garments (B,) have contact that is worth a second look."""
    b = wp.tid()
    doubtful[b] = wp.where(count[b, 0] > 0 and count[b, 1] > _FEW, 1, 0)


@wp.kernel
def hold_lying(
    near: Proximity,
    h: wp.float64,
    mode: wp.array2d[wp.int32],
    lying_mode: wp.array2d[wp.int32],
    motion: wp.array2d[wp.vec3d],
):
    """Lets only those touching nodes stick that lie on a surface."""
    b, i = wp.tid()
    lying_mode[b, i] = mode[b, i]
    if mode[b, i] != _STICK:
        return
    if near.gap[b, i] <= _CLOSE:
        motion[b, i] = _closing(near, b, i, h)
    else:
        lying_mode[b, i] = _FREE


@wp.kernel
def let_be(
    doubtful: wp.array[wp.int32],
    h: wp.float64,
    motion: wp.array2d[wp.vec3d],
    near: Proximity,
    mode: wp.array2d[wp.int32],
    spared: wp.array2d[wp.int32],
):
    """Takes those from the touching nodes that stay out once what lies on a surface is held.

    `spared` becomes the body that such a node was thought to touch, -1 for all others.
    """
    b, i = wp.tid()
    spared[b, i] = -1
    if doubtful[b] == 0 or mode[b, i] != _STICK or near.gap[b, i] <= _CLOSE:
        return
    if _ahead(near, b, i, h, motion[b, i]) >= _ZERO:
        spared[b, i] = near.owner[b, i]
        mode[b, i] = _FREE
        near.owner[b, i] = -1


@wp.kernel
def find_entered(
    near: Proximity,
    h: wp.float64,
    motion: wp.array2d[wp.vec3d],
    spared: wp.array2d[wp.int32],
    entered: wp.array[wp.int32],
):
    """Flags garments (B,) with nodes that were let be and enter: all threads write the same."""
    b, i = wp.tid()
    if spared[b, i] >= 0 and _ahead(near, b, i, h, motion[b, i]) < -_ENTERED:
        entered[b] = 1


@wp.kernel
def take_back(
    near: Proximity,
    h: wp.float64,
    motion: wp.array2d[wp.vec3d],
    entered: wp.array[wp.int32],
    everyone: wp.int32,
    spared: wp.array2d[wp.int32],
    mode: wp.array2d[wp.int32],
):
    """Lets nodes that enter touch again, or all that were let be, of garments with any."""
    b, i = wp.tid()
    if entered[b] == 0 or spared[b, i] < 0:
        return
    if everyone == 1 or _ahead(near, b, i, h, motion[b, i]) < -_ENTERED:
        near.owner[b, i] = spared[b, i]
        mode[b, i] = _STICK
        spared[b, i] = -1


@wp.func
def _closing(near: Proximity, b: wp.int32, i: wp.int32, h: wp.float64) -> wp.vec3d:
    """Returns the motion of sticking, which ends on the surface."""
    return h * near.velocity[b, i] - near.gap[b, i] * near.normal[b, i]


@wp.func
def _ahead(
    near: Proximity, b: wp.int32, i: wp.int32, h: wp.float64, motion: wp.vec3d
) -> wp.float64:
    """Returns the gap that is left after a motion."""
    return near.gap[b, i] + wp.dot(near.normal[b, i], motion - h * near.velocity[b, i])
