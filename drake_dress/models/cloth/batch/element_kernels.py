"""Forces and stiffness of triangles and hinges, one thread per garment and element.

The formulas are those of `drake_dress.models.cloth.forces`: stretch ½ k area ‖F − R‖² and bending
½ B weight (‖s‖ − rest)², s = Σ c x. Element vectors are indexed as in `mesh`.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.mesh import Mesh
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.forces import LEAST_CURVATURE, SMALLEST_STRETCH

wp.set_module_options({"enable_backward": False})

_ZERO = wp.constant(wp.float64(0.0))
_ONE = wp.constant(wp.float64(1.0))
_TWO = wp.constant(wp.float64(2.0))
# det C of a triangle crushed to a line, and how far a hinge's vector may shrink.
_SMALLEST_DETERMINANT = wp.constant(wp.float64(SMALLEST_STRETCH * SMALLEST_STRETCH))
_SMALLEST_SHARE = wp.constant(wp.float64(LEAST_CURVATURE))


@wp.func
def columns(mesh: Mesh, z: wp.array2d[wp.vec3d], b: wp.int32, e: wp.int32):
    """Returns the two columns of Σ z ⊗ g of a triangle."""
    t = mesh.triangle[e]
    u = z[b, t[1]] - z[b, t[0]]
    w = z[b, t[2]] - z[b, t[0]]
    g = mesh.gradient_b[e]
    k = mesh.gradient_c[e]
    return g[0] * u + k[0] * w, g[1] * u + k[1] * w


@wp.func
def hinge_vector(mesh: Mesh, z: wp.array2d[wp.vec3d], b: wp.int32, e: wp.int32) -> wp.vec3d:
    """Returns Σ c z of a hinge."""
    q = mesh.hinge[e]
    c = mesh.coefficient[e]
    return c[0] * z[b, q[0]] + c[1] * z[b, q[1]] + c[2] * z[b, q[2]] + c[3] * z[b, q[3]]


@wp.func
def _polar(f0: wp.vec3d, f1: wp.vec3d):
    """Returns the columns of R, S⁻¹ (three numbers), tr S and the unit normal of F."""
    c00 = wp.dot(f0, f0)
    c01 = wp.dot(f0, f1)
    c11 = wp.dot(f1, f1)
    s = wp.sqrt(wp.max(c00 * c11 - c01 * c01, _SMALLEST_DETERMINANT))
    t = wp.sqrt(c00 + c11 + _TWO * s)
    s00 = (c00 + s) / t
    s01 = c01 / t
    s11 = (c11 + s) / t
    d = s00 * s11 - s01 * s01
    i00 = s11 / d
    i01 = -s01 / d
    i11 = s00 / d
    r0 = i00 * f0 + i01 * f1
    r1 = i01 * f0 + i11 * f1
    n = wp.cross(r0, r1)
    norm = wp.length(n)
    if norm > _ZERO:
        n = n / norm
    return r0, r1, i00, i01, i11, s00 + s11, n


@wp.func
def _rate(
    r0: wp.vec3d,
    r1: wp.vec3d,
    i00: wp.float64,
    i01: wp.float64,
    i11: wp.float64,
    trace: wp.float64,
    n: wp.vec3d,
    d0: wp.vec3d,
    d1: wp.vec3d,
):
    """Returns the derivative of F − R along D, two columns, by what `_polar` gives of F."""
    spin = (wp.dot(r1, d0) - wp.dot(r0, d1)) / trace
    m0 = wp.dot(n, d0)
    m1 = wp.dot(n, d1)
    k0 = d0 - spin * r1 - (m0 * i00 + m1 * i01) * n
    k1 = d1 + spin * r0 - (m0 * i01 + m1 * i11) * n
    return k0, k1


@wp.func
def unit_stretch(f0: wp.vec3d, f1: wp.vec3d, d0: wp.vec3d, d1: wp.vec3d):
    """Returns F − R and its derivative along D, two columns each."""
    r0, r1, i00, i01, i11, trace, n = _polar(f0, f1)
    k0, k1 = _rate(r0, r1, i00, i01, i11, trace, n, d0, d1)
    return f0 - r0, f1 - r1, k0, k1


@wp.func
def unit_bending(s: wp.vec3d, t: wp.vec3d, rest: wp.float64):
    """Returns (1 − rest / ‖s‖) s and its derivative along t; ‖s‖ as if at least 0.1 rest."""
    if rest <= _ZERO:
        return s, t
    length = wp.length(s)
    floor = _SMALLEST_SHARE * rest
    share = _ONE - rest / wp.max(length, floor)
    rate = share * t
    if length > floor:
        rate += (rest / (length * length * length) * wp.dot(s, t)) * s
    return share * s, rate


@wp.kernel
def triangle_response(
    mesh: Mesh,
    parameters: Parameters,
    x: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    stress: wp.array2d[wp.vec3d],
    rate: wp.array2d[wp.vec3d],
):
    """Writes the element vectors (B,M) of the internal force at `x` and of K(x) z."""
    b, e = wp.tid()
    f0, f1 = columns(mesh, x, b, e)
    d0, d1 = columns(mesh, z, b, e)
    s0, s1, k0, k1 = unit_stretch(f0, f1, d0, d1)
    w = parameters.stretch[b] * mesh.area[e]
    stress[b, 2 * e] = w * s0
    stress[b, 2 * e + 1] = w * s1
    rate[b, 2 * e] = w * k0
    rate[b, 2 * e + 1] = w * k1


@wp.kernel
def hinge_response(
    mesh: Mesh,
    parameters: Parameters,
    x: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    stress: wp.array2d[wp.vec3d],
    rate: wp.array2d[wp.vec3d],
):
    """Writes the hinges' part of what `triangle_response` writes."""
    b, e = wp.tid()
    s, t = unit_bending(hinge_vector(mesh, x, b, e), hinge_vector(mesh, z, b, e), mesh.rest[e])
    w = parameters.bending[b] * mesh.weight[e]
    at = 2 * mesh.triangle_count + e
    stress[b, at] = w * s
    rate[b, at] = w * t


@wp.kernel
def triangle_stiffness(
    mesh: Mesh,
    parameters: Parameters,
    x: wp.array2d[wp.vec3d],
    v: wp.array2d[wp.vec3d],
    step: wp.array[wp.float64],
    pull_in: wp.array2d[wp.vec3d],
    force_in: wp.array2d[wp.vec3d],
    scale: wp.float64,
    to_v: wp.array2d[wp.vec3d],
    to_x: wp.array2d[wp.vec3d],
):
    """Writes the element vectors (B,M) of what the adjoint takes from v and from x.

    To v: scale · K(x) pull_in. To x: K(x) force_in + scale · ∂(K(x) pull_in)/∂x along v, by a
    central difference over ± step (B,), s; without it where the step is zero.
    """
    b, e = wp.tid()
    f0, f1 = columns(mesh, x, b, e)
    d0, d1 = columns(mesh, pull_in, b, e)
    g0, g1 = columns(mesh, force_in, b, e)
    w = parameters.stretch[b] * mesh.area[e]
    r0, r1, i00, i01, i11, trace, n = _polar(f0, f1)
    k0, k1 = _rate(r0, r1, i00, i01, i11, trace, n, d0, d1)
    q0, q1 = _rate(r0, r1, i00, i01, i11, trace, n, g0, g1)
    h = step[b]
    if h > _ZERO:
        v0, v1 = columns(mesh, v, b, e)
        s0, s1, p0, p1 = unit_stretch(f0 + h * v0, f1 + h * v1, d0, d1)
        s0, s1, m0, m1 = unit_stretch(f0 - h * v0, f1 - h * v1, d0, d1)
        share = scale / (_TWO * h)
        q0 += share * (p0 - m0)
        q1 += share * (p1 - m1)
    to_v[b, 2 * e] = (w * scale) * k0
    to_v[b, 2 * e + 1] = (w * scale) * k1
    to_x[b, 2 * e] = w * q0
    to_x[b, 2 * e + 1] = w * q1


@wp.kernel
def hinge_stiffness(
    mesh: Mesh,
    parameters: Parameters,
    x: wp.array2d[wp.vec3d],
    v: wp.array2d[wp.vec3d],
    step: wp.array[wp.float64],
    pull_in: wp.array2d[wp.vec3d],
    force_in: wp.array2d[wp.vec3d],
    scale: wp.float64,
    to_v: wp.array2d[wp.vec3d],
    to_x: wp.array2d[wp.vec3d],
):
    """Writes the hinges' part of what `triangle_stiffness` writes."""
    b, e = wp.tid()
    rest = mesh.rest[e]
    s = hinge_vector(mesh, x, b, e)
    t = hinge_vector(mesh, pull_in, b, e)
    w = parameters.bending[b] * mesh.weight[e]
    at = 2 * mesh.triangle_count + e
    unused, k = unit_bending(s, t, rest)
    unused, q = unit_bending(s, hinge_vector(mesh, force_in, b, e), rest)
    h = step[b]
    if h > _ZERO:
        y = hinge_vector(mesh, v, b, e)
        unused, p = unit_bending(s + h * y, t, rest)
        unused, m = unit_bending(s - h * y, t, rest)
        q += (scale / (_TWO * h)) * (p - m)
    to_v[b, at] = (w * scale) * k
    to_x[b, at] = w * q


@wp.func
def gathered(mesh: Mesh, y: wp.array2d[wp.vec3d], b: wp.int32, i: wp.int32) -> wp.vec3d:
    """Returns row i of Aᵀ y."""
    total = wp.vec3d()
    for q in range(mesh.start[i], mesh.start[i + 1]):
        total += mesh.entry[q] * y[b, mesh.column[q]]
    return total


@wp.kernel
def right_hand_sides(
    mesh: Mesh,
    parameters: Parameters,
    v: wp.array2d[wp.vec3d],
    stress: wp.array2d[wp.vec3d],
    rate: wp.array2d[wp.vec3d],
    gravity: wp.vec3d,
    h: wp.float64,
    g: wp.array2d[wp.vec3d],
    pull: wp.array2d[wp.vec3d],
):
    """Writes g = h M v + ½h² f and h f + ½h² df/dt (B,n), gravity in f."""
    b, i = wp.tid()
    mass = parameters.density[b] * mesh.node_area[i]
    force = mass * gravity - gathered(mesh, stress, b, i)
    half = h * h / _TWO
    g[b, i] = (mass * h) * v[b, i] + half * force
    pull[b, i] = h * force - half * gathered(mesh, rate, b, i)


@wp.kernel
def subtract_gathered(
    mesh: Mesh,
    to_v: wp.array2d[wp.vec3d],
    to_x: wp.array2d[wp.vec3d],
    v_in: wp.array2d[wp.vec3d],
    x_in: wp.array2d[wp.vec3d],
):
    """Subtracts Aᵀ to_v from `v_in` and Aᵀ to_x from `x_in` (B,n)."""
    b, i = wp.tid()
    v_in[b, i] = v_in[b, i] - gathered(mesh, to_v, b, i)
    x_in[b, i] = x_in[b, i] - gathered(mesh, to_x, b, i)
