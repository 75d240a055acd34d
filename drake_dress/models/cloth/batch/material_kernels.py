"""The derivative of a step by its fabric, summed over elements and nodes.

Forces, stiffness and P are linear in stiffness and density, so each element gives what it would
with a unit value. P enters L as wᵀ P z three times: by the change of velocity, the motion and the
sticking motion.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.arrays import DeviceArray
from drake_dress.models.cloth.batch.element_kernels import (
    columns,
    hinge_vector,
    unit_bending,
    unit_stretch,
)
from drake_dress.models.cloth.batch.mesh import Mesh

wp.set_module_options({"enable_backward": False})

_TWO = wp.constant(wp.float64(2.0))
_THREE = wp.constant(wp.float64(3.0))


@wp.struct
class Adjoints:
    """What the shares are made of, all (B,n): state, adjoints of a step, and the pairs (w, z)."""

    x: wp.array2d[wp.vec3d]
    v: wp.array2d[wp.vec3d]
    force_in: wp.array2d[wp.vec3d]
    pull_in: wp.array2d[wp.vec3d]
    g_in: wp.array2d[wp.vec3d]
    change: wp.array2d[wp.vec3d]
    motion_weight: wp.array2d[wp.vec3d]
    motion: wp.array2d[wp.vec3d]
    stick_weight: wp.array2d[wp.vec3d]
    stick_motion: wp.array2d[wp.vec3d]


def make_adjoints(**arrays: DeviceArray) -> Adjoints:
    """Returns adjoints of the arrays that are named."""
    adjoints = Adjoints()
    for name, array in arrays.items():
        setattr(adjoints, name, array)
    return adjoints


@wp.func
def _stretch_pair(
    mesh: Mesh, w: wp.array2d[wp.vec3d], z: wp.array2d[wp.vec3d], b: wp.int32, e: wp.int32
) -> wp.float64:
    w0, w1 = columns(mesh, w, b, e)
    z0, z1 = columns(mesh, z, b, e)
    return wp.dot(w0, z0) + wp.dot(w1, z1)


@wp.kernel
def stretch_shares(mesh: Mesh, a: Adjoints, h: wp.float64, share: wp.array2d[wp.float64]):
    """Writes each triangle's share (B,F) of ∂L/∂(stretch stiffness)."""
    b, e = wp.tid()
    f0, f1 = columns(mesh, a.x, b, e)
    d0, d1 = columns(mesh, a.v, b, e)
    s0, s1, k0, k1 = unit_stretch(f0, f1, d0, d1)
    p0, p1 = columns(mesh, a.force_in, b, e)
    q0, q1 = columns(mesh, a.pull_in, b, e)
    total = -(wp.dot(s0, p0) + wp.dot(s1, p1))
    total -= h * h / _TWO * (wp.dot(k0, q0) + wp.dot(k1, q1))
    pairs = _stretch_pair(mesh, a.motion_weight, a.motion, b, e)
    pairs += _stretch_pair(mesh, a.stick_weight, a.stick_motion, b, e)
    pairs -= _stretch_pair(mesh, a.pull_in, a.change, b, e)
    share[b, e] = mesh.area[e] * (total + h * h * pairs)


@wp.func
def _bending_pair(
    mesh: Mesh, w: wp.array2d[wp.vec3d], z: wp.array2d[wp.vec3d], b: wp.int32, e: wp.int32
) -> wp.float64:
    """Returns a hinge's part of wᵀ C₁ z, without its weight: see `bending_bound`."""
    q = mesh.hinge[e]
    c = mesh.coefficient[e]
    total = c[1] * c[1] * wp.dot(w[b, q[1]] - w[b, q[0]], z[b, q[1]] - z[b, q[0]])
    total += c[2] * c[2] * wp.dot(w[b, q[2]] - w[b, q[0]], z[b, q[2]] - z[b, q[0]])
    total += c[3] * c[3] * wp.dot(w[b, q[3]] - w[b, q[0]], z[b, q[3]] - z[b, q[0]])
    return _THREE * total


@wp.kernel
def bending_shares(mesh: Mesh, a: Adjoints, h: wp.float64, share: wp.array2d[wp.float64]):
    """Writes each hinge's share (B,H) of ∂L/∂(bending stiffness)."""
    b, e = wp.tid()
    s, t = unit_bending(hinge_vector(mesh, a.x, b, e), hinge_vector(mesh, a.v, b, e), mesh.rest[e])
    total = -wp.dot(s, hinge_vector(mesh, a.force_in, b, e))
    total -= h * h / _TWO * wp.dot(t, hinge_vector(mesh, a.pull_in, b, e))
    pairs = _bending_pair(mesh, a.motion_weight, a.motion, b, e)
    pairs += _bending_pair(mesh, a.stick_weight, a.stick_motion, b, e)
    pairs -= _bending_pair(mesh, a.pull_in, a.change, b, e)
    share[b, e] = mesh.weight[e] * (total + h * h * pairs)


@wp.kernel
def density_shares(
    mesh: Mesh,
    a: Adjoints,
    gravity: wp.vec3d,
    h: wp.float64,
    share: wp.array2d[wp.float64],
):
    """Writes each node's share (B,n) of ∂L/∂(surface density)."""
    b, i = wp.tid()
    total = wp.dot(a.force_in[b, i], gravity) + h * wp.dot(a.g_in[b, i], a.v[b, i])
    total += wp.dot(a.motion_weight[b, i], a.motion[b, i])
    total += wp.dot(a.stick_weight[b, i], a.stick_motion[b, i])
    total -= wp.dot(a.pull_in[b, i], a.change[b, i])
    share[b, i] = mesh.node_area[i] * total
