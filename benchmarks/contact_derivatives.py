"""Compares derivatives of contact steps with finite differences in random states.

    python benchmarks/contact_derivatives.py --states 1000

In each state, random grippers pull a sheet of random fabric over random moving limbs. A random
linear loss of positions, velocities and gripper forces after one step is differentiated along
random directions of position, velocity and gripper motion: by the adjoint, by differences with
fixed contact types, and by differences of the true map, in which contact types may change. The
table gives, for each step size, the smallest cosine and the largest relative error of the adjoint
against the first differences, and the distribution of the cosine against the second.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass

import numpy as np

from drake_dress.file_output import output_file, write_text
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.material import Material

STEPS = (0.001, 0.005, 0.01, 0.05, 0.1)
_DIRECTIONS = 8
# Short, because forces have kinks (where a hinge has lost its direction), m.
_DIFFERENCE = 1e-9


@dataclass(frozen=True)
class Comparison:
    """One state: contact counts, and the adjoint compared with finite differences."""

    time_step: float
    seed: int
    sticking: int
    slipping: int
    released: int
    cosine_held: float
    error_held: float
    cosine_true: float


def compare(seed: int, time_step: float) -> Comparison | None:
    """Returns the comparison in a random state; None if there is no contact."""
    rng = np.random.default_rng([seed, int(1e6 * time_step)])
    cloth, x, v, motion, limbs = _random_state(rng, time_step)
    tape = cloth.step(x, v, motion, limbs)[3]
    types = tape.types
    if not np.any(types.mode):
        return None
    weight = rng.normal(size=x.shape), time_step * rng.normal(size=x.shape)
    weight_r = 1e-3 * rng.normal(size=motion.shape)

    def loss(x: FloatArray, v: FloatArray, m: FloatArray, held: bool) -> float:
        x1, v1, r, _ = cloth.step(x, v, m, limbs, types if held else None)
        pull = np.sum(weight_r * r[cloth.held])
        return float(np.sum(weight[0] * x1) + np.sum(weight[1] * v1) + pull)

    g = cloth.vector_jacobian_product(tape, *weight, weight_r)
    exact: list[float] = []
    held: list[float] = []
    true: list[float] = []
    for _ in range(_DIRECTIONS):
        # A step moves nodes by h v: scale v so that x, v and gripper motion have similar effects.
        d = [rng.normal(size=a.shape) for a in (x, v, motion)]
        d[1] /= time_step
        slopes = zip((g.x, g.v, g.held_motion), d, strict=True)
        exact.append(float(sum(np.sum(a * b) for a, b in slopes)))
        for found, keep in ((held, True), (true, False)):
            ends = []
            for s in (1.0, -1.0):
                moved = [a + s * _DIFFERENCE * b for a, b in zip((x, v, motion), d, strict=True)]
                ends.append(loss(moved[0], moved[1], moved[2], keep))
            found.append((ends[0] - ends[1]) / (2.0 * _DIFFERENCE))
    return Comparison(
        time_step,
        seed,
        int(np.sum(types.mode == 1)),
        int(np.sum(types.mode == 2)),
        int(np.sum(types.mode == 0)),
        _cosine(exact, held),
        float(np.linalg.norm(np.subtract(exact, held)) / np.linalg.norm(held)),
        _cosine(exact, true),
    )


def _random_state(
    rng: np.random.Generator, time_step: float
) -> tuple[ExplicitBiasCloth, FloatArray, FloatArray, FloatArray, Obstacles]:
    columns, rows, spacing = rng.integers(8, 14), rng.integers(8, 14), rng.uniform(0.02, 0.04)
    x, faces = _sheet(int(columns), int(rows), spacing)
    x += 1e-4 * rng.normal(size=x.shape)
    material = Material(
        surface_density=rng.uniform(0.1, 0.4),
        stretch_stiffness=10.0 ** rng.uniform(1.3, 3.0),
        bending_stiffness=10.0 ** rng.uniform(-5.0, -3.0),
        friction=rng.uniform(0.1, 0.8),
    )
    elements = make_elements(x, faces)
    held = np.flatnonzero(x[:, 0] > x[:, 0].max() - 0.5 * spacing)[:3].astype(np.int32)
    count = int(rng.integers(1, 4))
    center = x.mean(axis=0) + np.array([0.0, 0.0, -0.06])
    a = center + rng.uniform(-0.1, 0.1, size=(count, 3)) * np.array([1.0, 1.0, 0.2])
    b = a + rng.uniform(-0.3, 0.3, size=(count, 3)) * np.array([1.0, 1.0, 0.3])
    limbs = Obstacles(
        a,
        b,
        rng.uniform(0.03, 0.06, size=count),
        0.1 * rng.normal(size=(count, 3)),
        0.5 * rng.normal(size=(count, 3)),
    )
    velocity = 0.1 * rng.normal(size=3) + np.array([0.0, 0.0, -0.1])
    settle = ExplicitBiasCloth(elements, material, 0.01, held)
    v = np.zeros_like(x)
    for _ in range(int(rng.integers(10, 40))):
        x, v, _, _ = settle.step(x, v, np.tile(0.01 * velocity, (len(held), 1)), limbs)
    cloth = ExplicitBiasCloth(
        elements, material, time_step, held, settings=ExplicitSettings(tolerance=1e-11)
    )
    return cloth, x, v, np.tile(time_step * velocity, (len(held), 1)), limbs


def _sheet(columns: int, rows: int, spacing: float) -> tuple[FloatArray, IntArray]:
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij"), -1)
    flat = spacing * grid.reshape(-1, 2)
    a = (np.arange(columns - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    faces = np.concatenate(
        [np.column_stack([a, a + rows, a + rows + 1]), np.column_stack([a, a + rows + 1, a + 1])]
    )
    return np.column_stack([flat, np.zeros(len(flat))]), faces.astype(np.int32)


def _cosine(a: list[float], b: list[float]) -> float:
    return float(np.dot(a, b) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))


def run(states: int) -> list[Comparison]:
    """Compares in `states` states with contact, distributed over the step sizes."""
    found: list[Comparison] = []
    seed = 0
    while len(found) < states:
        for h in STEPS:
            comparison = compare(seed, h)
            if comparison is not None and len(found) < states:
                found.append(comparison)
        seed += 1
        if seed % 20 == 0:
            print(f"{len(found)} of {states} states", file=sys.stderr, flush=True)
    return found


def print_table(found: list[Comparison]) -> None:
    """Prints a row for each step size."""
    print(
        "| h, s | states | contacts: stick, slip, let go | types held: cosine ≥ | error ≤ |", end=""
    )
    print(" true map: cosine, 1 % · 10 % · median |")
    print("| --- " * 6 + "|")
    for h in STEPS:
        part = [c for c in found if c.time_step == h]
        if not part:
            continue
        counts = [sum(getattr(c, k) for c in part) for k in ("sticking", "slipping", "released")]
        low, tenth, median = np.percentile([c.cosine_true for c in part], (1, 10, 50))
        print(
            f"| {h:g} | {len(part)} | {counts[0]}, {counts[1]}, {counts[2]} "
            f"| {min(c.cosine_held for c in part):.6f} | {max(c.error_held for c in part):.1e} "
            f"| {low:.3f} · {tenth:.4f} · {median:.6f} |"
        )


def main() -> int:
    """Runs the comparison; returns 1 if a bound is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--states", type=int, default=1000)
    parser.add_argument("--json", type=output_file, help="write all comparisons here")
    options = parser.parse_args()
    found = run(options.states)
    print_table(found)
    if options.json:
        write_text(options.json, json.dumps([asdict(c) for c in found], indent=1) + "\n")
    broken = [c for c in found if c.cosine_held < 0.999 or c.error_held > 1e-3]
    for c in broken:
        print(f"over the bound: seed {c.seed}, h {c.time_step}: {c.cosine_held}, {c.error_held}")
    return int(bool(broken))


if __name__ == "__main__":
    sys.exit(main())
