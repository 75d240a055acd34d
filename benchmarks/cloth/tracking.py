"""The paper's single-sleeve task: an armhole follows a target from the hand to the shoulder.

The grippers move by the transposed Jacobian of one cloth step (the paper's law for ṗ_rl and ṗ_rr).
With e = x_tar − x_cl, and x_cl the mean of six nodes of the left armhole,

    ṗ = K Σ_held (∂x_cl / ∂p)ᵀ e,

which takes one vector-Jacobian product per step for both grippers. The arm points toward the coat's
left armhole, through its open front.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from benchmarks.cloth.comparison import Result
from benchmarks.cloth.figures import Line, Panel, write_figure
from benchmarks.cloth.garments import CONTROLLER_SPACING, QUICK_SPACING, grasp, jacket
from benchmarks.cloth.measure import Session
from benchmarks.cloth.scene import SOFT
from benchmarks.cloth.table import Table, milliseconds
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth
from drake_dress.models.dressing.linking import arm_linking_number

_STEP = 0.01
# From the hand to the shoulder, in the coat's frame: through the open front.
_ARM_DIRECTION = np.array([0.50, -0.86, 0.06])
_ARM_LENGTH, _ARM_RADIUS = 0.50, 0.035
# Initial distance of the hand's tip from the armhole's centre, m.
_GAP = 0.05
# The coat settles, then the target waits at the hand, then it moves along the arm, s.
_SETTLING, _WAITING = 1.0, 1.5
_TARGET_SPEED = 0.08  # m/s
_END_WAITING = 1.0
_GAIN = 60.0  # K, 1/s; large, since the Jacobian of one step is a few per cent
_FASTEST = 0.25  # of a gripper, m/s; at higher speed nodes pass through the hand
_KEY_NODES = 6
# Duration of the approach, whose error does not count, s.
_APPROACH = 1.0


def measure(session: Session) -> Result:
    """Returns the trajectories, the tracking error, and whether the sleeve is on."""
    mesh = jacket(QUICK_SPACING if session.quick else CONTROLLER_SPACING)
    held, x = grasp(mesh), mesh.rest_position
    loop = mesh.loops["left_armhole"]
    key = loop[np.round(np.arange(_KEY_NODES) * len(loop) / _KEY_NODES).astype(int)]
    along = _ARM_DIRECTION / np.linalg.norm(_ARM_DIRECTION)
    hand = x[loop].mean(axis=0) + _GAP * along
    shoulder = hand + _ARM_LENGTH * along
    arm = Obstacles.resting(
        (hand + _ARM_RADIUS * along)[None], shoulder[None], np.array([_ARM_RADIUS])
    )
    session.say(f"tracking: {len(x)} nodes, arm of {_ARM_LENGTH} m")
    cloth = ExplicitBiasCloth(make_elements(x, mesh.faces), SOFT, _STEP, held)
    duration = _WAITING + _ARM_LENGTH / _TARGET_SPEED + _END_WAITING
    if session.quick:
        duration = 0.5
    motion: FloatArray = np.zeros((len(held), 3))
    v: FloatArray = np.zeros_like(x)
    for _ in range(round(_SETTLING / _STEP)):
        if session.stop.is_set():
            break
        x, v, _, _ = cloth.step(x, v, motion, arm)
    course = _Course(hand, along, key)
    for k in range(round(duration / _STEP)):
        if session.stop.is_set():
            break
        x, v, motion = course.step(cloth, x, v, motion, arm, k * _STEP)
    error, cost = course.error, course.cost
    followed = error[round((_WAITING + _APPROACH) / _STEP) :] if not session.quick else error
    links = arm_linking_number(
        x[loop], shoulder, 0.5 * (hand + shoulder), hand, shoulder + 0.2 * along
    )
    result = {
        "nodes": len(x),
        "time_step_s": _STEP,
        "gain_1_s": _GAIN,
        "arm": {"hand": hand.tolist(), "shoulder": shoulder.tolist(), "radius": _ARM_RADIUS},
        "time_s": [k * _STEP for k in range(len(error))],
        "trajectory_m": course.kept,
        "error_m": error,
        "error_followed_mean_m": float(np.mean(followed)) if followed else None,
        "error_followed_max_m": max(followed, default=None),
        "error_end_m": error[-1] if error else None,
        "linking": links,
        "contacts_most": max(course.contacts, default=0),
        "penetration_m": max(0.0, course.deepest),
        "cost_median_s": float(np.median(cost)) if cost else None,
    }
    if error:
        session.say(
            f"  error {100 * np.mean(followed):.1f} cm while following, {100 * error[-1]:.1f} cm "
            f"at the end, armhole round the arm: {'yes' if abs(links) == 1 else 'no'}"
        )
    return result


class _Course:
    """Follows the target with the gradient of the sleeve's error, and keeps what happens.

    Args:
        hand: (3,) start of the target, m.
        along: (3,) unit, its direction.
        key: nodes whose mean is the sleeve's position.
    """

    def __init__(self, hand: FloatArray, along: FloatArray, key: IntArray) -> None:
        self._hand, self._along, self._key = hand, along, key
        self.kept: dict[str, list[list[float]]] = {
            name: [] for name in ("sleeve", "left", "right", "target")
        }
        self.error: list[float] = []
        self.cost: list[float] = []
        self.contacts: list[int] = []
        self.deepest = 0.0

    def step(
        self,
        cloth: ExplicitBiasCloth,
        x: FloatArray,
        v: FloatArray,
        motion: FloatArray,
        arm: Obstacles,
        now: float,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns position, velocity and the next motion of the held nodes after one step."""
        key, held = self._key, cloth.held
        way = min(max(now - _WAITING, 0.0) * _TARGET_SPEED, _ARM_LENGTH)
        target = self._hand + way * self._along
        begin = time.perf_counter()
        x, v, _, tape = cloth.step(x, v, motion, arm)
        sleeve = x[key].mean(axis=0)
        x_bar = np.zeros_like(x)
        x_bar[key] = (target - sleeve) / _KEY_NODES
        none = np.zeros((len(held), 3))
        gradient = cloth.vector_jacobian_product(tape, x_bar, np.zeros_like(x), none)
        motion = _gripper_motion(gradient.held_motion)
        self.cost.append(time.perf_counter() - begin)
        half = len(held) // 2
        for name, point in (
            ("sleeve", sleeve),
            ("target", target),
            ("left", x[held[:half]].mean(axis=0)),
            ("right", x[held[half:]].mean(axis=0)),
        ):
            self.kept[name].append(point.tolist())
        self.error.append(float(np.linalg.norm(target - sleeve)))
        near = find_proximity(x, arm, 0.0)
        self.contacts.append(int(np.count_nonzero(near.gap < SOFT.margin + 1e-3)))
        # held nodes move with the gripper regardless of the arm
        free = np.setdiff1d(np.arange(len(x)), held)
        self.deepest = max(self.deepest, -float(near.gap[free].min()))
        return x, v, motion


def _gripper_motion(held_gradient: FloatArray) -> FloatArray:
    """Returns the held nodes' motion (k,3) over a step; each gripper's patch moves rigidly."""
    motion = np.empty_like(held_gradient)
    half = len(held_gradient) // 2
    for part in (slice(0, half), slice(half, None)):
        velocity = _GAIN * held_gradient[part].sum(axis=0)
        speed = float(np.linalg.norm(velocity))
        motion[part] = _STEP * velocity * min(1.0, _FASTEST / max(speed, 1e-12))
    return motion


def tables(result: Result) -> list[Table]:
    """Returns a table with one row."""
    row = [
        str(result["nodes"]),
        *(
            None if result[key] is None else 100.0 * result[key]
            for key in ("error_followed_mean_m", "error_followed_max_m", "error_end_m")
        ),
        "yes" if abs(result["linking"]) == 1 else "no",
        result["contacts_most"],
        1e3 * result["penetration_m"],
        milliseconds(result["cost_median_s"]),
    ]
    header = [
        "nodes",
        "mean error cm",
        "most cm",
        "end cm",
        "armhole round arm",
        "contacts",
        "inside mm",
        "step and adjoint ms",
    ]
    title = "tracking: a sleeve follows a target from hand to shoulder by the transposed Jacobian"
    return [Table(title, header, [row])]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes the pair of plots as in the paper: trajectories, and the error over time."""
    path = {name: np.array(points) for name, points in result["trajectory_m"].items()}
    if not len(path["sleeve"]):
        return []
    names = {"sleeve": "sleeve state x_cl", "left": "grasp point p_rl", "right": "grasp point p_rr"}
    arm = np.array([result["arm"]["hand"], result["arm"]["shoulder"]])
    # view from above, since the arm is nearly horizontal
    lines = [Line(path[name][:, 1], path[name][:, 0], label) for name, label in names.items()]
    lines.append(
        Line(path["target"][:, 1], path["target"][:, 0], "target x_tar", "--", color="red")
    )
    lines.append(Line(arm[:, 1], arm[:, 0], "arm", ":", color="black"))
    file = folder / "cloth_tracking.png"
    error = Line(result["time_s"], [100.0 * e for e in result["error_m"]], "‖x_tar − x_cl‖")
    write_figure(
        file,
        [
            Panel("trajectories from above", "y, m", "x, m", lines, equal=True),
            Panel("tracking error", "time, s", "cm", [error]),
        ],
    )
    return [file]
