"""What garments touch, on a device: capsules and half-spaces, one set for all or one for each."""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from drake_dress.models.cloth.contact.detection import fastest
from drake_dress.models.cloth.contact.obstacles import Obstacles

wp.set_module_options({"enable_backward": False})

_ZERO = wp.constant(wp.float64(0.0))
_ONE = wp.constant(wp.float64(1.0))
_FAR = wp.constant(wp.float64(1e9))
_SMALLEST_RADIUS = wp.constant(wp.float64(1e-12))


@wp.struct
class Bodies:
    """Sets of bodies, (s,m) with s one or B; capsules first, then half-spaces.

    Attributes:
        origin: end a of a capsule, point of a half-space, m.
        end: end b of a capsule, m; outward unit normal of a half-space.
        radius: of a capsule, m.
        velocity: of the origin, m/s; angular_velocity: rad/s.
        fastest: (s,) bound on the speed of surfaces near the garment, m/s.
        sets: s; count: m; capsules: how many of them.
    """

    origin: wp.array2d[wp.vec3d]
    end: wp.array2d[wp.vec3d]
    radius: wp.array2d[wp.float64]
    velocity: wp.array2d[wp.vec3d]
    angular_velocity: wp.array2d[wp.vec3d]
    fastest: wp.array[wp.float64]
    sets: wp.int32
    count: wp.int32
    capsules: wp.int32


def make_bodies(
    obstacles: Obstacles | Sequence[Obstacles], batch: int, device: wp.Device
) -> Bodies:
    """Returns obstacles on a device.

    Args:
        obstacles: one for all garments, or one for each, with the same number of capsules and of
            half-spaces each; closed meshes are not supported.
        batch: B.
        device: where they go.

    Raises:
        ValueError: a closed mesh, differing counts, or neither one nor B sets.
    """
    sets = [obstacles] if isinstance(obstacles, Obstacles) else list(obstacles)
    if len(sets) not in (1, batch):
        raise ValueError(f"obstacles are {len(sets)} sets, expected 1 or {batch}")
    if any(o.solids for o in sets):
        raise ValueError("obstacles hold closed meshes, expected capsules and half-spaces only")
    counts = {(len(o.radius), len(o.half_spaces.point)) for o in sets}
    if len(counts) != 1:
        raise ValueError(f"obstacles have {sorted(counts)} capsules and half-spaces, expected one")
    capsules, planes = counts.pop()

    def on_device(rows, dtype):
        host = np.ascontiguousarray(np.stack(rows), dtype=np.float64)
        shape = (len(sets), capsules + planes)
        return wp.array(host, dtype=dtype, shape=shape, device=device)

    bodies = Bodies()
    bodies.origin = on_device([o.origins() for o in sets], wp.vec3d)
    ends = [np.concatenate([o.b, o.half_spaces.normal]) for o in sets]
    bodies.end = on_device(ends, wp.vec3d)
    radii = [np.concatenate([o.radius, np.zeros(planes)]) for o in sets]
    bodies.radius = on_device(radii, wp.float64)
    bodies.velocity = on_device([o.twists()[0] for o in sets], wp.vec3d)
    bodies.angular_velocity = on_device([o.twists()[1] for o in sets], wp.vec3d)
    bodies.fastest = wp.array([fastest(o) for o in sets], dtype=wp.float64, device=device)
    bodies.sets, bodies.count, bodies.capsules = len(sets), capsules + planes, capsules
    return bodies


@wp.func
def set_of(bodies: Bodies, b: wp.int32) -> wp.int32:
    """Returns which set garment b touches."""
    return wp.min(b, bodies.sets - 1)


@wp.func
def axis_parameter(bodies: Bodies, s: wp.int32, k: wp.int32, p: wp.vec3d) -> wp.float64:
    """Returns where on its axis capsule k is nearest to p, in [0, 1]."""
    d = bodies.end[s, k] - bodies.origin[s, k]
    square = wp.dot(d, d)
    if square <= _ZERO:
        return _ZERO
    return wp.min(_ONE, wp.max(_ZERO, wp.dot(p - bodies.origin[s, k], d) / square))


@wp.func
def distance(bodies: Bodies, s: wp.int32, k: wp.int32, p: wp.vec3d) -> wp.float64:
    """Returns the signed distance of p to body k, m."""
    q = p - bodies.origin[s, k]
    if k >= bodies.capsules:
        return wp.dot(q, bodies.end[s, k])
    t = axis_parameter(bodies, s, k, p)
    return wp.length(q - t * (bodies.end[s, k] - bodies.origin[s, k])) - bodies.radius[s, k]


@wp.func
def nearest(bodies: Bodies, s: wp.int32, p: wp.vec3d):
    """Returns the least signed distance, m, and whose it is: -1 without any body."""
    best = _FAR
    owner = wp.int32(-1)
    for k in range(bodies.count):
        d = distance(bodies, s, k, p)
        if d < best:
            best = d
            owner = k
    return best, owner


@wp.func
def surface_normal(bodies: Bodies, s: wp.int32, k: wp.int32, p: wp.vec3d) -> wp.vec3d:
    """Returns the outward unit normal at p."""
    if k >= bodies.capsules:
        return bodies.end[s, k]
    t = axis_parameter(bodies, s, k, p)
    r = p - bodies.origin[s, k] - t * (bodies.end[s, k] - bodies.origin[s, k])
    size = wp.length(r)
    if size > _SMALLEST_RADIUS:
        return r / size
    return wp.vec3d(_ZERO, _ZERO, _ONE)


@wp.func
def surface_velocity(bodies: Bodies, s: wp.int32, k: wp.int32, p: wp.vec3d) -> wp.vec3d:
    """Returns the velocity of body k at p, m/s."""
    return bodies.velocity[s, k] + wp.cross(bodies.angular_velocity[s, k], p - bodies.origin[s, k])
