"""Conjugate gradients on the nodes whose motion is not prescribed, for all garments in step.

With Π leaving out the nodes that are held or stick, Π P Π z = Π b is solved. A garment alone has a
factor for its contacts; here each garment has its own contacts, so one inverse of P without the
held nodes serves all: it is exact for a garment without contact, and Π P⁻¹ Π has as many
eigenvalues other than one as there are directions in contact.

A garment that has converged is frozen, so its result does not depend on the others of the batch.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch.arrays import DeviceArray
from drake_dress.models.cloth.batch.inverse import Inverse
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.batch.reduction import CHUNK, chunk_count, total
from drake_dress.models.cloth.batch.system import System, row_product
from drake_dress.models.cloth.filtered_cg import FREE

wp.set_module_options({"enable_backward": False})

# What to do with a garment: nothing, one application of the inverse (it is exact), or iterate.
SKIP, DIRECT, ITERATE = 0, 1, 2
# On a GPU the host looks only so often whether all have converged: each look waits for the device.
ITERATIONS_PER_LOOK = {"cpu": 1, "cuda": 4}

_DIRECT = wp.constant(DIRECT)
_ITERATE = wp.constant(ITERATE)
_FREE = wp.constant(FREE)
_CHUNK = wp.constant(CHUNK)
_ZERO = wp.constant(wp.float64(0.0))
_TINY = wp.constant(wp.float64(1e-300))


@wp.func
def _of_free(z: wp.vec3d, mode: wp.int32) -> wp.vec3d:
    """Returns z of a node that is free, else zero."""
    if mode == _FREE:
        return z
    return wp.vec3d()


def iterate_where(flags: DeviceArray, otherwise: DeviceArray) -> DeviceArray:
    """Returns (B,) kinds of solve: ITERATE for flagged garments, as `otherwise` (B,) for others."""
    return _chosen(flags, otherwise, ITERATE)


def skip_where(flags: DeviceArray, otherwise: DeviceArray) -> DeviceArray:
    """Returns (B,) kinds of solve: SKIP for flagged garments, as `otherwise` (B,) for others."""
    return _chosen(flags, otherwise, SKIP)


def _chosen(flags: DeviceArray, otherwise: DeviceArray, kind: int) -> DeviceArray:
    kinds = wp.empty_like(flags)
    wp.launch(_choose, dim=len(flags), inputs=[flags, otherwise, kind, kinds], device=flags.device)
    return kinds


class ProjectedSolver:
    """Solves Π P Π z = Π b for every garment; holds its work arrays, so it is not reentrant.

    Attributes:
        inverse: the preconditioner.
        floor: (B,) squared residual against which convergence is judged.
        iterations: (B,) of the last solve.

    Args:
        system: P of the mesh.
        inverse: of P of the fabric that preconditions.
        tolerance: relative residual, in the preconditioner's norm, at which a garment stops.
        max_iterations: after which all stop.
    """

    def __init__(
        self, system: System, inverse: Inverse, tolerance: float, max_iterations: int
    ) -> None:
        batch, n = inverse.source.shape
        device = inverse.source.device
        self.inverse = inverse
        self.tolerance = tolerance
        self.max_iterations = max_iterations
        self._system = system
        self._device = device
        self._per_look = ITERATIONS_PER_LOOK["cuda" if device.is_cuda else "cpu"]
        self._direction, self._product = (
            wp.zeros((batch, n), dtype=wp.vec3d, device=device) for _ in range(2)
        )
        self._partial = wp.zeros((batch, chunk_count(n)), dtype=wp.float64, device=device)
        self._rho, self._step, self._turn, self.floor = (
            wp.zeros(batch, dtype=wp.float64, device=device) for _ in range(4)
        )
        self.iterations = wp.zeros(batch, dtype=wp.int32, device=device)

    def solve(
        self,
        parameters: Parameters,
        kind: DeviceArray,
        mode: DeviceArray,
        rhs: DeviceArray,
        z: DeviceArray,
        cold: bool = True,
    ) -> None:
        """Improves `z` (B,n) in place; its prescribed part is kept and moves to the other side.

        Args:
            parameters: the fabrics.
            kind: (B,) SKIP, DIRECT or ITERATE.
            mode: (B,n) contact types; all but FREE are prescribed.
            rhs: (B,n).
            z: (B,n) the start.
            cold: whether the start is that of a new system, against whose residual convergence is
                judged; else the last cold one's is used, so that a good start saves iterations.
        """
        batch, n = z.shape
        launch, running, residual = self._launch, self.inverse.running, self.inverse.source
        wp.copy(running, kind)
        launch(_residual, (batch, n), [self._system, parameters, kind, mode, rhs, z, residual])
        self.inverse.apply()
        launch(
            _project_and_dot,
            self._partial.shape,
            [running, mode, residual, self.inverse.image, self._direction, self._partial],
        )
        launch(
            _begin,
            batch,
            [self._partial, kind, self.tolerance, int(cold), self.floor, self._rho, running]
            + [self.iterations],
        )
        launch(_take_direct, (batch, n), [kind, self._direction, z])
        done = 0
        while done < self.max_iterations and self.inverse.any_running():
            for _ in range(self._per_look):
                self._iterate(parameters, mode, z)
                done += 1

    def _iterate(self, parameters: Parameters, mode: wp.array, z: wp.array) -> None:
        batch, n = z.shape
        launch, running, residual = self._launch, self.inverse.running, self.inverse.source
        launch(
            _search_product,
            (batch, n),
            [self._system, parameters, running, mode, self._direction, self._product],
        )
        launch(_dot, self._partial.shape, [running, self._direction, self._product, self._partial])
        launch(_step_length, batch, [self._partial, self._rho, running, self._step])
        launch(
            _advance,
            (batch, n),
            [running, self._step, self._direction, self._product, z, residual],
        )
        self.inverse.apply()
        # The product is used up: its memory takes the projected image.
        launch(
            _project_and_dot,
            self._partial.shape,
            [running, mode, residual, self.inverse.image, self._product, self._partial],
        )
        launch(
            _judge,
            batch,
            [self._partial, self.tolerance, self.floor, self._rho, self._turn, running]
            + [self.iterations],
        )
        launch(_turn_direction, (batch, n), [running, self._turn, self._product, self._direction])

    def _launch(self, kernel, dim, inputs: list) -> None:
        wp.launch(kernel, dim=dim, inputs=inputs, device=self._device)


@wp.kernel
def _residual(
    system: System,
    parameters: Parameters,
    kind: wp.array[wp.int32],
    mode: wp.array2d[wp.int32],
    rhs: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    residual: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if kind[b] == 0:
        return
    r = rhs[b, i] - row_product(system, parameters, z, b, i)
    residual[b, i] = _of_free(r, mode[b, i])


@wp.kernel
def _project_and_dot(
    running: wp.array[wp.int32],
    mode: wp.array2d[wp.int32],
    residual: wp.array2d[wp.vec3d],
    image: wp.array2d[wp.vec3d],
    out: wp.array2d[wp.vec3d],
    partial: wp.array2d[wp.float64],
):
    b, c = wp.tid()
    if running[b] == 0:
        return
    s = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, residual.shape[1])):
        y = _of_free(image[b, i], mode[b, i])
        out[b, i] = y
        s += wp.dot(residual[b, i], y)
    partial[b, c] = s


@wp.kernel
def _begin(
    partial: wp.array2d[wp.float64],
    kind: wp.array[wp.int32],
    tolerance: wp.float64,
    cold: wp.int32,
    floor: wp.array[wp.float64],
    rho: wp.array[wp.float64],
    running: wp.array[wp.int32],
    iterations: wp.array[wp.int32],
):
    b = wp.tid()
    iterations[b] = 0
    if kind[b] == 0:
        return
    r = total(partial, b)
    rho[b] = r
    if cold != 0:
        floor[b] = wp.max(r, _TINY)
    running[b] = 0
    if kind[b] == _ITERATE and r > tolerance * tolerance * floor[b]:
        running[b] = 1


@wp.kernel
def _take_direct(
    kind: wp.array[wp.int32], direction: wp.array2d[wp.vec3d], z: wp.array2d[wp.vec3d]
):
    b, i = wp.tid()
    if kind[b] == _DIRECT:
        z[b, i] = z[b, i] + direction[b, i]


@wp.kernel
def _search_product(
    system: System,
    parameters: Parameters,
    running: wp.array[wp.int32],
    mode: wp.array2d[wp.int32],
    direction: wp.array2d[wp.vec3d],
    product: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if running[b] == 0:
        return
    product[b, i] = _of_free(row_product(system, parameters, direction, b, i), mode[b, i])


@wp.kernel
def _dot(
    running: wp.array[wp.int32],
    a: wp.array2d[wp.vec3d],
    c: wp.array2d[wp.vec3d],
    partial: wp.array2d[wp.float64],
):
    b, k = wp.tid()
    if running[b] == 0:
        return
    s = _ZERO
    for i in range(k * _CHUNK, wp.min((k + 1) * _CHUNK, a.shape[1])):
        s += wp.dot(a[b, i], c[b, i])
    partial[b, k] = s


@wp.kernel
def _step_length(
    partial: wp.array2d[wp.float64],
    rho: wp.array[wp.float64],
    running: wp.array[wp.int32],
    step: wp.array[wp.float64],
):
    b = wp.tid()
    if running[b] == 0:
        return
    curvature = total(partial, b)
    if curvature > _ZERO:
        step[b] = rho[b] / curvature
    else:
        running[b] = 0


@wp.kernel
def _advance(
    running: wp.array[wp.int32],
    step: wp.array[wp.float64],
    direction: wp.array2d[wp.vec3d],
    product: wp.array2d[wp.vec3d],
    z: wp.array2d[wp.vec3d],
    residual: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if running[b] == 0:
        return
    z[b, i] = z[b, i] + step[b] * direction[b, i]
    residual[b, i] = residual[b, i] - step[b] * product[b, i]


@wp.kernel
def _judge(
    partial: wp.array2d[wp.float64],
    tolerance: wp.float64,
    floor: wp.array[wp.float64],
    rho: wp.array[wp.float64],
    turn: wp.array[wp.float64],
    running: wp.array[wp.int32],
    iterations: wp.array[wp.int32],
):
    b = wp.tid()
    if running[b] == 0:
        return
    new = total(partial, b)
    turn[b] = new / rho[b]
    rho[b] = new
    iterations[b] = iterations[b] + 1
    if new <= tolerance * tolerance * floor[b]:
        running[b] = 0


@wp.kernel
def _turn_direction(
    running: wp.array[wp.int32],
    turn: wp.array[wp.float64],
    image: wp.array2d[wp.vec3d],
    direction: wp.array2d[wp.vec3d],
):
    b, i = wp.tid()
    if running[b] == 0:
        return
    direction[b, i] = image[b, i] + turn[b] * direction[b, i]


@wp.kernel
def _choose(
    flags: wp.array[wp.int32],
    otherwise: wp.array[wp.int32],
    kind: wp.int32,
    kinds: wp.array[wp.int32],
):
    b = wp.tid()
    if flags[b] != 0:
        kinds[b] = kind
    else:
        kinds[b] = otherwise[b]
