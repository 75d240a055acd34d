"""Cost of the adjoint of a step in contact: a coat of 1,793 nodes with an arm in its sleeve."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cloth.comparison import Result
from benchmarks.cloth.garments import CONTROLLER_SPACING, QUICK_SPACING, grasp, jacket
from benchmarks.cloth.measure import Session
from benchmarks.cloth.scene import SOFT, TIME_STEPS
from benchmarks.cloth.table import Table, milliseconds
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth
from drake_dress.models.garment import GarmentMesh

_ARM_RADIUS = 0.047
# Angle by which the arm is lifted out of the sleeve's axis, rad, and duration, s: about 150 of the
# coat's 1,793 nodes then lie on it.
_LIFT, _LIFT_TIME = 0.6, 0.6
_SETTLING = 0.3
_REPEATS = 25
_SEED = 7


def arm_in_sleeve(mesh: GarmentMesh, angle: float, speed: float) -> Obstacles:
    """Returns an arm in the left sleeve that extends from above the armhole to below the cuff.

    Args:
        mesh: A coat in its rest pose.
        angle: Angle by which the arm is lifted about its upper end, rad.
        speed: Angular velocity of the lift, rad/s.
    """
    armhole = mesh.rest_position[mesh.loops["left_armhole"]].mean(axis=0)
    cuff = mesh.rest_position[mesh.loops["left_cuff"]].mean(axis=0)
    a, b = armhole - 0.1 * (cuff - armhole), armhole + 1.15 * (cuff - armhole)
    cosine, sine = np.cos(angle), np.sin(angle)
    lift = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
    tip = a + lift @ (b - a)
    rest = Obstacles.resting(a[None], tip[None], np.array([_ARM_RADIUS]))
    return replace(rest, angular_velocity=np.array([[speed, 0.0, 0.0]]))


def measure(session: Session) -> Result:
    """Returns the times of a step and of its adjoint for each time step."""
    mesh = jacket(QUICK_SPACING if session.quick else CONTROLLER_SPACING)
    session.say(f"backward: {len(mesh.rest_position)} nodes, an arm in the left sleeve")
    rows = []
    for h in (0.01,) if session.quick else TIME_STEPS:
        if session.stop.is_set():
            break
        rows.append(_one_step(mesh, h))
        session.say(
            f"  h {1e3 * h:5.4g} ms: {rows[-1]['contacts']} contacts, step "
            f"{1e3 * rows[-1]['step_median_s']:.2f} ms, adjoint "
            f"{1e3 * rows[-1]['adjoint_median_s']:.2f} ms"
        )
    return {"nodes": len(mesh.rest_position), "runs": rows}


def _one_step(mesh: GarmentMesh, h: float) -> Result:
    """Settles the coat on the arm, then repeatedly times the same step and its adjoint."""
    held = grasp(mesh)
    x = mesh.rest_position
    cloth = ExplicitBiasCloth(make_elements(x, mesh.faces), SOFT, h, held)
    still = np.zeros((len(held), 3))
    v: FloatArray = np.zeros_like(x)
    steps = round(_LIFT_TIME / h)
    for k in range(steps):
        moving = arm_in_sleeve(mesh, _LIFT * k / steps, _LIFT / _LIFT_TIME)
        x, v, _, _ = cloth.step(x, v, still, moving)
    arm = arm_in_sleeve(mesh, _LIFT, 0.0)
    for _ in range(round(_SETTLING / h)):
        x, v, _, _ = cloth.step(x, v, still, arm)
    rng = np.random.default_rng(_SEED)
    x_bar, v_bar = rng.normal(size=x.shape), rng.normal(size=x.shape)
    force_bar = rng.normal(size=(len(held), 3))
    forward, backward = [], []
    for k in range(_REPEATS + 1):
        begin = time.perf_counter()
        _, _, _, tape = cloth.step(x, v, still, arm)
        middle = time.perf_counter()
        gradient = cloth.vector_jacobian_product(tape, x_bar, v_bar, force_bar)
        if k:  # the first adjoint compiles its kernels
            forward.append(middle - begin)
            backward.append(time.perf_counter() - middle)
    return {
        "time_step_s": h,
        "contacts": int(np.count_nonzero((tape.mode == STICK) | (tape.mode == SLIP))),
        "slipping": int(np.count_nonzero(tape.mode == SLIP)),
        "step_median_s": float(np.median(forward)),
        "adjoint_median_s": float(np.median(backward)),
        "ratio": float(np.median(np.array(backward) / np.array(forward))),
        "finite": bool(np.isfinite(gradient.x).all() and np.isfinite(gradient.held_motion).all()),
    }


def tables(result: Result) -> list[Table]:
    """Returns the table over time steps."""
    rows = [
        [
            f"{1e3 * run['time_step_s']:g}",
            run["contacts"],
            run["slipping"],
            milliseconds(run["step_median_s"]),
            milliseconds(run["adjoint_median_s"]),
            run["ratio"],
            "yes" if run["finite"] else "no",
        ]
        for run in result["runs"]
    ]
    header = ["h ms", "contacts", "slipping", "step ms", "adjoint ms", "ratio", "finite"]
    return [Table(f"backward: {result['nodes']} nodes, an arm in a sleeve", header, rows)]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes nothing; the table is sufficient."""
    return []
