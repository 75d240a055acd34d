"""What a step and its derivative cost for many garments in one call, against one by itself.

    python benchmarks/batch.py
    python benchmarks/batch.py --device cuda --batch 64 512

A jacket, held at its shoulders, is lowered on a trunk and two arms. The state after a while is
stepped again and again: by `BatchCloth`, with as many copies as the batch is large, and by
`ExplicitBiasCloth`. Both are timed in turn in one process, and medians are taken, in ms a
garment-step: elapsed time on a GPU, processor time of the process on a CPU. The same is done in the
air. Copies of a garment touch the same, so none waits for another with more iterations.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from drake_dress.errors import UserError
from drake_dress.models.cloth.batch.cloth import BatchCloth
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, FloatArray, IntArray, make_elements
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.filtered_cg import SLIP, STICK
from drake_dress.models.cloth.material import Material
from drake_dress.models.garment import COATS, make_coat

# m: 1,793 nodes, as many as the controller's garment has; 392 nodes.
_SPACING, _QUICK_SPACING = 0.0264, 0.06
_STEP = 0.01
_SETTLING = 40
# m/s; how the jacket is lowered.
_LOWERING = np.array([0.02, 0.0, -0.1])
_LIMBS = Obstacles.resting(
    np.array([[0.0, 0.0, -0.7], [0.0, 0.19, -0.1], [0.0, -0.19, -0.1]]),
    np.array([[0.0, 0.0, -0.12], [0.0, 0.45, -0.25], [0.0, -0.45, -0.25]]),
    np.array([0.115, 0.045, 0.045]),
)


@dataclass(frozen=True)
class State:
    """One garment before the step that is timed: (n,3) x, v and (k,3) motion of the held."""

    elements: Elements
    held: IntArray
    x: FloatArray
    v: FloatArray
    motion: FloatArray
    limbs: Obstacles


def settled(spacing: float, limbs: Obstacles) -> State:
    """Returns the jacket of a mean edge length, m, after it was lowered on `limbs`."""
    mesh = make_coat(COATS["jacket"], spacing)
    elements = make_elements(mesh.rest_position, mesh.faces)
    held = mesh.held
    motion = np.tile(_STEP * _LOWERING, (len(held), 1))
    cloth = ExplicitBiasCloth(elements, Material(), _STEP, held)
    x, v = mesh.rest_position, np.zeros_like(mesh.rest_position)
    for _ in range(_SETTLING):
        x, v, _, _ = cloth.step(x, v, motion, limbs)
    return State(elements, held, x, v, motion, limbs)


def measure(state: State, batch: int, device: str, repeats: int) -> list[float]:
    """Returns ms of a step and of its derivative: alone, in the batch, and that by fabric too."""
    rng = np.random.default_rng(0)
    x, v, motion, limbs = state.x, state.v, state.motion, state.limbs
    scales = ((x, 1.0), (v, _STEP), (motion, 1e-3))
    x_bar, v_bar, r_bar = (scale * rng.normal(size=a.shape) for a, scale in scales)
    alone = ExplicitBiasCloth(state.elements, Material(), _STEP, state.held)
    cloth = BatchCloth(state.elements, Material(), _STEP, state.held, batch, device)
    bodies = cloth.bodies(limbs)

    def copies(array: FloatArray) -> wp.array:
        return wp.array(np.tile(array, (batch, 1, 1)), dtype=wp.vec3d, device=cloth.device)

    x_many, v_many, motion_many = copies(x), copies(v), copies(motion)
    x_bars, v_bars, r_bars = copies(x_bar), copies(v_bar), copies(r_bar)
    tape_alone = alone.step(x, v, motion, limbs)[3]
    tape = cloth.step(x_many, v_many, motion_many, bodies)[3]
    if not np.array_equal(tape.mode[0], tape_alone.mode):
        print("batch and garment differ in contact types", file=sys.stderr)
    clock = time.perf_counter if cloth.device.is_cuda else time.process_time

    def timed(run: Callable[[], object]) -> float:
        wp.synchronize_device(cloth.device)
        start = clock()
        run()
        wp.synchronize_device(cloth.device)
        return 1e3 * (clock() - start)

    runs: list[Callable[[], object]] = [
        lambda: alone.step(x, v, motion, limbs),
        lambda: alone.vector_jacobian_product(tape_alone, x_bar, v_bar, r_bar),
        lambda: cloth.step(x_many, v_many, motion_many, bodies),
        lambda: cloth.vector_jacobian_product(tape, x_bars, v_bars, r_bars),
        lambda: cloth.vector_jacobian_product(tape, x_bars, v_bars, r_bars, by_fabric=True),
    ]
    for run in runs:
        run()
    times = np.median([[timed(run) for run in runs] for _ in range(repeats)], axis=0)
    times[2:] /= batch
    return [float(t) for t in times]


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--batch", type=int, nargs="+", default=[1, 8, 64])
    parser.add_argument("--device", default="cpu", help="cpu, cuda or cuda:N (default cpu)")
    parser.add_argument("--quick", action="store_true", help="a coarse mesh, in seconds")
    options = parser.parse_args(arguments)
    spacing, repeats = (_QUICK_SPACING, 3) if options.quick else (_SPACING, 15)
    rows = []
    for name, limbs in (("air", Obstacles.none()), ("contact", _LIMBS)):
        state = settled(spacing, limbs)
        mode = (
            ExplicitBiasCloth(state.elements, Material(), _STEP, state.held)
            .step(state.x, state.v, state.motion, limbs)[3]
            .mode
        )
        print(
            f"{name}: {len(mode)} nodes, {np.sum(mode == STICK)} stick, {np.sum(mode == SLIP)} slip"
        )
        for batch in options.batch:
            try:
                rows.append((name, batch, *measure(state, batch, options.device, repeats)))
            except UserError as error:
                print(error, file=sys.stderr)
                return 2
    print(
        "\n| ms a garment-step | B | alone: step | derivative | batch: step | derivative |", end=""
    )
    print(" by fabric too | ratio: step | derivative |")
    print("| --- " * 9 + "|")
    for name, batch, step, back, batch_step, batch_back, fabric in rows:
        print(
            f"| {name} | {batch} | {step:.2f} | {back:.2f} | {batch_step:.2f} | {batch_back:.2f} "
            f"| {fabric:.2f} | {batch_step / step:.2f} | {batch_back / back:.2f} |"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
