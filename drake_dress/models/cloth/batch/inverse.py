"""The inverse of one fabric's P without the held nodes, applied to many garments at once."""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import warp as wp

from drake_dress.models.cloth.batch.partition import Stage, make_partition
from drake_dress.models.cloth.elements import BoolArray

wp.set_module_options({"enable_backward": False})

# Garments for which one thread applies the inverse, in batches of at least as many: on the CPU its
# entries, not its arithmetic, take the time (1.7 times faster so at 64 garments of 1,800 nodes).
_TOGETHER = 4

# What a stage of the partitioned inverse costs, in entries. The CPU is held up by its launch for
# some microseconds, a GPU also stands almost idle during small stages.
_STAGE_COST = {"cpu": 5_000.0, "cuda": 20_000.0}


class Inverse:
    """P⁻¹ from `source` to `image`, for the garments that run.

    Attributes:
        source, image: (B,n) vectors; rows of held nodes of the image are zero.
        running: (B,) whether a garment still wants it.

    Args:
        matrix: (n,n) P.
        held: (n,) nodes that are left out.
        batch: B.
        device: where it runs.
    """

    def __init__(
        self, matrix: sp.csc_matrix, held: BoolArray, batch: int, device: wp.Device
    ) -> None:
        kind = "cuda" if device.is_cuda else "cpu"
        self.source, self.image, self._middle = (
            wp.zeros((batch, len(held)), dtype=wp.vec3d, device=device) for _ in range(3)
        )
        self.running = wp.zeros(batch, dtype=wp.int32, device=device)
        # On the CPU this is the array's own memory: a look costs no copy.
        self._running_here = self.running.numpy() if not device.is_cuda else None
        self._device = device
        self._commands = self._record(make_partition(matrix, held, _STAGE_COST[kind]))

    def apply(self) -> None:
        """Writes P⁻¹ of the source to the image."""
        for command in self._commands:
            command.launch()

    def any_running(self) -> bool:
        """Returns whether any garment runs; waits for the device."""
        here = self._running_here
        return bool(np.any(self.running.numpy() if here is None else here))

    def _record(self, partition) -> list:
        """Returns the launches of all stages. Held nodes are in none: their image stays zero."""
        batch = len(self.running)
        kernel, threads = _apply_stage, batch
        if batch >= _TOGETHER:
            kernel, threads = _apply_stage_to_four, (batch + _TOGETHER - 1) // _TOGETHER
        commands = []
        for stages, source, target in (
            (partition.forward, self.source, self._middle),
            (partition.backward, self._middle, self.image),
        ):
            for stage in stages:
                inputs = [_on_device(stage, self._device), self.running, source, target]
                command = wp.launch(
                    kernel,
                    dim=(threads, len(stage.row)),
                    inputs=inputs,
                    device=self._device,
                    record_cmd=True,
                )
                commands.append(command)
        return commands


@wp.struct
class DeviceStage:
    """A `Stage` on a device."""

    row: wp.array[wp.int32]
    start: wp.array[wp.int32]
    split: wp.array[wp.int32]
    column: wp.array[wp.int32]
    weight: wp.array[wp.float64]


def _on_device(stage: Stage, device: wp.Device) -> DeviceStage:
    result = DeviceStage()
    for name in ("row", "start", "split", "column"):
        setattr(result, name, wp.array(getattr(stage, name), dtype=wp.int32, device=device))
    result.weight = wp.array(stage.weight, dtype=wp.float64, device=device)
    return result


@wp.kernel
def _apply_stage(
    stage: DeviceStage,
    running: wp.array[wp.int32],
    source: wp.array2d[wp.vec3d],
    target: wp.array2d[wp.vec3d],
):
    b, r = wp.tid()
    if running[b] == 0:
        return
    value = wp.vec3d()
    middle = stage.split[r]
    for q in range(stage.start[r], middle):
        value += stage.weight[q] * source[b, stage.column[q]]
    for q in range(middle, stage.start[r + 1]):
        value += stage.weight[q] * target[b, stage.column[q]]
    target[b, stage.row[r]] = value


@wp.kernel
def _apply_stage_to_four(
    stage: DeviceStage,
    running: wp.array[wp.int32],
    source: wp.array2d[wp.vec3d],
    target: wp.array2d[wp.vec3d],
):
    """As `_apply_stage`, bit for bit, with each entry read once for four garments.

    A group that is not full names the last garment more than once and writes it the same values.
    Garments that have stopped may be written too: nobody reads their image.
    """
    group, r = wp.tid()
    last = running.shape[0] - 1
    b0 = group * wp.static(_TOGETHER)
    b1 = wp.min(b0 + 1, last)
    b2 = wp.min(b0 + 2, last)
    b3 = wp.min(b0 + 3, last)
    if running[b0] + running[b1] + running[b2] + running[b3] == 0:
        return
    v0 = wp.vec3d()
    v1 = wp.vec3d()
    v2 = wp.vec3d()
    v3 = wp.vec3d()
    middle = stage.split[r]
    for q in range(stage.start[r], middle):
        w = stage.weight[q]
        c = stage.column[q]
        v0 += w * source[b0, c]
        v1 += w * source[b1, c]
        v2 += w * source[b2, c]
        v3 += w * source[b3, c]
    for q in range(middle, stage.start[r + 1]):
        w = stage.weight[q]
        c = stage.column[q]
        v0 += w * target[b0, c]
        v1 += w * target[b1, c]
        v2 += w * target[b2, c]
        v3 += w * target[b3, c]
    i = stage.row[r]
    target[b0, i] = v0
    target[b1, i] = v1
    target[b2, i] = v2
    target[b3, i] = v3
