"""Solves with friction: slipping nodes are bound along n + μ d, which makes them unsymmetric.

A node that slips keeps n·z of the start and takes any force ν (n + μ d), so P z − b of it has to
lie along n + μ d. With Q r = r − (n·r)(n + μ d), which leaves only what lies across n, this is
Q (b − P z) = 0 for z that move across n. Backward, for the adjoint, force and row change places:
ν n is the force and (n + μ d)·z is kept, so motions are Qᵀ y, y across n.

Both are solved by Orthomin (Vinsome 1976): each new direction p = M⁻¹ r is made orthogonal, in A p,
to the last few, and the residual is reduced as far as it goes along it. Preconditioner M⁻¹ and
norm are those of conjugate gradients (`projected_cg`); there the directions would be orthogonal
to all by themselves. A garment that has converged is frozen.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.arrays import DeviceArray
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.batch.projected_cg import ITERATIONS_PER_LOOK, ProjectedSolver
from drake_dress.models.cloth.batch.reduction import CHUNK, chunk_count, total
from drake_dress.models.cloth.batch.system import System, row_product
from drake_dress.models.cloth.filtered_cg import FREE, SLIP

wp.set_module_options({"enable_backward": False})

# Directions that are kept, the new one included. A sheet thrown on limbs (h = 0.1 s, friction 1)
# took at most 24 iterations to 1e-4 with 8, 43 with 4 and 113 with 2; a jacket 12, 13 and 14.
_KEPT = 8

_FREE = wp.constant(FREE)
_SLIP = wp.constant(SLIP)
_CHUNK = wp.constant(CHUNK)
_ZERO = wp.constant(wp.float64(0.0))
_TINY = wp.constant(wp.float64(1e-300))


@wp.struct
class Bonds:
    """How nodes are bound, (B,n).

    Attributes:
        mode: contact types. normal: unit, of slipping nodes.
        push: friction of slipping nodes per normal force, μ d, across the normal.
        backward: whether the transposed problem is solved.
    """

    mode: wp.array2d[wp.int32]
    normal: wp.array2d[wp.vec3d]
    push: wp.array2d[wp.vec3d]
    backward: wp.int32


def make_bonds(
    mode: DeviceArray, normal: DeviceArray, push: DeviceArray, backward: bool = False
) -> Bonds:
    """Returns bonds that share the arrays."""
    bonds = Bonds()
    bonds.mode, bonds.normal, bonds.push, bonds.backward = mode, normal, push, int(backward)
    return bonds


@wp.func
def _of_force(bonds: Bonds, r: wp.vec3d, b: wp.int32, i: wp.int32) -> wp.vec3d:
    """Returns what of a force no bond takes: Q r, Π r backward."""
    how = bonds.mode[b, i]
    if how == _FREE:
        return r
    if how == _SLIP:
        n = bonds.normal[b, i]
        along = n
        if bonds.backward == 0:
            along = n + bonds.push[b, i]
        return r - wp.dot(r, n) * along
    return wp.vec3d()


@wp.func
def _across(bonds: Bonds, y: wp.vec3d, b: wp.int32, i: wp.int32) -> wp.vec3d:
    """Returns Π y."""
    how = bonds.mode[b, i]
    if how == _FREE:
        return y
    if how == _SLIP:
        n = bonds.normal[b, i]
        return y - wp.dot(y, n) * n
    return wp.vec3d()


@wp.func
def _as_motion(bonds: Bonds, y: wp.vec3d, b: wp.int32, i: wp.int32) -> wp.vec3d:
    """Returns the motion of a y = Π y: itself, Qᵀ y backward."""
    if bonds.backward == 0 or bonds.mode[b, i] != _SLIP:
        return y
    return y - wp.dot(y, bonds.push[b, i]) * bonds.normal[b, i]


class ObliqueSolver:
    """Solves for the motions of garments with bonds; holds its work arrays: it is not reentrant.

    Args:
        system: P of the mesh.
        plain: whose preconditioner, tolerance, limit of iterations and floor are taken.
    """

    def __init__(self, system: System, plain: ProjectedSolver) -> None:
        batch, n = plain.inverse.source.shape
        device = plain.inverse.source.device
        self._system = system
        self._plain = plain
        self._device = device
        self._per_look = ITERATIONS_PER_LOOK["cuda" if device.is_cuda else "cpu"]
        self._residual, self._conditioned = (
            wp.zeros((batch, n), dtype=wp.vec3d, device=device) for _ in range(2)
        )
        # p, A p and M⁻¹ A p of the directions that are kept
        self._direction, self._force, self._image = (
            wp.zeros((_KEPT, batch, n), dtype=wp.vec3d, device=device) for _ in range(3)
        )
        chunks = chunk_count(n)
        self._overlap_partial = wp.zeros((_KEPT, batch, chunks), dtype=wp.float64, device=device)
        self._overlap, self._square = (
            wp.zeros((_KEPT, batch), dtype=wp.float64, device=device) for _ in range(2)
        )
        self._partial, self._other_partial = (
            wp.zeros((batch, chunks), dtype=wp.float64, device=device) for _ in range(2)
        )
        self._step = wp.zeros(batch, dtype=wp.float64, device=device)
        self.iterations = wp.zeros(batch, dtype=wp.int32, device=device)

    def solve(
        self,
        parameters: Parameters,
        flags: DeviceArray,
        bonds: Bonds,
        rhs: DeviceArray,
        z: DeviceArray,
        cold: bool = True,
    ) -> None:
        """Improves `z` (B,n) in place; what is bound of it is kept.

        Args:
            parameters: the fabrics.
            flags: (B,) 1 for garments to solve.
            bonds: of the nodes.
            rhs: (B,n).
            z: (B,n) the start.
            cold: see `ProjectedSolver.solve`, with which it shares the floor.
        """
        batch, n = z.shape
        plain, launch = self._plain, self._launch
        inverse, running = plain.inverse, plain.inverse.running
        wp.copy(running, flags)
        launch(
            _start,
            (batch, n),
            [self._system, parameters, bonds, running, rhs, z, self._residual, inverse.source],
        )
        inverse.apply()
        launch(
            _condition,
            self._partial.shape,
            [bonds, running, self._residual, inverse.image, self._conditioned, self._partial],
        )
        launch(
            _begin,
            batch,
            [self._partial, plain.tolerance, int(cold), plain.floor, running, self.iterations],
        )
        done = 0
        while done < plain.max_iterations and inverse.any_running():
            for _ in range(self._per_look):
                self._iterate(parameters, bonds, z, done)
                done += 1

    def _iterate(self, parameters: Parameters, bonds: Bonds, z: wp.array, done: int) -> None:
        batch, n = z.shape
        plain, launch = self._plain, self._launch
        inverse, running = plain.inverse, plain.inverse.running
        slot, kept = done % _KEPT, min(done, _KEPT)
        p, q, w = self._direction[slot], self._force[slot], self._image[slot]
        launch(_candidate, (batch, n), [bonds, running, self._conditioned, p])
        launch(
            _product,
            (batch, n),
            [self._system, parameters, bonds, running, p, q, inverse.source],
        )
        inverse.apply()
        launch(
            _overlaps,
            (kept, *self._partial.shape),
            [running, slot, q, self._image, self._overlap_partial],
        )
        launch(
            _sum_overlaps,
            (kept, batch),
            [running, slot, self._overlap_partial, self._square, self._overlap],
        )
        launch(
            _orthogonalize,
            self._partial.shape,
            [bonds, running, slot, kept, self._overlap, inverse.image, self._conditioned]
            + [self._direction, self._force, self._image, self._partial, self._other_partial],
        )
        launch(
            _step_length,
            batch,
            [running, slot, self._partial, self._other_partial, self._square, self._step],
        )
        launch(
            _advance,
            self._partial.shape,
            [running, self._step, p, q, w, z, self._residual, self._conditioned, self._partial],
        )
        launch(
            _judge,
            batch,
            [self._partial, plain.tolerance, plain.floor, running, self.iterations],
        )

    def _launch(self, kernel, dim, inputs: list) -> None:
        wp.launch(kernel, dim=dim, inputs=inputs, device=self._device)


@wp.kernel
def _start(
    system: System,
    parameters: Parameters,
    bonds: Bonds,
    running: wp.array[wp.int32],
    rhs: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    residual: wp.array2d[wp.vec3d],
    source: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if running[b] == 0:
        return
    r = _of_force(bonds, rhs[b, i] - row_product(system, parameters, z, b, i), b, i)
    residual[b, i] = r
    source[b, i] = r


@wp.kernel
def _condition(
    bonds: Bonds,
    running: wp.array[wp.int32],
    residual: wp.array2d[wp.vec3d],
    image: wp.array2d[wp.vec3d],
    conditioned: wp.array2d[wp.vec3d],
    partial: wp.array2d[wp.float64],
):
    b, c = wp.tid()
    if running[b] == 0:
        return
    s = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, residual.shape[1])):
        y = _across(bonds, image[b, i], b, i)
        conditioned[b, i] = y
        s += wp.dot(residual[b, i], y)
    partial[b, c] = s


@wp.kernel
def _begin(
    partial: wp.array2d[wp.float64],
    tolerance: wp.float64,
    cold: wp.int32,
    floor: wp.array[wp.float64],
    running: wp.array[wp.int32],
    iterations: wp.array[wp.int32],
):
    b = wp.tid()
    iterations[b] = 0
    if running[b] == 0:
        return
    square = total(partial, b)
    if cold != 0:
        floor[b] = wp.max(square, _TINY)
    if square <= tolerance * tolerance * floor[b]:
        running[b] = 0


@wp.kernel
def _candidate(
    bonds: Bonds,
    running: wp.array[wp.int32],
    conditioned: wp.array2d[wp.vec3d],
    p: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if running[b] == 0:
        return
    p[b, i] = _as_motion(bonds, conditioned[b, i], b, i)


@wp.kernel
def _product(
    system: System,
    parameters: Parameters,
    bonds: Bonds,
    running: wp.array[wp.int32],
    p: wp.array2d[wp.vec3d],
    q: wp.array2d[wp.vec3d],
    source: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if running[b] == 0:
        return
    force = _of_force(bonds, row_product(system, parameters, p, b, i), b, i)
    q[b, i] = force
    source[b, i] = force


@wp.kernel
def _overlaps(
    running: wp.array[wp.int32],
    slot: wp.int32,
    q: wp.array2d[wp.vec3d],
    image: wp.array3d[wp.vec3d],
    partial: wp.array3d[wp.float64],
):
    j, b, c = wp.tid()
    if running[b] == 0 or j == slot:
        return
    s = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, q.shape[1])):
        s += wp.dot(q[b, i], image[j, b, i])
    partial[j, b, c] = s


@wp.kernel
def _sum_overlaps(
    running: wp.array[wp.int32],
    slot: wp.int32,
    partial: wp.array3d[wp.float64],
    square: wp.array2d[wp.float64],
    overlap: wp.array2d[wp.float64],
):
    j, b = wp.tid()
    if running[b] == 0 or j == slot:
        return
    s = _ZERO
    for c in range(partial.shape[2]):
        s += partial[j, b, c]
    overlap[j, b] = s / square[j, b]


@wp.kernel
def _orthogonalize(
    bonds: Bonds,
    running: wp.array[wp.int32],
    slot: wp.int32,
    kept: wp.int32,
    overlap: wp.array2d[wp.float64],
    new_image: wp.array2d[wp.vec3d],
    conditioned: wp.array2d[wp.vec3d],
    direction: wp.array3d[wp.vec3d],
    force: wp.array3d[wp.vec3d],
    image: wp.array3d[wp.vec3d],
    square_partial: wp.array2d[wp.float64],
    along_partial: wp.array2d[wp.float64],
):
    b, c = wp.tid()
    if running[b] == 0:
        return
    square = _ZERO
    along = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, conditioned.shape[1])):
        p = direction[slot, b, i]
        q = force[slot, b, i]
        w = _across(bonds, new_image[b, i], b, i)
        for j in range(kept):
            if j != slot:
                share = overlap[j, b]
                p -= share * direction[j, b, i]
                q -= share * force[j, b, i]
                w -= share * image[j, b, i]
        direction[slot, b, i] = p
        force[slot, b, i] = q
        image[slot, b, i] = w
        square += wp.dot(q, w)
        along += wp.dot(q, conditioned[b, i])
    square_partial[b, c] = square
    along_partial[b, c] = along


@wp.kernel
def _step_length(
    running: wp.array[wp.int32],
    slot: wp.int32,
    square_partial: wp.array2d[wp.float64],
    along_partial: wp.array2d[wp.float64],
    square: wp.array2d[wp.float64],
    step: wp.array[wp.float64],
):
    b = wp.tid()
    if running[b] == 0:
        return
    s = total(square_partial, b)
    square[slot, b] = s
    if s > _ZERO:
        step[b] = total(along_partial, b) / s
    else:
        running[b] = 0


@wp.kernel
def _advance(
    running: wp.array[wp.int32],
    step: wp.array[wp.float64],
    p: wp.array2d[wp.vec3d],
    q: wp.array2d[wp.vec3d],
    w: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    residual: wp.array2d[wp.vec3d],
    conditioned: wp.array2d[wp.vec3d],
    partial: wp.array2d[wp.float64],
):
    b, c = wp.tid()
    if running[b] == 0:
        return
    s = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, z.shape[1])):
        z[b, i] = z[b, i] + step[b] * p[b, i]
        r = residual[b, i] - step[b] * q[b, i]
        y = conditioned[b, i] - step[b] * w[b, i]
        residual[b, i] = r
        conditioned[b, i] = y
        s += wp.dot(r, y)
    partial[b, c] = s


@wp.kernel
def _judge(
    partial: wp.array2d[wp.float64],
    tolerance: wp.float64,
    floor: wp.array[wp.float64],
    running: wp.array[wp.int32],
    iterations: wp.array[wp.int32],
):
    b = wp.tid()
    if running[b] == 0:
        return
    iterations[b] = iterations[b] + 1
    if total(partial, b) <= tolerance * tolerance * floor[b]:
        running[b] = 0
