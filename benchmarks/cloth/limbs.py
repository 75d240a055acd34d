"""Cost of tapered limbs: steps of a coat on a body of round cones, and on one of capsules.

The bodies have the same limbs with the same mean radii: eleven in the coat's trunk and sleeves. The
coat settles on each of them. Then the same step of each is timed in turn, so that other load on the
machine affects all alike. A third body tapers by a millionth: it is touched where the capsules are,
so that its steps cost what the arithmetic of round cones does.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cloth.comparison import Result
from benchmarks.cloth.garments import CONTROLLER_SPACING, QUICK_SPACING, grasp, jacket
from benchmarks.cloth.measure import Session
from benchmarks.cloth.scene import SOFT
from benchmarks.cloth.table import Table, milliseconds
from benchmarks.figures import Figure, at_most
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.garment import GarmentMesh
from drake_dress.models.sides import SIDES

# A limb is thicker by these shares at its first end than in the middle: capsules, almost, tapered.
_TAPERS = (0.0, 1e-6, 0.2)
# Radii of the trunk's parts, of upper arm, forearm and hand, m.
_TRUNK_RADIUS, _ARM_RADII = 0.10, (0.05, 0.042, 0.042)
_TRUNK_LENGTH, _TRUNK_OFFSET = 0.45, 0.06
# Angle by which the arms are lifted out of the sleeves' axes, rad, and duration, s.
_LIFT, _LIFT_TIME, _SETTLING = 0.6, 0.6, 0.3
_PLANT_SPACING, _PLANT_STEP, _CONTROLLER_STEP = 0.02, 0.004, 0.05
_REPEATS, _QUICK_REPEATS = 60, 5
_ASKED, _SEED = 1.2, 7

Step = Callable[[], None]


def body_in_coat(mesh: GarmentMesh, taper: float, angle: float, speed: float) -> Obstacles:
    """Returns a trunk and two arms in a coat in its rest pose.

    Args:
        mesh: The coat.
        taper: Share by which a limb is thicker at its first end than in the middle.
        angle: Angle by which the arms are lifted about their upper ends, rad.
        speed: Angular velocity of the lift, rad/s.
    """
    x = mesh.rest_position
    armhole = {side: x[mesh.loops[f"{side}_armhole"]].mean(axis=0) for side in SIDES}
    middle = 0.5 * (armhole["left"] + armhole["right"])
    a, b, radius, turning = [], [], [], []

    def add(first: FloatArray, second: FloatArray, r: float, omega: float) -> None:
        a.append(first)
        b.append(second)
        radius.append([r * (1.0 + taper), r * (1.0 - taper)])
        turning.append([omega, 0.0, 0.0])

    for offset in (-_TRUNK_OFFSET, 0.0, _TRUNK_OFFSET):
        top = middle + [0.0, offset, -_TRUNK_RADIUS]
        add(top, top - [0.0, 0.0, _TRUNK_LENGTH], _TRUNK_RADIUS, 0.0)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        cuff = x[mesh.loops[f"{side}_cuff"]].mean(axis=0)
        sine, cosine = np.sin(sign * angle), np.cos(angle)
        lift = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
        way = lift @ (cuff - armhole[side])
        start = armhole[side] - 0.1 * (cuff - armhole[side])
        joints = [start, start + 0.65 * way, start + 1.25 * way]
        for k, r in enumerate(_ARM_RADII):
            add(joints[k], joints[min(k + 1, 2)], r, sign * speed)
        add(start, middle, _ARM_RADII[0], 0.0)
    body = Obstacles.resting(np.array(a), np.array(b), np.array(radius))
    return replace(body, angular_velocity=np.array(turning))


def measure(session: Session) -> Result:
    """Returns the times of steps of plant and controller on both bodies."""
    rows = []
    for name, spacing, prepare in (
        ("plant", _PLANT_SPACING, _plant_step),
        ("controller, with adjoint", CONTROLLER_SPACING, _controller_step),
    ):
        if session.stop.is_set():
            break
        mesh = jacket(QUICK_SPACING if session.quick else spacing)
        rows.append({"step": name, "nodes": len(mesh.rest_position)})
        rows[-1] |= _timed(mesh, prepare, _QUICK_REPEATS if session.quick else _REPEATS)
        session.say(f"  limbs, {name}: tapered beside capsules {rows[-1]['ratio']:.3f}")
    return {"limbs": body_in_coat(jacket(QUICK_SPACING), 0.0, 0.0, 0.0).count, "runs": rows}


def _timed(mesh: GarmentMesh, prepare: Callable[..., tuple[Step, int]], repeats: int) -> Result:
    """Returns medians on the three bodies, and the medians of the ratios to capsules."""
    made = [prepare(mesh, taper) for taper in _TAPERS]
    taken = np.empty((repeats, 3))
    for k in range(-1, repeats):
        for j in np.roll(range(3), k):
            begin = time.perf_counter()
            made[j][0]()
            taken[max(k, 0), j] = time.perf_counter() - begin
    ratio = np.median(taken / taken[:, :1], axis=0)
    return {
        "contacts": [contacts for _, contacts in made],
        "median_s": np.median(taken, axis=0).tolist(),
        "ratio": float(ratio[2]),
        "arithmetic_ratio": float(ratio[1]),
    }


def _bodies(mesh: GarmentMesh, taper: float, h: float) -> list[Obstacles]:
    """Returns the body at each step of the lift and of the settling after it."""
    steps = round(_LIFT_TIME / h)
    angle = _LIFT * np.arange(steps) / steps
    lifted = [body_in_coat(mesh, taper, float(a), _LIFT / _LIFT_TIME) for a in angle]
    return lifted + [body_in_coat(mesh, taper, _LIFT, 0.0)] * round(_SETTLING / h)


def _plant_step(mesh: GarmentMesh, taper: float) -> tuple[Step, int]:
    """Returns a step of the plant on a settled coat, and its number of contacts."""
    cloth = ImplicitCloth(_elements(mesh), SOFT, _PLANT_STEP, grasp(mesh))
    state, still = ClothState.at_rest(mesh.rest_position), np.zeros((len(cloth.held), 3))
    bodies = _bodies(mesh, taper, _PLANT_STEP)
    for body in bodies:
        state, _ = cloth.step(state, body, still)

    def step() -> None:
        # as in a run, where bodies are new in every step
        cloth.step(state, bodies[-1].copy(), still)

    return step, _touching(state.mode)


def _controller_step(mesh: GarmentMesh, taper: float) -> tuple[Step, int]:
    """Returns a step of the controller with its adjoint, and its number of contacts."""
    x, h = mesh.rest_position, _CONTROLLER_STEP
    cloth = ExplicitBiasCloth(_elements(mesh), SOFT, h, grasp(mesh))
    v, still = np.zeros_like(x), np.zeros((len(cloth.held), 3))
    bodies = _bodies(mesh, taper, h)
    for body in bodies:
        x, v, _, tape = cloth.step(x, v, still, body)
    rng = np.random.default_rng(_SEED)
    x_bar, v_bar = rng.normal(size=x.shape), rng.normal(size=x.shape)
    force_bar = rng.normal(size=still.shape)

    def step() -> None:
        _, _, _, tape = cloth.step(x, v, still, bodies[-1].copy())
        cloth.vector_jacobian_product(tape, x_bar, v_bar, force_bar)

    return step, _touching(tape.mode)


def _elements(mesh: GarmentMesh) -> Elements:
    return make_elements(mesh.rest_position, mesh.faces)


def _touching(mode: IntArray) -> int:
    return int(np.count_nonzero((mode == STICK) | (mode == SLIP)))


def figures(result: Result | None) -> list[Figure]:
    """Returns the ratios beside what is asked."""
    found = []
    for run in (result or {"runs": []})["runs"]:
        name = f"limbs, {run['step']}"
        found.append(at_most(f"{name}: tapered beside capsules", run["ratio"], "", _ASKED))
        found.append(
            at_most(f"{name}: arithmetic of round cones", run["arithmetic_ratio"], "", _ASKED)
        )
    return found


def tables(result: Result) -> list[Table]:
    """Returns the table of both steps."""
    rows = [
        [
            run["step"],
            run["nodes"],
            " · ".join(map(str, run["contacts"])),
            *map(milliseconds, run["median_s"]),
            run["arithmetic_ratio"],
            run["ratio"],
        ]
        for run in result["runs"]
    ]
    header = ["step", "nodes", "contacts", "capsules ms", "almost ms", "tapered ms"]
    header += ["almost/capsules", "tapered/capsules"]
    return [Table(f"limbs: a coat on a body of {result['limbs']} limbs", header, rows)]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes nothing; the table is sufficient."""
    return []
