"""Sums and maxima over the nodes of each garment, in a fixed order on every device.

A thread adds up `CHUNK` neighbours, then one thread per garment adds up the chunks: no atomics, so
that a sum repeats bit for bit and does not depend on the other garments of a batch.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})

CHUNK = 32
_CHUNK = wp.constant(CHUNK)
_ZERO = wp.constant(wp.float64(0.0))


def chunk_count(count: int) -> int:
    """Returns how many chunks `count` values make."""
    return (count + CHUNK - 1) // CHUNK


@wp.func
def total(partial: wp.array2d[wp.float64], b: wp.int32) -> wp.float64:
    """Returns the sum of row b."""
    s = _ZERO
    for c in range(partial.shape[1]):
        s += partial[b, c]
    return s


@wp.kernel
def chunk_sums(values: wp.array2d[wp.float64], partial: wp.array2d[wp.float64]):
    """Writes sums over the chunks of each row."""
    b, c = wp.tid()
    s = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, values.shape[1])):
        s += values[b, i]
    partial[b, c] = s


@wp.kernel
def chunk_largest(values: wp.array2d[wp.vec3d], partial: wp.array2d[wp.float64]):
    """Writes the largest component, by size, of each chunk."""
    b, c = wp.tid()
    s = _ZERO
    for i in range(c * _CHUNK, wp.min((c + 1) * _CHUNK, values.shape[1])):
        v = values[b, i]
        s = wp.max(s, wp.max(wp.abs(v[0]), wp.max(wp.abs(v[1]), wp.abs(v[2]))))
    partial[b, c] = s


@wp.kernel
def add_total(partial: wp.array2d[wp.float64], out: wp.array[wp.float64]):
    """Adds the sum of each row to `out` (B,)."""
    b = wp.tid()
    out[b] = out[b] + total(partial, b)


@wp.kernel
def difference_step(
    partial: wp.array2d[wp.float64], displacement: wp.float64, out: wp.array[wp.float64]
):
    """Writes displacement / largest (B,): 0 where nothing moves."""
    b = wp.tid()
    s = _ZERO
    for c in range(partial.shape[1]):
        s = wp.max(s, partial[b, c])
    if s > _ZERO:
        out[b] = displacement / s
    else:
        out[b] = _ZERO


def add_sums(values: wp.array, out: wp.array) -> None:
    """Adds the sums over the rows of `values` (B,k) to `out` (B,)."""
    batch, count = values.shape
    if count == 0:
        return
    device = values.device
    partial = wp.empty((batch, chunk_count(count)), dtype=wp.float64, device=device)
    wp.launch(chunk_sums, partial.shape, inputs=[values], outputs=[partial], device=device)
    wp.launch(add_total, batch, inputs=[partial], outputs=[out], device=device)


def steps_for(velocity: wp.array, displacement: float) -> wp.array:
    """Returns (B,) times in which the fastest component of `velocity` (B,n) moves that far, s."""
    batch, count = velocity.shape
    device = velocity.device
    partial = wp.empty((batch, chunk_count(count)), dtype=wp.float64, device=device)
    out = wp.empty(batch, dtype=wp.float64, device=device)
    wp.launch(chunk_largest, partial.shape, inputs=[velocity], outputs=[partial], device=device)
    wp.launch(difference_step, batch, inputs=[partial, displacement], outputs=[out], device=device)
    return out
